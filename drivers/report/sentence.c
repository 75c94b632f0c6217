/* sentence.c: what came of a comparison, in a sentence from its table. */
#include "report/sentence.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/text.h"
#include "report/csv.h"

/* Matched constants go without saying. */
void flesh_report_name_energy(const json_t *rows, size_t k, char name[64])
{
  const char *constants = flesh_report_text(rows, "constants", k);
  const int matched = !strcmp(constants, "matched");
  snprintf(name, 64, "%.20s%s%.20s%s", flesh_report_text(rows, "energy", k), matched ? "" : " with ",
           matched ? "" : !strcmp(constants, "as_e") ? "the" : constants,
           matched ? "" : !strcmp(constants, "as_e") ? " constants of E" : " constants");
}

/* How many rows have another text than `word` in the column. */
static size_t count_others(const json_t *rows, const char *column, const char *word)
{
  size_t others = 0;
  for (size_t k = 0; k < flesh_report_rows(rows); k++) others += strcmp(flesh_report_text(rows, column, k), word) != 0;
  return others;
}

void flesh_report_say_drift(json_t *part, const json_t *rows, double poisson,
                            int (*is_of)(const json_t *, size_t, double))
{
  const size_t count = flesh_report_rows(rows), others = count_others(rows, "status", "complete");
  double least = INFINITY, most = -INFINITY;
  char best[64] = "", worst[64] = "", words[400];
  for (size_t k = 0; k < count; k++) {
    const double drift = fabs(flesh_report_number(rows, "max_volume_drift", k));
    if (!is_of(rows, k, poisson) || isnan(drift)) continue;
    if (drift < least) least = drift, flesh_report_name_energy(rows, k, best);
    if (drift > most) most = drift, flesh_report_name_energy(rows, k, worst);
  }
  snprintf(words, sizeof words, "%.100s at Poisson's ratio %g: ", flesh_report_text(rows, "scene", count - 1), poisson);
  if (!*best) flesh_text_add(words, sizeof words, "no run has a volume to be compared.");
  else if (!strcmp(best, worst))
    flesh_text_add(words, sizeof words, "%s changes its volume by at most %.2g %%.", best, 100 * most);
  else
    flesh_text_add(words, sizeof words, "%s keeps its volume best, within %.2g %%, and %s worst, within %.2g %%.", best,
                   100 * least, worst, 100 * most);
  if (others) flesh_text_add(words, sizeof words, " %zu of %zu runs did not complete.", others, count);
  flesh_report_say(part, "%s", words);
}

void flesh_report_say_accuracy(json_t *part, const json_t *rows)
{
  static const double errors[] = {0.01, 0.1};
  for (size_t e = 0; e < sizeof errors / sizeof *errors; e++) {
    size_t best = 0, found = 0;
    for (size_t k = 0; k < flesh_report_rows(rows); k++) {
      if (strcmp(flesh_report_text(rows, "price", k), "work") ||
          !(flesh_report_number(rows, "error_over_motion", k) <= errors[e]))
        continue;
      if (!found++ || flesh_report_number(rows, "cpu_s", k) < flesh_report_number(rows, "cpu_s", best)) best = k;
    }
    if (!found) continue;
    flesh_report_say(part, "With an error of at most %g %% of the motion, %s (%s) takes the least CPU time, %.2g s.",
                     100 * errors[e], flesh_report_text(rows, "method", best), flesh_report_text(rows, "setting", best),
                     flesh_report_number(rows, "cpu_s", best));
    return;
  }
  flesh_report_say(part, "No run has an error of at most 10 %% of the motion.");
}

void flesh_report_name_case(const json_t *rows, size_t k, char name[300])
{
  char energy[64];
  const double seed = flesh_report_number(rows, "seed", k);
  const char *solver = flesh_report_text(rows, "solver", k), *element = flesh_report_text(rows, "element", k);
  flesh_report_name_energy(rows, k, energy);
  snprintf(name, 300, "%.80s: %s, Poisson's ratio %g", flesh_report_text(rows, "case", k), energy,
           flesh_report_number(rows, "poisson", k));
  if (strcmp(solver, "default")) flesh_text_add(name, 300, ", solver %.40s", solver);
  if (strcmp(element, "tet4")) flesh_text_add(name, 300, ", %.20s", element);
  if (seed > 1) flesh_text_add(name, 300, ", seed %.0f", seed);
}

void flesh_report_say_hardcases(json_t *part, const json_t *rows)
{
  const size_t count = flesh_report_rows(rows);
  char name[300], first[400] = "", more[40] = "";
  size_t others = 0;
  for (size_t k = 0; k < count; k++) {
    const char *outcome = flesh_report_text(rows, "outcome", k);
    if (!strcmp(outcome, "recovered") || !strcmp(outcome, "untangled") || !strcmp(outcome, "equilibrium")) continue;
    if (others++) continue;
    flesh_report_name_case(rows, k, name);
    snprintf(first, sizeof first, "; not so %s (%.60s)", name, outcome);
  }
  if (others > 1) snprintf(more, sizeof more, " and %zu more", others - 1);
  flesh_report_say(part, "%zu of %zu cases are back at rest, or in the equilibrium that was to be kept%s%s.",
                   count - others, count, first, more);
}
