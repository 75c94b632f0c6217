/* still.c: finds the time at which a report begins, and draws its bodies then. */
#include "report/still.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "picture/picture.h"

int flesh_report_motion_add(flesh_report_motion *m, int taken, const flesh_picture_panel *panel)
{
  const size_t size = 3 * (size_t)flesh_mesh_node_count(panel->body->mesh);
  if (!m->first) {
    m->times = malloc(((size_t)taken + 1) * sizeof *m->times);
    m->away = malloc(((size_t)taken + 1) * sizeof *m->away);
    m->first = malloc((size + 1) * sizeof *m->first);
    if (!m->times || !m->away || !m->first) return flesh_report_no_memory();
    memcpy(m->first, panel->x, size * sizeof *m->first);
  }
  double sum = 0;
  for (size_t d = 0; d < size; d++) sum += (panel->x[d] - m->first[d]) * (panel->x[d] - m->first[d]);
  m->times[m->count] = panel->t;
  m->away[m->count++] = isfinite(sum) ? sum : 0;
  return FLESH_OK;
}

void flesh_report_motion_close(flesh_report_motion *motion)
{
  free(motion->times);
  free(motion->away);
  free(motion->first);
  *motion = (flesh_report_motion){0};
}

int flesh_report_frame_at(const flesh_report_motion *motion, double t)
{
  int frame = 0;
  while (frame + 1 < motion->count && motion->times[frame + 1] <= t) frame++;
  return frame;
}

static double farthest(const flesh_report_motion *motion)
{
  double most = 0;
  for (int k = 0; k < motion->count; k++) most = fmax(most, motion->away[k]);
  return most > 0 ? most : 1;
}

double flesh_report_find_start(int runs, const flesh_report_motion *motions)
{
  double best = 0, best_away = -1;
  int best_runs = 0;
  for (int r = 0; r < runs; r++)
    for (int k = 0; k < motions[r].count; k++) {
      const double t = motions[r].times[k];
      double away = 0;
      int there = 0;
      for (int s = 0; s < runs; s++) {
        const int frame = flesh_report_frame_at(&motions[s], t);
        if (motions[s].times[frame] != t) continue;
        away += motions[s].away[frame] / farthest(&motions[s]);
        there++;
      }
      if (there < best_runs || (there == best_runs && away <= best_away)) continue;
      best = t, best_away = away, best_runs = there;
    }
  return best;
}

int flesh_report_draw_still(flesh_report *report, const flesh_picture_panel *panels,
                            const flesh_picture_options *options, const flesh_picture_frame *frame)
{
  const int count = report->shown_count;
  flesh_picture_panel *titled = calloc((size_t)count + 1, sizeof *titled);
  char(*times)[32] = calloc((size_t)count + 1, sizeof *times);
  int status = titled && times ? FLESH_OK : flesh_report_no_memory();
  for (int r = 0; r < count && !status; r++) {
    titled[r] = panels[r];
    snprintf(times[r], sizeof times[r], "t = %.4g s", panels[r].t);
    titled[r].title = report->shown[r].name;
    titled[r].subtitle = times[r];
  }
  flesh_picture_options own = *options;
  own.columns = (int)ceil(sqrt(count));
  if (!status) status = flesh_picture_print(report->still.stream, count, titled, &own, frame);
  if (!status) status = flesh_report_bytes_flush(&report->still);
  free(titled);
  free(times);
  return status;
}
