/* keep.c: what became of a run, as a text in its folder, for a battery that goes on from there. */
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/confine.h"
#include "base/error.h"
#include "base/file.h"
#include "base/scan.h"
#include "flesh/version.h"
#include "hardcases/hardcases.h"

/* The numbers of the figures, in the file's order. */
typedef enum kind { INT, LONG, DOUBLE } kind;
#define FIGURE(type, member) {type, offsetof(flesh_hardcases_figures, member)}
static const struct {
  kind type;
  size_t place;
} members[] = {
    FIGURE(INT, status), FIGURE(INT, exit_code), FIGURE(INT, crashed_by), FIGURE(INT, tets), FIGURE(INT, steps),
    FIGURE(LONG, solves), FIGURE(LONG, retried), FIGURE(LONG, unconverged), FIGURE(LONG, at_rounding),
    FIGURE(LONG, newton), FIGURE(LONG, linear), FIGURE(LONG, direct), FIGURE(LONG, projections),
    FIGURE(LONG, backtracks), FIGURE(LONG, untanglings), FIGURE(LONG, untangled_nodes), FIGURE(LONG, rises),
    FIGURE(LONG, rises_checked), FIGURE(DOUBLE, worst_rise), FIGURE(INT, finite), FIGURE(INT, max_inverted),
    FIGURE(INT, inverted_end), FIGURE(DOUBLE, stressed_rest), FIGURE(DOUBLE, distance), FIGURE(DOUBLE, volume_error),
    FIGURE(DOUBLE, recovered_at), FIGURE(DOUBLE, newton_ratio), FIGURE(DOUBLE, time_ratio), FIGURE(DOUBLE, wall_s),
    FIGURE(DOUBLE, cpu_s), FIGURE(DOUBLE, simulated_s), FIGURE(INT, rank), FIGURE(DOUBLE, gradient),
    FIGURE(DOUBLE, smallest_eigenvalue), FIGURE(INT, negative_eigenvalues),
    FIGURE(LONG, longest.step), FIGURE(DOUBLE, longest.t), FIGURE(LONG, longest.newton), FIGURE(LONG, longest.linear),
    FIGURE(DOUBLE, longest.ratio)};
enum { MEMBERS = sizeof members / sizeof *members };

static void path_of(const flesh_hardcases_plan *plan, const flesh_hardcases_run *run, const char *name, char path[1700])
{
  char folder[256];
  flesh_hardcases_run_folder(run, folder);
  snprintf(path, 1700, "%s/%s/%s", plan->out, folder, name);
}

/* Prints everything that a run's result depends on beside its folder's name, as one line. */
static void print_key(FILE *stream, const flesh_hardcases_plan *plan, const flesh_hardcases_run *run)
{
  fprintf(stream, "flesh %s, ", flesh_version());
  flesh_number_print(stream, plan->max_seconds);
  fputs(" s, nu ", stream);
  flesh_number_print(stream, run->setting->poisson);
  if (run->setting->body && run->setting->body->file) fprintf(stream, ", %s", run->setting->body->file);
  for (int k = 0; k < plan->overrides->count; k++) fprintf(stream, ", %s", plan->overrides->values[k]);
}

static void print_member(FILE *stream, const flesh_hardcases_figures *f, int m)
{
  const char *at = (const char *)f + members[m].place;
  if (members[m].type == INT) fprintf(stream, "%d ", *(const int *)(const void *)at);
  else if (members[m].type == LONG) fprintf(stream, "%ld ", *(const long *)(const void *)at);
  else flesh_number_print(stream, *(const double *)(const void *)at), putc(' ', stream);
}

/* Reads it; returns whether there was a number. */
static int scan_member(char **text, flesh_hardcases_figures *f, int m)
{
  char *at = (char *)f + members[m].place, *end;
  if (members[m].type == INT) *(int *)(void *)at = (int)strtol(*text, &end, 10);
  else if (members[m].type == LONG) *(long *)(void *)at = strtol(*text, &end, 10);
  else *(double *)(void *)at = strtod(*text, &end);
  const int found = end != *text;
  *text = end;
  return found;
}

void flesh_hardcases_keep(const flesh_hardcases_plan *plan, const flesh_hardcases_run *run)
{
  static const char *const large[] = {"body.mesh", "start.txt", "frame_first.txt", "frame_early.txt", "out/state.txt"};
  char path[1700];
  flesh_file file;
  path_of(plan, run, "kept.txt", path);
  if (flesh_file_open(path, &file)) return;
  print_key(file.stream, plan, run);
  fprintf(file.stream, "\n%d %d ", (int)run->outcome, (int)run->figures.end);
  for (int m = 0; m < MEMBERS; m++) print_member(file.stream, &run->figures, m);
  putc('\n', file.stream);
  for (const char *c = run->figures.message; *c; c++) putc(*c == '\n' ? ' ' : *c, file.stream);
  putc('\n', file.stream);
  if (flesh_file_commit(&file) || run->outcome != FLESH_HARDCASES_RECOVERED) return;
  for (size_t k = 0; k < sizeof large / sizeof *large; k++) { /* of thousands of runs; the command makes them again */
    path_of(plan, run, large[k], path);
    flesh_path_unlink(path);
  }
}

/* Reads a line without its end; returns whether there was a whole one. */
static int read_line(FILE *stream, char *line, int size)
{
  if (!fgets(line, size, stream)) return 0;
  char *end = strchr(line, '\n');
  if (end) *end = 0;
  return end != NULL;
}

int flesh_hardcases_recall(const flesh_hardcases_plan *plan, flesh_hardcases_run *run)
{
  char path[1700], line[4096], key[4096] = "";
  flesh_hardcases_figures f = {0};
  path_of(plan, run, "kept.txt", path);
  FILE *stream, *wanted = fmemopen(key, sizeof key, "w");
  flesh_regular_open(path, &stream);
  if (wanted) print_key(wanted, plan, run), fclose(wanted);
  int good = stream && wanted && read_line(stream, line, sizeof line) && !strcmp(line, key) &&
             read_line(stream, line, sizeof line);
  if (good) {
    char *text = line;
    const long outcome = strtol(text, &text, 10), end = strtol(text, &text, 10);
    good = outcome >= 0 && outcome < FLESH_HARDCASES_NOT_RUN && end >= 0 && end < FLESH_HARDCASES_ENDS;
    for (int m = 0; m < MEMBERS && good; m++) good = scan_member(&text, &f, m);
    if (good) good = read_line(stream, f.message, sizeof f.message);
    if (good) {
      f.end = (flesh_hardcases_end)end;
      run->outcome = (flesh_hardcases_outcome)outcome;
      run->figures = f;
    }
  }
  if (stream) fclose(stream);
  return good;
}
