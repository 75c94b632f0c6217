/* table.c: the comparison as drift.csv, as a table on stdout, and in words. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "drift/drift.h"
#include "base/file.h"
#include "shared/table.h"

const char *flesh_drift_status_word(const flesh_drift_case *c)
{
  if (c->figures.crashed_by) return "crashed";
  switch (c->figures.status) {
  case FLESH_OK: return c->figures.stressed_rest > 0 ? "stressed rest" : "complete";
  case FLESH_UNDEFINED: return "undefined";
  case FLESH_NONFINITE:
  case FLESH_ERR_NONFINITE: return "non-finite";
  case FLESH_ERR_BUDGET: return "out of budget";
  case FLESH_ERR_INTERRUPTED: return c->figures.tets ? "interrupted" : "not run";
  case FLESH_ERR_ARGUMENT: return "refused";
  case FLESH_ERR_ENERGY: return "energy grew";
  default: return "not converged";
  }
}

static int write_csv(const flesh_drift_plan *plan)
{
  flesh_file file;
  int status = flesh_table_open(plan->out, "drift.csv", &file);
  if (status) return status;
  fputs("scene,energy,poisson,constants,tets,status,max_volume_drift,final_volume_drift,"
        "rest_volume_ratio,rest_volume_ratio_theory,min_J,max_inverted,newton_per_step,"
        "linear_per_newton,wall_s,failed_at,solver,first_inverted_step,distance_from_rest,stressed_rest_J\n",
        file.stream);
  for (int k = 0; k < plan->case_count; k++) {
    const flesh_drift_case *c = &plan->cases[k];
    const flesh_drift_variant *v = &plan->variants[c->variant];
    const struct flesh_drift_figures *f = &c->figures;
    fprintf(file.stream, "%s,%s,", plan->names[c->scene], flesh_energy_name(v->energy));
    flesh_number_print(file.stream, plan->poissons[c->poisson]);
    fprintf(file.stream, ",%s,%d,%s", flesh_constants_name(v->constants), f->tets,
            flesh_drift_status_word(c));
    flesh_table_field(file.stream, f->max_volume_drift);
    flesh_table_field(file.stream, f->final_volume_drift);
    flesh_table_field(file.stream, f->rest_volume_ratio);
    flesh_table_field(file.stream, f->rest_volume_ratio_theory);
    flesh_table_field(file.stream, f->min_J);
    fprintf(file.stream, ",%d", f->max_inverted);
    flesh_table_field(file.stream, f->newton_per_step);
    flesh_table_field(file.stream, f->linear_per_newton);
    flesh_table_field(file.stream, f->wall_s);
    flesh_table_field(file.stream, f->failed_at);
    fprintf(file.stream, ",%s,", flesh_drift_solver_name(c->solver));
    if (f->first_inverted_step >= 0) fprintf(file.stream, "%d", f->first_inverted_step);
    flesh_table_field(file.stream, f->distance_from_rest);
    flesh_table_field(file.stream, f->stressed_rest);
    putc('\n', file.stream);
  }
  return flesh_file_commit(&file);
}

/* A number in a column; a dash for NaN, and no more digits than can be read. */
static void cell(double value, int width, const char *format)
{
  char text[FLESH_TABLE_TEXT] = "-";
  if (!isnan(value)) flesh_table_text(text, fabs(value) >= 1e5 ? "%.0e" : format, value);
  printf(" %*s", width, text);
}

int flesh_drift_write_table(const flesh_drift_plan *plan)
{
  int status = write_csv(plan);
  printf("\n%-20s %-8s %6s %-8s %-13s %9s %9s %8s %8s %8s %5s %8s %8s\n", "scene", "energy", "poisson",
         "solver", "status", "max", "final", "rest", "theory", "min J", "inv", "shape", "wall");
  printf("%-20s %-8s %6s %-8s %-13s %9s %9s %8s %8s %8s %5s %8s %8s\n", "", "", "", "", "", "drift %",
         "drift %", "volume", "volume", "", "", "off %", "s");
  for (int k = 0; k < plan->case_count; k++) {
    const flesh_drift_case *c = &plan->cases[k];
    const struct flesh_drift_figures *f = &c->figures;
    char title[16];
    flesh_drift_variant_title(plan->variants[c->variant], title);
    printf("%-20s %-8s %6g %-8s %-13s", plan->names[c->scene], title, plan->poissons[c->poisson],
           flesh_drift_solver_name(c->solver), flesh_drift_status_word(c));
    cell(100 * f->max_volume_drift, 9, "%.3f");
    cell(100 * f->final_volume_drift, 9, "%.3f");
    cell(f->rest_volume_ratio, 8, "%.5f");
    cell(f->rest_volume_ratio_theory, 8, "%.5f");
    cell(f->min_J, 8, "%.3f");
    printf(" %5d", f->max_inverted);
    cell(100 * f->distance_from_rest, 8, "%.2f");
    cell(f->wall_s, 8, "%.2f");
    putchar('\n');
  }
  printf("max/final drift: of the body's volume, over the run and at its end; rest volume: of its equilibrium with\n"
         "the pins alone, theory: of a free body; inv: most inverted tets at a time; shape off: largest distance\n"
         "from the rest shape at the end, of the body's length.\n");
  int rests = 0;
  for (int k = 0; k < plan->case_count; k++) rests += plan->cases[k].figures.stressed_rest > 0;
  if (rests)
    printf("stressed rest: %d run%s ended at rest in a stressed state that no load holds (stressed_rest_J in "
           "drift.csv).\n",
           rests, rests == 1 ? "" : "s");
  return status;
}

