/* states.c: opens a run's folder and loads its states one by one. */
#include "report/states.h"

#include <stdlib.h>

#include "base/error.h"
#include "report/csv.h"

/* Loads a state of the folder; NULL: the scene's start. */
static int load_single(flesh_report_states *s, const char *name)
{
  const int nodes = flesh_mesh_node_count(flesh_scene_mesh(s->run.scene));
  if (!name) {
    flesh_scene_start(s->run.scene, &s->run.state);
    return FLESH_OK;
  }
  char *path = flesh_report_path(s->folder, name);
  if (!path) return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a report");
  const int status = flesh_state_read(path, nodes, &s->run.state);
  free(path);
  return status;
}

/* Start, what `flesh drift` keeps, and the end, by time; of one time the later named. */
static int find_few(flesh_report_states *s)
{
  static const char *const names[FLESH_REPORT_FEW] = {NULL, "worst_state.txt", "event_state.txt",
                                                      "state.txt"};
  s->few = 1;
  s->count = 0;
  for (int k = 0; k < FLESH_REPORT_FEW; k++) {
    if (names[k] && !flesh_report_has(s->folder, names[k])) continue;
    const int status = load_single(s, names[k]);
    if (status) return status;
    const double t = s->run.state.t;
    int at = 0;
    while (at < s->count && s->times[at] < t) at++;
    const int same = at < s->count && !(s->times[at] > t);
    for (int i = s->count; i > at && !same; i--)
      s->times[i] = s->times[i - 1], s->names[i] = s->names[i - 1];
    s->times[at] = t;
    s->names[at] = names[k];
    s->count += !same;
  }
  return FLESH_OK;
}

int flesh_report_states_open(const char *folder, flesh_report_states *s)
{
  *s = (flesh_report_states){.folder = folder};
  const int status = flesh_run_folder_open(folder, &s->run);
  if (status) return status;
  s->count = s->run.count;
  return s->run.files && s->run.files[0] ? FLESH_OK : find_few(s);
}

void flesh_report_states_close(flesh_report_states *s)
{
  flesh_run_folder_close(&s->run);
  *s = (flesh_report_states){0};
}

int flesh_report_states_load(flesh_report_states *s, int k, flesh_picture_panel *panel)
{
  const int status = s->few ? load_single(s, s->names[k]) : flesh_run_folder_load(&s->run, k);
  if (status) return status;
  *panel = (flesh_picture_panel){.body = flesh_scene_body(s->run.scene),
                                 .x = s->run.state.x,
                                 .v = s->run.state.v,
                                 .system = flesh_scene_system(s->run.scene),
                                 .t = s->run.state.t};
  return FLESH_OK;
}

int flesh_report_states_number(const flesh_report_states *s, int k)
{
  return s->few ? k : s->run.numbers[k];
}
