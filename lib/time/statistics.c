/* statistics.c: prints counts in the layouts of SUNDIALS' ...PrintAllStats: a line per count, or rows of CSV. */
#include <stdio.h>

#include "base/error.h"
#include "base/plain_locale.h"
#include "flesh/solver.h"

/* X(member, name): lists of the counts and of the real numbers, from which both layouts are made. */
#define STATISTICS(X)                                    \
  X(steps, "Steps")                                      \
  X(rejected, "Error test fails")                        \
  X(convergence_failures, "NLS step fails")              \
  X(impact_steps, "Impact steps")                        \
  X(damped_steps, "Damped steps")                        \
  X(solves, "NLS solves")                                \
  X(multiplier_updates, "Multiplier updates")            \
  X(newton, "NLS iters")                                 \
  X(backtracks, "Backtracks")                            \
  X(subdomains, "Subdomains")                               \
  X(subdomain_newton, "NLS iters in subdomains")           \
  X(watchdog_steps, "Watchdog steps")                      \
  X(potential_rises, "Potential rises")                  \
  X(linear, "LS iters")                                  \
  X(linear_single, "LS iters in single")                 \
  X(direct, "LS by factorisation")                       \
  X(assemblies, "Jac fn evals")                          \
  X(projections, "Projected Jac fn evals")               \
  X(residuals, "Residual fn evals")                      \
  X(potentials, "Potential fn evals")                    \
  X(at_rounding, "NLS solves at rounding")         \
  X(unconverged, "Unconverged NLS solves")      \
  X(untanglings, "Untanglings")                          \
  X(untangled_nodes, "Untangled nodes")                  \
  X(order, "Last order")

#define REAL_STATISTICS(X)                               \
  X(subdomain_share, "Subdomain iters by size")          \
  X(h_last, "Last step size")                            \
  X(residual_first, "First residual norm")               \
  X(residual_last, "Last residual norm")                 \
  X(residual_target, "Target residual norm")

static int print_table(const flesh_solve_stats *stats, FILE *file)
{
  int length = 0;
#define LINE(member, name) length = length < 0 ? length : fprintf(file, "%-28s = %d\n", name, stats->member);
#define REAL_LINE(member, name) length = length < 0 ? length : fprintf(file, "%-28s = %.17g\n", name, stats->member);
  STATISTICS(LINE)
  REAL_STATISTICS(REAL_LINE)
#undef LINE
#undef REAL_LINE
  return length;
}

static int print_csv(const flesh_solve_stats *stats, int header, FILE *file)
{
  int length = 0;
  const char *separator = "";
#define NAME(member, name) length = length < 0 ? length : fprintf(file, "%s%s", separator, name), separator = ",";
  if (header) {
    STATISTICS(NAME)
    REAL_STATISTICS(NAME)
    if (length >= 0) length = fprintf(file, "\n");
  }
#undef NAME
  separator = "";
#define VALUE(member, name)                                                                                            \
  length = length < 0 ? length : fprintf(file, "%s%d", separator, stats->member), separator = ",";
#define REAL_VALUE(member, name) length = length < 0 ? length : fprintf(file, "%s%.17g", separator, stats->member);
  STATISTICS(VALUE)
  REAL_STATISTICS(REAL_VALUE)
#undef VALUE
#undef REAL_VALUE
  return length < 0 ? length : fprintf(file, "\n");
}

int flesh_solve_stats_print(const flesh_solve_stats *stats, flesh_stats_format format, FILE *file)
{
  FLESH_NEED({stats, "stats"}, {file, "file"});
  if ((unsigned)format > FLESH_STATS_CSV_ROW)
    return flesh_fail(FLESH_ERR_ARGUMENT, "there is no layout %d of statistics; 0 to 2 are valid", (int)format);
  flesh_plain_locale locale;
  const int status = flesh_plain_locale_begin(&locale);
  if (status) return status;
  const int length =
      format == FLESH_STATS_TABLE ? print_table(stats, file) : print_csv(stats, format == FLESH_STATS_CSV, file);
  flesh_plain_locale_end(&locale);
  return length < 0 ? flesh_fail(FLESH_ERR_FILE, "the statistics could not be written") : FLESH_OK;
}
