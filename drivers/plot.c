/* plot.c: gnuplot scripts, and lines over an abscissa. */
#include "plot.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/error.h"
#include "io/file.h"
#include "plot_text.h"

/* 127 is what a shell says as well when a program is not found. */
enum { NOT_FOUND = 127 };

int flesh_plot_draw(const char *folder, const char *name)
{
  char script[256];
  snprintf(script, sizeof script, "%s.gp", name);
  pid_t child = fork();
  if (child < 0)
    return flesh_fail(FLESH_ERR_FILE, "gnuplot cannot be started: %s", strerror(errno));
  if (!child) {
    int nowhere = open("/dev/null", O_RDWR), log = -1;
    char log_name[280];
    snprintf(log_name, sizeof log_name, "%s/%s.log", folder, name);
    log = open(log_name, O_WRONLY | O_CREAT | O_TRUNC, 0666);
    if (nowhere >= 0) dup2(nowhere, STDIN_FILENO), dup2(nowhere, STDOUT_FILENO);
    dup2(log >= 0 ? log : nowhere, STDERR_FILENO);
    if (chdir(folder)) _exit(1);
    execlp("gnuplot", "gnuplot", script, (char *)NULL);
    _exit(NOT_FOUND);
  }
  int ended;
  while (waitpid(child, &ended, 0) < 0 && errno == EINTR) continue;
  char log_name[1280];
  snprintf(log_name, sizeof log_name, "%s/%s.log", folder, name);
  if (WIFEXITED(ended) && WEXITSTATUS(ended) == 0) {
    unlink(log_name);
    return FLESH_OK;
  }
  if (WIFEXITED(ended) && WEXITSTATUS(ended) == NOT_FOUND) {
    unlink(log_name);
    return flesh_fail(
        FLESH_ERR_FILE,
        "%s/%s.png is not drawn: gnuplot is not installed (Debian package gnuplot-nox); "
        "`gnuplot %s` in that folder draws it later",
        folder, name, script);
  }
  return flesh_fail(FLESH_ERR_FILE, "%s/%s.png is not drawn: gnuplot failed; its words are in %s",
                    folder, name, log_name);
}

void flesh_plot_quote(FILE *stream, const char *text)
{
  putc('\'', stream);
  for (; *text; text++) {
    if (*text == '\'') putc('\'', stream); /* doubled */
    putc(*text == '\n' ? ' ' : *text, stream);
  }
  putc('\'', stream);
}

int flesh_plot_open(const char *folder, const char *name, const char *suffix, flesh_file *file)
{
  if (strchr(name, '\n'))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "the picture '%s' has a line break in its name; it must have none", name);
  char *path = malloc(strlen(folder) + strlen(name) + strlen(suffix) + 2);
  if (!path) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  sprintf(path, "%s/%s%s", folder, name, suffix);
  int status = flesh_file_open(path, file);
  free(path);
  return status;
}

void flesh_plot_begin(FILE *stream, const char *name, int width, int height)
{
  fprintf(stream,
          "# Draws %s.png: gnuplot %s.gp\n"
          "set terminal pngcairo size %d,%d enhanced font 'DejaVu Sans,11' background '#ffffff'\n"
          "set encoding utf8\nset output ",
          name, name, width, height);
  flesh_plot_quote(stream, name);
  fputs(".'.png'\n", stream);
}

int flesh_plot_lines_draw(const char *folder, const char *name, const flesh_plot_lines *lines)
{
  static const char *const colours[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                        "#56b4e9", "#e69f00", "#000000", "#999999"};
  flesh_file file;
  int status = flesh_plot_open(folder, name, ".gp", &file);
  if (status) return status;
  FILE *stream = file.stream;
  flesh_plot_begin(stream, name, 960, 600);
  fputs("set datafile separator ','\nset border 3 lc rgb '#606060'\nset tics nomirror out "
        "textcolor rgb '#303030'\n"
        "set grid lc rgb '#e4e4e4' lw 1\nset key outside right top Left reverse noenhanced spacing "
        "1.2\n"
        "set title noenhanced font ',13'\nset title ",
        stream);
  flesh_plot_quote(stream, lines->title);
  fputs("\nset xlabel noenhanced\nset ylabel noenhanced\nset xlabel ", stream);
  flesh_plot_quote(stream, lines->x_label);
  fputs("\nset ylabel ", stream);
  flesh_plot_quote(stream, lines->y_label);
  fprintf(stream, "\n%splot ", lines->extra ? lines->extra : "");
  for (int s = 0; s < lines->count; s++) {
    const flesh_plot_series *series = &lines->series[s];
    if (s) fputs(", \\\n     ", stream);
    flesh_plot_quote(stream, series->file);
    fprintf(stream, " using \"%s\":\"%s\" with lines lw 2%s lc rgb '%s' title ", series->x,
            series->y, series->dashed ? " dt 2" : "",
            series->colour ? series->colour : colours[s % 8]);
    flesh_plot_quote(stream, series->title);
  }
  putc('\n', stream);
  status = flesh_file_commit(&file);
  return status ? status : flesh_plot_draw(folder, name);
}
