/* plot.c: draws scripts of gnuplot. */
#include "picture/plot.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/confine.h"
#include "base/error.h"
#include "cli/interrupt.h"
#include "cli/path.h"
#include "picture/program.h"

static int gnuplot_missing; /* what the last plot failed for */

int flesh_plot_draw(const char *folder, const char *name) { return flesh_plot_draw_as(folder, name, ".png"); }

/* gnuplot draws into `drawn`, whose name is this program's own: no name from outside is an output of gnuplot's, and a
 * picture is whole or the old one. */
int flesh_plot_draw_as(const char *folder, const char *name, const char *suffix)
{
  char picture[48], set[64];
  snprintf(picture, sizeof picture, ".picture.part-%ld%.8s", (long)getpid(), suffix);
  snprintf(set, sizeof set, "picture='%s'", picture);
  const char *script = flesh_path("./%s.gp", name); /* with ./ it is neither an option nor a command */
  const char *log = flesh_path("%s/%s.log", folder, name), *drawn = flesh_path("%s/%s", folder, picture);
  const char *target = flesh_path("%s/%s%s", folder, name, suffix);
  flesh_path_unlink(drawn); /* gnuplot would write through a link of that name */
  /* With its own settings only, not those of ~/.gnuplot. */
  const int code = flesh_program_run(folder, log, (const char *[]){"gnuplot", "-d", "-e", set, script, NULL});
  const int whole = !code && flesh_picture_is_whole(drawn), renamed = whole && !flesh_path_rename(drawn, target), reason = errno;
  gnuplot_missing = code == FLESH_PROGRAM_MISSING;
  if (!renamed) flesh_path_unlink(drawn);
  if (whole || gnuplot_missing || flesh_interrupt_signal()) flesh_path_unlink(log);
  if (renamed) return FLESH_OK;
  if (flesh_interrupt_signal())
    return flesh_fail(FLESH_ERR_INTERRUPTED, "%s is not drawn: interrupted by %s", target, flesh_interrupt_name());
  if (whole) return flesh_fail(FLESH_ERR_FILE, "%s: cannot be written: %s", target, strerror(reason));
  if (gnuplot_missing)
    return flesh_fail(FLESH_ERR_FILE,
                      "%s is not drawn: gnuplot is not installed (Debian package gnuplot-nox); "
                      "`gnuplot ./%s.gp` in %s draws it later",
                      target, name, folder);
  if (!code)
    return flesh_fail(FLESH_ERR_FILE, "%s is not drawn: gnuplot drew nothing, or not all of it; the disk may be full", target);
  return flesh_fail(FLESH_ERR_FILE, "%s is not drawn: gnuplot failed; its messages are in %s", target, log);
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
