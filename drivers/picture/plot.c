/* plot.c: runs programs, and draws scripts of gnuplot; functions that write parts of scripts. */
#include "picture/plot.h"

#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/confine.h"
#include "base/error.h"
#include "cli/interrupt.h"
#include "cli/path.h"

int flesh_program_run(const char *folder, const char *log, const char *const *words)
{
  fflush(NULL);
  const pid_t child = fork();
  if (child < 0) return -1;
  if (!child) {
    prctl(PR_SET_PDEATHSIG, SIGKILL); /* ends with the parent, as nobody would use what it draws */
    const int nowhere = open("/dev/null", O_RDWR);
    const int said = flesh_path_open(log, O_WRONLY | O_CREAT | O_TRUNC | O_NONBLOCK, 0666);
    if (nowhere >= 0) dup2(nowhere, STDIN_FILENO), dup2(nowhere, STDOUT_FILENO);
    dup2(said >= 0 ? said : nowhere, STDERR_FILENO);
    if (chdir(folder)) _exit(1);
    execvp(words[0], (char *const *)words);
    _exit(FLESH_PROGRAM_MISSING);
  }
  int ended;
  while (waitpid(child, &ended, 0) < 0 && errno == EINTR) continue;
  return WIFEXITED(ended) ? WEXITSTATUS(ended) : -1;
}

/* Returns whether the file has this beginning and this end; line breaks may follow `end`. */
static int is_between(const char *path, const void *begin, size_t begin_size, const void *end, size_t end_size)
{
  char first[16], last[24];
  struct stat info;
  int file = flesh_path_open(path, O_RDONLY | O_NONBLOCK, 0);
  if (file < 0) return 0;
  int whole = !fstat(file, &info) && S_ISREG(info.st_mode) && info.st_size >= (off_t)(begin_size + end_size) &&
              pread(file, first, begin_size, 0) == (ssize_t)begin_size && !memcmp(first, begin, begin_size);
  for (int breaks = 0, found = 0; whole && !found; breaks++) {
    const off_t at = info.st_size - (off_t)end_size - breaks;
    found = at >= 0 && pread(file, last, end_size, at) == (ssize_t)end_size && !memcmp(last, end, end_size);
    whole = found || breaks < 3;
  }
  close(file);
  return whole;
}

/* Returns whether a picture named .svg, .pdf or .png begins and ends as such a file must: a PNG (ISO/IEC 15948) has a
 * signature first and the chunk IEND last, an SVG the end tag of its root element last, a PDF (ISO 32000) %PDF- and
 * %%EOF. */
