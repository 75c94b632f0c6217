/* command.c: `flesh film`: draws the frames of runs side by side as pictures, and makes a video of them by ffmpeg. */
#include "commands.h"

#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/confine.h"
#include "base/error.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "cli/path.h"
#include "picture/plot.h"
#include "picture/snapshot.h"
#include "study/embedded.h"

enum { PATH_SIZE = 4096 };

typedef struct film {
  flesh_snapshot snapshot;
  const char *out;
  int every, keep; /* keep: the pictures are kept */
  double fps;      /* NaN: real time */
  char folder[PATH_SIZE];
  flesh_folder_claim claim; /* on the folder */
  const flesh_run_folder *clock; /* the run whose times the film has */
  flesh_picture_frame frame;
  flesh_arena memory; /* memory of the panels and their subtitles */
  flesh_picture_panel *panels;
} film;

static int picture_count(const film *f) { return (f->clock->count + f->every - 1) / f->every; }

/* Loads the panels of picture k: every run at that picture's time. */
static int load(film *f, int k)
{
  double t = f->clock->frames[k * f->every].time;
  int status = FLESH_OK;
  for (int r = 0; r < f->snapshot.count && !status; r++)
    status = flesh_snapshot_panel(&f->snapshot, r, flesh_run_folder_at(&f->snapshot.runs[r].folder, t), &f->memory,
                                  &f->panels[r]);
  return status;
}

static int fit(film *f)
{
  flesh_picture_fit fit;
  int status = FLESH_OK;
  flesh_picture_fit_begin(&f->snapshot.options, &fit);
  for (int k = 0; k < picture_count(f) && !status; k++) {
    status = load(f, k);
    for (int r = 0; r < f->snapshot.count && !status; r++)
      status = flesh_picture_fit_add(&fit, &f->panels[r]);
  }
  if (!status) flesh_picture_fit_end(&fit, &f->frame);
  return status;
}

static const char *picture_path(const film *f, int k) { return flesh_path("%s/frame_%06d.png", f->folder, k); }

/* Removes the pictures that were made; with `first` > 0, those of an earlier film from that number on. */
static void remove_pictures(film *f, int first)
{
  for (int k = first; !flesh_path_unlink(picture_path(f, k));) k++;
  if (first) return;
  flesh_folder_claim_release(&f->claim);
  flesh_path_remove_folder(f->folder); /* fails if there is anything else in it */
}

static int draw(film *f)
{
  int status = flesh_output_claim(f->folder, "film", &f->claim);
  for (int k = 0; k < picture_count(f) && !status; k++) {
    if (flesh_interrupt_signal())
      return flesh_fail(FLESH_ERR_INTERRUPTED, "interrupted by %s after %d of %d pictures; they are in %s",
                        flesh_interrupt_name(), k, picture_count(f), f->folder);
    status = load(f, k);
    if (!status)
      status = flesh_picture_draw(picture_path(f, k), f->snapshot.count, f->panels, &f->snapshot.options, &f->frame);
  }
  if (!status) remove_pictures(f, picture_count(f));
  return status;
}

/* Returns the number of pictures per second that makes the film run in real time, but 1 to 60. */
static double rate(const film *f)
{
  int count = f->clock->count, last = (count - 1) / f->every * f->every;
  double length = last > 0 ? f->clock->frames[last].time - f->clock->frames[0].time : 0;
  if (!isnan(f->fps)) return f->fps;
  return length > 0 ? fmin(fmax(last / f->every / length, 1), 60) : 25;
}

/* Runs ffmpeg, which interprets names as addresses, patterns and options: so none of its names come from outside.
 * Returns its exit code, or -1. */
static int run_ffmpeg(const film *f, const char *video, const char *log)
{
  char fps[32];
  snprintf(fps, sizeof fps, "%.6g", rate(f));
  const char *const words[] = {"ffmpeg", "-y", "-loglevel", "error", "-framerate", fps, "-f", "image2",
                               "-i", "./frame_%06d.png", "-pix_fmt", strstr(video, ".gif") ? "rgb8" : "yuv420p",
                               video, NULL};
  return flesh_program_run(f->folder, log, words);
}

/* Makes the video; it gets its name when it is complete. */
static int encode(film *f)
{
  char video[64];
  snprintf(video, sizeof video, "./film.part-%ld%s", (long)getpid(), strrchr(f->out, '.'));
  const char *target = flesh_path("%s/%s", f->folder, video), *log = flesh_path("%s/ffmpeg.log", f->folder);
  flesh_path_unlink(target); /* ffmpeg would write through a link of that name */
  int code = run_ffmpeg(f, video, log), renamed = !code && !flesh_path_rename(target, f->out), reason = errno;
  if (renamed) {
    flesh_path_unlink(log);
    if (!f->keep) remove_pictures(f, 0);
    return FLESH_OK;
  }
  flesh_path_unlink(target);
  if (!code || code == FLESH_PROGRAM_MISSING) flesh_path_unlink(log);
  if (!code)
    return flesh_fail(FLESH_ERR_FILE, "%s: cannot be written: %s; the %d pictures are in %s", f->out, strerror(reason),
                      picture_count(f), f->folder);
  if (code == FLESH_PROGRAM_MISSING)
    return flesh_fail(FLESH_ERR_FILE,
                      "%s is not made: ffmpeg is not installed (Debian package ffmpeg); the %d pictures are in %s",
                      f->out, picture_count(f), f->folder);
  return flesh_fail(FLESH_ERR_FILE,
                    "%s is not made: ffmpeg failed, its messages are in %s; the %d pictures are there",
                    f->out, log, picture_count(f));
}

