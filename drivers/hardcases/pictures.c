/* pictures.c: what is drawn of the battery beside the matrix (data/studies/matrix.sql). */
#include <string.h>

#include "hardcases/hardcases.h"
#include "picture/plot.h"

int flesh_hardcases_draw(const void *data, sqlite3 *database)
{
  (void)database;
  const flesh_hardcases_plan *plan = data;
  flesh_plot_outcome outcome = {0};
  for (int c = 0; c < plan->case_count; c++) {
    int first = 1;
    for (int b = 0; b < c; b++) first &= strcmp(plan->cases[b]->group, plan->cases[c]->group) != 0;
    if (first) flesh_plot_note(&outcome, flesh_hardcases_draw_frames(plan, plan->cases[c]->group));
  }
  for (int s = 0; s < plan->setting_count; s++) flesh_plot_note(&outcome, flesh_hardcases_draw_sheet(plan, s));
  return flesh_plot_ended(&outcome);
}
