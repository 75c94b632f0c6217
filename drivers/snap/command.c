/* command.c: `flesh snap`: draws pictures of runs, side by side. */
#include "commands.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/error.h"
#include "base/text.h"
#include "cli/lists.h"
#include "cli/output.h"
#include "picture/snapshot.h"
#include "scene/arena.h"
#include "study/embedded.h"

enum { MOST_TIMES = 32 };

/* The frames of a run that are drawn. */
typedef struct wanted {
  int count, by_time;
  double at[MOST_TIMES]; /* times, or numbers of frames; -1: the last frame */
} wanted;

static int choose(const char *times, const char *frames, wanted *w)
{
  *w = (wanted){.count = 1, .at = {-1}};
  if (times && frames)
    return flesh_fail(FLESH_ERR_ARGUMENT, "--time and --frame are both given; give one");
  if (!times && !frames) return FLESH_OK;
  w->by_time = times != NULL;
  w->count = flesh_list_parse(times ? times : frames, MOST_TIMES, w->at);
  int good = w->count > 0;
  for (int k = 0; k < w->count && frames; k++) good &= w->at[k] >= 0 && w->at[k] < 1e9 && w->at[k] == floor(w->at[k]);
  if (good) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT, "--%s is '%s'; it must be up to %d %s, such as %s",
                    times ? "time" : "frame", times ? times : frames, MOST_TIMES,
                    times ? "times in seconds" : "numbers of frames, as in the names of the run's files",
                    times ? "0,1/2" : "0,30");
}

/* Prints which numbers there are: "0, 5, 10 to 60". */
static void print_numbers(const flesh_run_folder *run, char text[64])
{
  snprintf(text, 64, run->count == 1 ? "only " : "");
  for (int k = 0; k < run->count && k < 3; k++)
    flesh_text_add(text, 64, "%s%d", !k ? "" : k == run->count - 1 ? " and " : ", ", run->frames[k].number);
  if (run->count > 3) flesh_text_add(text, 64, " to %d", run->frames[run->count - 1].number);
}

static int frame_of(const flesh_run_folder *run, const wanted *w, int k, const char *title, int *frame)
{
  char numbers[64];
  *frame = w->by_time ? flesh_run_folder_at(run, w->at[k]) : run->count - 1;
  while (!w->by_time && w->at[k] >= 0 && *frame >= 0 && run->frames[*frame].number != w->at[k]) --*frame;
  if (*frame >= 0) return FLESH_OK;
  print_numbers(run, numbers);
  if (!run->frames[0].file)
    return flesh_fail(FLESH_ERR_ARGUMENT, "--frame is %g; %s has no frames but its %s, which is number 0", w->at[k],
                      title, run->folder ? "last state" : "start");
  return flesh_fail(FLESH_ERR_ARGUMENT, "--frame is %g; the frames of %s are %s, numbered as its files (%s/%s)",
                    w->at[k], title, numbers, run->folder, run->frames[run->count - 1].file);
}

/* Draws every run at every time; panels have copies of their states. */
static int draw(flesh_snapshot *s, const wanted *w, const char *out)
{
  int count = s->count * w->count, status = FLESH_OK;
  flesh_arena memory = {0};
  flesh_picture_panel *panels = flesh_arena_take(&memory, (size_t)count * sizeof *panels);
  int *numbers = flesh_arena_take(&memory, (size_t)count * sizeof *numbers);
  flesh_picture_frame shown;
  if (!panels || !numbers) status = flesh_no_memory();
  for (int p = 0; p < count && !status; p++) {
    int r = p / w->count, frame = 0;
    size_t n = 3 * (size_t)flesh_mesh_node_count(flesh_scene_mesh(s->runs[r].folder.scene));
    status = frame_of(&s->runs[r].folder, w, p % w->count, s->runs[r].title, &frame);
    if (!status) status = flesh_snapshot_panel(s, r, frame, &memory, &panels[p]);
    if (status) break;
    numbers[p] = s->runs[r].folder.frames[frame].number;
    double *x = flesh_arena_take(&memory, 2 * n * sizeof *x);
    if (x) {
      memcpy(x, panels[p].x, n * sizeof *x);
      memcpy(x + n, panels[p].v, n * sizeof *x);
      panels[p].x = x;
      panels[p].v = x + n;
    } else status = flesh_no_memory();
  }
  if (!s->options.columns && w->count > 1) s->options.columns = w->count;
  if (!status) status = flesh_picture(out, count, panels, &s->options, &shown);
  for (int p = 0; p < count && !status; p++)
    printf("%s: frame %d, t = %.6g s\n", s->runs[p / w->count].title, numbers[p], panels[p].t);
  if (!status) {
    flesh_snapshot_report(s, &shown);
    printf("picture: %s\n", out);
  }
  flesh_arena_free(&memory);
  return status;
}

int flesh_command_snap(int argc, char **argv)
{
  flesh_snapshot snapshot;
  wanted wanted;
  const char *out = NULL, *times = NULL, *frames = NULL;
  flesh_snapshot_default(&snapshot);
  const flesh_option options[] = {
      {"out", "FILE", FLESH_OPTION_TEXT, &out, "picture to write, its name ends in .png"},
      {"time", "T[,T]...", FLESH_OPTION_TEXT, &times, "the frames nearest to these times, s; their own times are printed"},
      {"frame", "K[,K]...", FLESH_OPTION_TEXT, &frames,
       "frames by their numbers, as in the names of the run's files: the steps"},
      FLESH_SNAPSHOT_OPTIONS(snapshot),
      {.name = NULL}};
  const flesh_usage usage = {"snap", "RUN... --out FILE",
                             "Draws runs side by side, seen by one camera and coloured on one scale.",
                             flesh_own_text("snap_help"), 1, INT_MAX, options, NULL, 0};
  int runs, code = flesh_options_read(&usage, argc, argv, &runs);
  if (code != FLESH_OPTIONS_GO_ON) return code;
  if (!out || strlen(out) < 5 || strcmp(out + strlen(out) - 4, ".png"))
    return flesh_option_refuse(usage.command, "out", out, "a file whose name ends in .png");
  int status = choose(times, frames, &wanted);
  if (!status) status = flesh_output_prepare_from(out, runs, argv + 1, snapshot.surface);
  if (!status) status = flesh_snapshot_open(&snapshot, runs, argv + 1);
  if (!status) status = draw(&snapshot, &wanted, out);
  flesh_snapshot_close(&snapshot);
  return status ? flesh_command_fail(usage.command, status) : 0;
}