static int is_whole(const char *path)
{
  static const unsigned char first[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  static const unsigned char last[12] = {0, 0, 0, 0, 'I', 'E', 'N', 'D', 0xae, 0x42, 0x60, 0x82};
  const char *suffix = strrchr(path, '.');
  if (suffix && !strcmp(suffix, ".svg")) return is_between(path, "<?xml", 5, "</svg>", 6);
  if (suffix && !strcmp(suffix, ".pdf")) return is_between(path, "%PDF-", 5, "%%EOF", 5);
  return is_between(path, first, sizeof first, last, sizeof last);
}

static int gnuplot_missing; /* the last plot failed because there is no gnuplot */

/* gnuplot draws into `drawn`, a name that this program makes: so gnuplot writes to no name from outside, and the
 * picture is complete or the old one is kept. */
int flesh_plot_draw(const char *folder, const char *name, const char *suffix)
{
  char picture[48], set[64];
  snprintf(picture, sizeof picture, ".picture.part-%ld%.8s", (long)getpid(), suffix);
  snprintf(set, sizeof set, "picture='%s'", picture);
  const char *script = flesh_path("./%s.gp", name); /* with ./ it is neither an option nor a command */
  const char *log = flesh_path("%s/%s.log", folder, name), *drawn = flesh_path("%s/%s", folder, picture);
  const char *target = flesh_path("%s/%s%s", folder, name, suffix);
  flesh_path_unlink(drawn); /* gnuplot would write through a link of that name */
  /* -d: without the settings in ~/.gnuplot. */
  const int code = flesh_program_run(folder, log, (const char *[]){"gnuplot", "-d", "-e", set, script, NULL});
  const int whole = !code && is_whole(drawn), renamed = whole && !flesh_path_rename(drawn, target), reason = errno;
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
  flesh_plot_note(outcome, flesh_plot_draw(folder, name, ".png"));
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

/* Returns whether the character stands for itself in a string in double quotes, wherever gnuplot interprets it. */
static int is_plain(char c) { return isalnum((unsigned char)c) || (c && strchr(" _.,:;=+-/()[]<>", c)); }

static void put_octal(FILE *stream, char c) { fprintf(stream, "\\%03o", (unsigned)(unsigned char)c); }

static void put_text(FILE *stream, const char *text, int times_percent)
{
  putc('"', stream);
  while (*text) {
    int size = flesh_text_letter(text);
    if (size > 1) fwrite(text, 1, (size_t)size, stream);
    else if (!size) fputs("\\077", stream); /* ? */
    else if (flesh_text_is_control(*text)) putc(' ', stream);
    else if (is_plain(*text)) putc(*text, stream);
    else
      for (int k = 0; k < (*text == '%' ? times_percent : 1); k++) put_octal(stream, *text);
    text += size ? size : 1;
  }
  putc('"', stream);
}

void flesh_plot_quote(FILE *stream, const char *text) { put_text(stream, text, 1); }
void flesh_plot_quote_tick(FILE *stream, const char *text) { put_text(stream, text, 2); }

void flesh_plot_quote_file(FILE *stream, const char *name, const char *suffix)
{
  fputs("\"./", stream);
  for (int part = 0; part < 2; part++)
    for (const char *c = part ? suffix : name; *c; c++)
      if ((unsigned char)*c < 0x80 && is_plain(*c)) putc(*c, stream);
      else put_octal(stream, *c);
  putc('"', stream);
}

static int check_name(const char *name)
{
  for (const char *c = name; *c; c++)
    if (flesh_text_is_control(*c))
      return flesh_fail(FLESH_ERR_ARGUMENT,
                        "the name of a picture has %s at its character %d; it must have no control characters",
                        *c == '\n' ? "a line break" : "a control character", (int)(c - name) + 1);
  if (!*name || strchr(name, '/') || strchr("|<", *name))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "a picture cannot be named '%s'; its name must be that of a file and not begin with | or <",
                      name);
  return FLESH_OK;
}

int flesh_plot_open(const char *folder, const char *name, const char *suffix, flesh_file *file)
{
  const int status = check_name(name);
  return status ? status : flesh_file_open(flesh_path("%s/%s%s", folder, name, suffix), file);
}

void flesh_plot_begin(FILE *stream, const char *name, const char *suffix, int width, int height)
{
  static const char font[] = "font 'DejaVu Sans,11' background '#ffffff'";
  fputs("# Draws the picture that is named here: gnuplot ./THIS_FILE\nif (!exists('picture')) picture = ", stream);
  flesh_plot_quote_file(stream, name, suffix);
  if (!strcmp(suffix, ".svg"))
    fprintf(stream, "\nset terminal svg size %d,%d dynamic enhanced rounded %s\n", width, height, font);
  else if (!strcmp(suffix, ".pdf"))
    fprintf(stream, "\nset terminal pdfcairo size %.4gin,%.4gin enhanced rounded %s\n", width / 96., height / 96., font);
  else fprintf(stream, "\nset terminal pngcairo size %d,%d enhanced rounded %s\n", width, height, font);
  fputs("set encoding utf8\nset output picture\n", stream);
}

void flesh_plot_style(FILE *stream, int of_csv)
{
  if (of_csv) fputs("set datafile separator ','\nset datafile missing NaN\n", stream);
  fputs("set border 3 lc rgb '#606060'\nset tics nomirror out textcolor rgb '#303030'\nset grid lc rgb '#e4e4e4' lw 1\n"
        "set key outside right top Left reverse noenhanced spacing 1.2\n",
        stream);
}

void flesh_plot_title(FILE *stream, const char *text)
{
  fputs("set title noenhanced font ',13'\nset title ", stream);
  flesh_plot_quote(stream, text);
  putc('\n', stream);
}

void flesh_plot_label(FILE *stream, const char *axis, const char *text)
{
  fprintf(stream, "set %slabel noenhanced\nset %slabel ", axis, axis);
  flesh_plot_quote(stream, text);
  putc('\n', stream);
}

const char *flesh_plot_colour(int k)
{
  static const char *const colours[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                        "#56b4e9", "#e69f00", "#000000", "#999999"};
  return colours[k % (int)(sizeof colours / sizeof *colours)];
}

void flesh_plot_log_ticks(FILE *stream, const char *axis, double low, double high)
{
  static const double of_decade[] = {1, 2, 5};
  double decades = log10(high / low);
  if (!(low > 0) || !(decades > 0.4) || !isfinite(decades) || decades > 3) return;
  fprintf(stream, "set %stics (", axis);
  int count = 0;
  for (int decade = (int)floor(log10(low)); decade <= (int)ceil(log10(high)); decade++)
    for (int k = 0; k < 3; k++) {
      double value = of_decade[k] * pow(10, decade);
      if (value < low * (1 - 1e-9) || value > high * (1 + 1e-9)) continue;
      fprintf(stream, "%s'%.6g' %.17g", count++ ? ", " : "", value, value);
    }
  fputs(")\n", stream);
}