/* Writes to both streams. */
#define SAY(...)                                                                                   \
  do {                                                                                             \
    printf(__VA_ARGS__);                                                                           \
    fprintf(stream, __VA_ARGS__);                                                                  \
  } while (0)

static const flesh_drift_case *find(const flesh_drift_plan *plan, int scene, int poisson, int variant,
                                    flesh_drift_solver solver)
{
  for (int k = 0; k < plan->case_count; k++) {
    const flesh_drift_case *c = &plan->cases[k];
    if (c->scene == scene && c->poisson == poisson && c->variant == variant && c->solver == solver) return c;
  }
  return NULL;
}

/* How well the runs that ended keep the volume while pulled, best first. */
static void say_drift(const flesh_drift_plan *plan, int scene, int poisson, flesh_drift_solver solver,
                      FILE *stream)
{
  int order[32], count = 0;
  for (int v = 0; v < plan->variant_count && count < 32; v++) {
    const flesh_drift_case *c = find(plan, scene, poisson, v, solver);
    if (!c || c->figures.status) continue;
    int place = count++;
    for (; place > 0 && find(plan, scene, poisson, order[place - 1], solver)->figures.max_volume_drift >
                            c->figures.max_volume_drift;
         place--)
      order[place] = order[place - 1];
    order[place] = v;
  }
  SAY("  poisson %g: largest change of volume", plan->poissons[poisson]);
  for (int k = 0; k < count; k++) {
    char title[16];
    flesh_drift_variant_title(plan->variants[order[k]], title);
    SAY("%s %s %.2f %%", k ? "," : "", title,
        100 * find(plan, scene, poisson, order[k], solver)->figures.max_volume_drift);
  }
  SAY(count ? ".\n" : ": none of the runs ended.\n");
}

/* What became of a case after the release. */
static void say_end(const flesh_drift_plan *plan, const flesh_drift_case *c, FILE *stream)
{
  const struct flesh_drift_figures *f = &c->figures;
  char title[16];
  flesh_drift_variant_title(plan->variants[c->variant], title);
  SAY("    %-8s %-8s ", title, flesh_drift_solver_name(c->solver));
  if (!f->tets) {
    SAY("%s.\n", flesh_drift_status_word(c));
    return;
  }
  if (f->status) {
    SAY("ends at t = %.4g s, step %d: %s", f->failed_at, f->steps + 1, flesh_drift_status_word(c));
    if (f->first_inverted_step >= 0) SAY("; J <= 0 first at step %d", f->first_inverted_step);
    SAY(".\n");
    return;
  }
  if (f->distance_from_rest < 0.01 && fabs(f->final_volume_drift) < 1e-3)
    SAY("comes back to its rest shape (off by %.2g %% of its length, volume by %.1g %%)",
        100 * f->distance_from_rest, 100 * fabs(f->final_volume_drift));
  else
    SAY("ends at %.4g of its volume, %.3g %% of its length off the rest shape", 1 + f->final_volume_drift,
        100 * f->distance_from_rest);
  if (fabs(f->rest_volume_ratio - 1) > 1e-3) {
    SAY("; its own rest volume is %.4g", fabs(f->rest_volume_ratio) < 1e-6 ? 0 : f->rest_volume_ratio);
    if (isnan(f->rest_volume_ratio_theory)) SAY(" (a free body has none: it collapses)");
    else SAY(" (free body: %.4g)", f->rest_volume_ratio_theory);
  }
  if (f->first_inverted_step >= 0)
    SAY("; J <= 0 from step %d, in %d tets at most", f->first_inverted_step, f->max_inverted);
  SAY(".\n");
}

/* What another resolution changes: what part of a figure is the mesh. */
static void say_mesh(const flesh_drift_plan *plan, FILE *stream)
{
  if (plan->scene_count < 2) return;
  SAY("\nWhat part is the mesh (largest change of volume, in %%, %s solver):\n",
      flesh_drift_solver_name(plan->solvers[0]));
  for (int p = 0; p < plan->poisson_count; p++)
    for (int v = 0; v < plan->variant_count; v++) {
      char title[16];
      flesh_drift_variant_title(plan->variants[v], title);
      SAY("  poisson %-5g %-8s", plan->poissons[p], title);
      for (int s = 0; s < plan->scene_count; s++) {
        const flesh_drift_case *c = find(plan, s, p, v, plan->solvers[0]);
        if (c && !c->figures.status)
          SAY("  %s (%d tets) %.3f", plan->names[s], c->figures.tets, 100 * c->figures.max_volume_drift);
        else
          SAY("  %s -", plan->names[s]);
      }
      SAY("\n");
    }
}

int flesh_drift_write_verdict(const flesh_drift_plan *plan)
{
  flesh_file file;
  int status = flesh_table_open(plan->out, "verdict.txt", &file);
  if (status) return status;
  FILE *stream = file.stream;
  for (int s = 0; s < plan->scene_count; s++) {
    SAY("\n%s\n", plan->names[s]);
    for (int p = 0; p < plan->poisson_count; p++) {
      say_drift(plan, s, p, plan->solvers[0], stream);
      for (int v = 0; v < plan->variant_count; v++)
        for (int g = 0; g < plan->solver_count; g++) {
          const flesh_drift_case *c = find(plan, s, p, v, plan->solvers[g]);
          if (c) say_end(plan, c, stream);
        }
    }
  }
  say_mesh(plan, stream);
  return flesh_file_commit(&file);
}
