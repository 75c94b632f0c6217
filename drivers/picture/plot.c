/* plot.c: draws scripts of gnuplot. */
#include "picture/plot.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/confine.h"
#include "base/error.h"
#include "base/text.h"
#include "picture/program.h"

static int gnuplot_missing; /* what the last plot failed for */

/* The paths of one drawing. gnuplot draws into `drawn`, whose name is this program's own: no name from outside is an
 * output of gnuplot's, and a picture is whole or the old one. */
typedef struct drawing {
  char *script; /* as gnuplot reads it, in the folder */
  char *log, *drawn, *target;
  char picture[48]; /* `drawn` in the folder */
} drawing;

static int make_drawing(const char *folder, const char *name, const char *suffix, drawing *d)
{
  snprintf(d->picture, sizeof d->picture, ".picture.part-%ld%.8s", (long)getpid(), suffix);
  d->script = flesh_text_new("./%s.gp", name); /* with ./ it is neither an option nor a command */
  d->log = flesh_text_new("%s/%s.log", folder, name);
  d->drawn = flesh_text_new("%s/%s", folder, d->picture);
  d->target = flesh_text_new("%s/%s%s", folder, name, suffix);
  return d->script && d->log && d->drawn && d->target ? FLESH_OK : flesh_no_memory();
}

static int draw(const char *folder, const char *name, const drawing *d)
{
  flesh_path_unlink(d->drawn); /* gnuplot would write through a link of that name */
  char picture[64];
  snprintf(picture, sizeof picture, "picture='%s'", d->picture);
  /* With its own settings only, not those of ~/.gnuplot. */
  const int code = flesh_program_run(folder, d->log, (const char *[]){"gnuplot", "-d", "-e", picture, d->script, NULL});
  if (!code && flesh_picture_is_whole(d->drawn)) {
    flesh_path_unlink(d->log);
    if (!flesh_path_rename(d->drawn, d->target)) return FLESH_OK;
    return flesh_fail(FLESH_ERR_FILE, "%s: cannot be written: %s", d->target, strerror(errno));
  }
  flesh_path_unlink(d->drawn);
  if (code == FLESH_PROGRAM_MISSING) {
    flesh_path_unlink(d->log);
    gnuplot_missing = 1;
    return flesh_fail(FLESH_ERR_FILE,
                      "%s is not drawn: gnuplot is not installed (Debian package gnuplot-nox); "
                      "`gnuplot ./%s.gp` in %s draws it later",
                      d->target, name, folder);
  }
  if (!code)
    return flesh_fail(FLESH_ERR_FILE, "%s is not drawn: gnuplot drew nothing, or not all of it; the disk may be full",
                      d->target);
  return flesh_fail(FLESH_ERR_FILE, "%s is not drawn: gnuplot failed; its messages are in %s", d->target, d->log);
}

int flesh_plot_draw(const char *folder, const char *name) { return flesh_plot_draw_as(folder, name, ".png"); }

int flesh_plot_draw_as(const char *folder, const char *name, const char *suffix)
{
  drawing d = {0};
  gnuplot_missing = 0;
  int status = make_drawing(folder, name, suffix, &d);
  if (!status) status = draw(folder, name, &d);
  if (status && d.drawn) flesh_path_unlink(d.drawn);
  free(d.script);
  free(d.log);
  free(d.drawn);
  free(d.target);
  return status;
}

void flesh_plot_note(flesh_plot_outcome *outcome, int status)
{
  if (!status || outcome->status) return;
  outcome->status = status;
  snprintf(outcome->words, sizeof outcome->words, "%s", flesh_error_text());
}

void flesh_plot_draw_noted(void *outcome, const char *folder, const char *name)
{
  ((flesh_plot_outcome *)outcome)->count++;
  flesh_plot_note(outcome, flesh_plot_draw(folder, name));
}

int flesh_plot_ended(const flesh_plot_outcome *outcome)
{
  return outcome->status ? flesh_fail(outcome->status, "%s", outcome->words) : FLESH_OK;
}

int flesh_plot_accept(const char *command, int drawn)
{
  if (!drawn || !gnuplot_missing) return drawn;
  fprintf(stderr, "flesh %s: %s\n", command, flesh_error_text());
  return FLESH_OK;
}
