/* command_snap.c: `flesh snap`: pictures of runs, side by side. */
#include "command_snap.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "snapshot.h"

enum { MOST_TIMES = 32 };

/* Which frames of a run are drawn. */
typedef struct wanted {
  int count, by_time;
  double at[MOST_TIMES]; /* times, or numbers; -1: the last one */
} wanted;

static int choose(const char *times, const char *frames, wanted *w)
{
  *w = (wanted){.count = 1, .at = {-1}};
  if (times && frames)
    return flesh_fail(FLESH_ERR_ARGUMENT, "--time and --frame are both given; one of them chooses");
  if (!times && !frames) return FLESH_OK;
  w->by_time = times != NULL;
  w->count = flesh_parse_numbers(times ? times : frames, MOST_TIMES, w->at);
  int good = w->count > 0;
  for (int k = 0; k < w->count && frames; k++) good &= w->at[k] == (int)w->at[k] && w->at[k] >= 0;
  if (good) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT, "--%s is '%s'; it must be up to %d %s, such as %s",
                    times ? "time" : "frame", times ? times : frames, MOST_TIMES,
                    times ? "times in seconds" : "whole numbers from 0", times ? "0,1/2" : "0,30");
}

static int frame_of(const flesh_run_folder *run, const wanted *w, int k, int *frame)
{
  if (w->by_time) *frame = flesh_run_folder_at(run, w->at[k]);
  else *frame = w->at[k] < 0 ? run->count - 1 : (int)w->at[k];
  if (*frame < run->count) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT, "--frame is %d; the run has the frames 0 to %d", *frame,
                    run->count - 1);
}

/* Every run at every time; panels keep copies of their states. */
static int draw(flesh_snapshot *s, const wanted *w, const char *out)
{
  int count = s->count * w->count, status = FLESH_OK;
  flesh_picture_panel *panels = calloc((size_t)count, sizeof *panels);
  char(*subtitles)[32] = calloc((size_t)count, sizeof *subtitles);
  double **states = calloc((size_t)count, sizeof *states);
  if (!panels || !subtitles || !states) status = flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  for (int p = 0; p < count && !status; p++) {
    int r = p / w->count, frame = 0;
    size_t n = 3 * (size_t)flesh_mesh_node_count(flesh_scene_mesh(s->runs[r].folder.scene));
    status = frame_of(&s->runs[r].folder, w, p % w->count, &frame);
    if (!status) status = flesh_snapshot_panel(s, r, frame, subtitles[p], sizeof *subtitles, &panels[p]);
    if (status) break;
    states[p] = malloc(2 * n * sizeof(double));
    if (!states[p]) {
      status = flesh_fail(FLESH_ERR_MEMORY, "out of memory");
      break;
    }
    memcpy(states[p], panels[p].x, n * sizeof(double));
    memcpy(states[p] + n, panels[p].v, n * sizeof(double));
    panels[p].x = states[p];
    panels[p].v = states[p] + n;
  }
  if (!s->options.columns && w->count > 1) s->options.columns = w->count;
  if (!status) status = flesh_picture(out, count, panels, &s->options);
  for (int p = 0; states && p < count; p++) free(states[p]);
  free(states);
  free(subtitles);
  free(panels);
  return status;
}

int flesh_command_snap(int argc, char **argv)
{
  flesh_snapshot snapshot;
  wanted wanted;
  const char *out = NULL, *times = NULL, *frames = NULL;
  flesh_snapshot_default(&snapshot);
  const flesh_option options[] = {
      {"out", "FILE", FLESH_OPTION_TEXT, &out, "picture to write, a PNG"},
      {"time", "T[,T]...", FLESH_OPTION_TEXT, &times, "the frames nearest to these times, s"},
      {"frame", "K[,K]...", FLESH_OPTION_TEXT, &frames, "frames by their number, from 0"},
      FLESH_SNAPSHOT_OPTIONS(snapshot),
      {.name = NULL}};
  const flesh_usage usage = {
      .command = "snap",
      .positionals = "RUN... --out FILE",
      .summary = "Draws runs side by side, seen by one camera and coloured on one scale.",
      .details = "RUN is the folder that `flesh run` has filled, or a scene, whose start is then\n"
                 "drawn. Without --time or --frame it is the last frame; several make a strip.\n"
                 "Tets that are inverted are black in the colours of J, stress and speed.\n",
      .positional_min = 1,
      .positional_max = INT_MAX,
      .options = options};
  int runs, code = flesh_options_read(&usage, argc, argv, &runs);
  if (code != FLESH_OPTIONS_GO_ON) return code;
  if (!out || strlen(out) < 5 || strcmp(out + strlen(out) - 4, ".png")) {
    fprintf(stderr, "flesh snap: --out is %s; it must be a file named .png\n", out ? out : "missing");
    return 2;
  }
  int status = choose(times, frames, &wanted);
  if (!status) status = flesh_snapshot_open(&snapshot, runs, argv + 1);
  if (!status) status = draw(&snapshot, &wanted, out);
  flesh_snapshot_close(&snapshot);
  return status ? flesh_command_fail(usage.command, status) : 0;
}