static int make(film *f, int runs, char **paths)
{
  int status = flesh_snapshot_open(&f->snapshot, runs, paths);
  if (status) return status;
  f->panels = flesh_arena_take(&f->memory, (size_t)runs * sizeof *f->panels);
  if (!f->panels) return flesh_no_memory();
  f->clock = &f->snapshot.runs[0].folder;
  for (int r = 1; r < runs; r++)
    if (f->snapshot.runs[r].folder.count > f->clock->count) f->clock = &f->snapshot.runs[r].folder;
  if (f->clock->count < 2)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "%s: there is only one frame; a film needs a run with frames (`flesh snap` draws a single one)",
                      paths[0]);
  status = fit(f);
  if (!status) status = draw(f);
  return status;
}

/* Returns whether `out` is a video, and sets the folder of the pictures: `out` itself if it is none. -1: `out` is a
 * picture or another kind of video. */
static int choose_folder(film *f)
{
  enum { VIDEOS = 4 }; /* the suffixes of videos that are made come first */
  static const char *const suffixes[] = {".mp4", ".mkv", ".webm", ".gif", ".avi", ".mov", ".m4v",
                                         ".mpg", ".mpeg", ".ogv", ".wmv", ".png", ".jpg", ".jpeg"};
  size_t length = strlen(f->out);
  const char *dot = strrchr(f->out, '.');
  for (size_t k = 0; k < sizeof suffixes / sizeof *suffixes && dot; k++) {
    if (strcmp(dot, suffixes[k])) continue;
    if (k >= VIDEOS) return -1;
    snprintf(f->folder, sizeof f->folder, "%.*s_frames", (int)(dot - f->out), f->out);
    return 1;
  }
  while (length > 1 && f->out[length - 1] == '/') length--;
  snprintf(f->folder, sizeof f->folder, "%.*s", (int)length, f->out);
  f->keep = 1;
  return 0;
}

int flesh_command_film(int argc, char **argv)
{
  film f = {.every = 1, .fps = NAN};
  flesh_snapshot_default(&f.snapshot);
  const flesh_option options[] = {
      {"out", "FILE", FLESH_OPTION_TEXT, &f.out,
       "video to write, .mp4, .mkv, .webm or .gif; or a folder for the pictures alone"},
      {"every", "N", FLESH_OPTION_COUNT, &f.every, "every N-th frame of the run (default 1)"},
      {"fps", "N", FLESH_OPTION_POSITIVE, &f.fps, "pictures per second (default: as in real time, but 1 to 60)"},
      {"keep", NULL, FLESH_OPTION_SWITCH, &f.keep, "keep the pictures, in FILE_frames, beside the video"},
      FLESH_SNAPSHOT_OPTIONS(f.snapshot),
      {.name = NULL}};
  const flesh_usage usage = {"film", "RUN... --out FILE",
                             "Films runs side by side, seen by one camera and coloured on one scale.",
                             flesh_own_text("film_help"), 1, INT_MAX, options, NULL, FLESH_EXITS_OF_INTERRUPTS};
  int runs, code = flesh_options_read(&usage, argc, argv, &runs);
  if (code != FLESH_OPTIONS_GO_ON) return code;
  const int usable = f.out && *f.out && strlen(f.out) <= PATH_SIZE - 64, video = usable ? choose_folder(&f) : -1;
  if (video < 0)
    return flesh_option_refuse(usage.command, "out", f.out && *f.out ? f.out : NULL,
                               "a video named .mp4, .mkv, .webm or .gif, or a folder, and not longer than a path");
  flesh_interrupt_watch();
  int status = video ? flesh_output_prepare_from(f.out, runs, argv + 1, f.snapshot.surface) : FLESH_OK;
  if (!status) status = make(&f, runs, argv + 1);
  int pictures = status ? 0 : picture_count(&f);
  double fps = status ? 0 : rate(&f);
  if (!status && video) status = encode(&f);
  if (!status) printf("%s: %d picture%s", f.out, pictures, pictures == 1 ? "" : "s");
  if (!status) printf(video ? " at %.4g per second\n" : "\n", fps);
  if (!status) flesh_snapshot_report(&f.snapshot, &f.frame);
  flesh_folder_claim_release(&f.claim);
  flesh_snapshot_close(&f.snapshot);
  flesh_arena_free(&f.memory);
  return status ? flesh_command_fail(usage.command, status) : 0;
}
