/* state.c: states as text: a row of position and velocity per node. */
#include <errno.h>
#include <math.h>
#include <string.h>
#include <sys/stat.h>

#include "base/error.h"
#include "flesh/state.h"
#include "base/file.h"
#include "base/scan.h"

/* The time of a first line `# t <seconds>`; 0 without one. */
static int read_time(flesh_scanner *s, double *t)
{
  *t = 0;
  const char *at = s->at;
  while (at < s->end && (*at == ' ' || *at == '\t' || *at == '\r' || *at == '\n'))
    s->line += *at++ == '\n';
  flesh_scanner head = *s;
  s->line = 1; /* the rows are scanned from the start */
  if (at >= s->end || *at != '#') return FLESH_OK;
  head.at = at + 1;
  if (!flesh_scan_next_in_line(&head) || !flesh_scan_word(&head, "t")) return FLESH_OK;
  int status = flesh_scan_real(&head, t);
  return status ? status : flesh_scan_row_end(&head);
}

static const char multipliers_word[] = "multipliers";

/* Whether the line is `# multipliers <count>`; `line` is at its begin. */
static int begins_multipliers(flesh_scanner *line)
{
  if (line->at >= line->end || *line->at != '#') return 0;
  line->at++;
  return flesh_scan_next_in_line(line) && flesh_scan_word(line, multipliers_word);
}

static int read_count(flesh_scanner *line, int count)
{
  int64_t given;
  int status = flesh_scan_integer(line, &given);
  if (!status) status = flesh_scan_row_end(line);
  if (status || given == count) return status;
  return flesh_scan_fail(line, "%lld multipliers; a state has one for each of the mesh's %d tets", (long long)given,
                         count);
}

/* The multipliers, which are comments, so that what knows only rows of nodes reads these. */
static int read_multipliers(flesh_scanner *s, flesh_state *state)
{
  flesh_scanner line;
  int status = FLESH_OK, found = 0;
  s->item = multipliers_word;
  s->form = "# multipliers count";
  s->index = -1;
  for (; s->at < s->end && !found; flesh_scan_skip_line(s)) {
    line = *s;
    found = begins_multipliers(&line);
  }
  for (int k = 0; k < state->multiplier_count; k++) state->multipliers[k] = 0;
  if (found) status = read_count(&line, state->multiplier_count);
  s->item = "multiplier";
  s->form = "# pascals";
  for (int k = 0; k < state->multiplier_count && found && !status; k++, flesh_scan_skip_line(s)) {
    line = *s;
    line.index = k;
    if (line.at >= line.end || *line.at++ != '#' || !flesh_scan_next_in_line(&line))
      return flesh_scan_fail(&line, "the file has only %d of its %d multipliers", k, state->multiplier_count);
    status = flesh_scan_real(&line, &state->multipliers[k]);
    if (!status) status = flesh_scan_row_end(&line);
  }
  return status;
}

static int read_rows(flesh_scanner *s, int nodes, flesh_state *state)
{
  s->item = "node";
  s->form = "x y z vx vy vz";
  int rows = 0;
  for (; flesh_scan_next(s); rows++) {
    if (rows == nodes)
      return flesh_scan_fail(
          s, "more than %d rows; a state has one for each of the mesh's %d nodes", nodes, nodes);
    s->index = rows;
    for (int i = 0; i < 6; i++) {
      double *value = i < 3 ? &state->x[3 * (size_t)rows + (size_t)i]
                            : &state->v[3 * (size_t)rows + (size_t)i - 3];
      int status = flesh_scan_real(s, value);
      if (status) return status;
    }
    int status = flesh_scan_row_end(s);
    if (status) return status;
  }
  if (rows == nodes) return FLESH_OK;
  return flesh_scan_fail(
      s, "the file ends after %d rows; a state has one for each of the mesh's %d nodes", rows,
      nodes);
}

int flesh_state_read(const char *path, int nodes, flesh_state *state)
{
  FLESH_NEED({path, "path"}, {state, "state"});
  struct stat info;
  if (stat(path, &info))
    return flesh_fail(FLESH_ERR_FILE, "%s: cannot be opened: %s", path, strerror(errno));
  if (!S_ISREG(info.st_mode))
    return flesh_fail(FLESH_ERR_FILE, "%s: not a regular file; a state is rows of x y z vx vy vz",
                      path);
  flesh_scanner scanner;
  int status = flesh_scan_open(&scanner, path);
  scanner.item = "time";
  scanner.form = "# t seconds";
  scanner.index = -1;
  if (!status) status = read_time(&scanner, &state->t);
  flesh_scanner whole = scanner;
  if (!status) status = read_rows(&scanner, nodes, state);
  whole.line = 1;
  if (!status && state->multipliers) status = read_multipliers(&whole, state);
  flesh_scan_close(&scanner);
  return status;
}

int flesh_state_write(const char *path, int nodes, const flesh_state *state)
{
  FLESH_NEED({path, "path"}, {state, "state"});
  if (!isfinite(state->t))
    return flesh_fail(FLESH_ERR_NONFINITE, "%s: not written: the state's time is not finite", path);
  for (int i = 0; i < 3 * nodes; i++)
    if (!isfinite(state->x[i]) || !isfinite(state->v[i]))
      return flesh_fail(FLESH_ERR_NONFINITE, "%s: not written: node %d of the state is not finite",
                        path, i / 3);
  for (int k = 0; k < state->multiplier_count; k++)
    if (!isfinite(state->multipliers[k]))
      return flesh_fail(FLESH_ERR_NONFINITE, "%s: not written: multiplier %d of the state is not finite", path, k);
  flesh_file file;
  int status = flesh_file_open(path, &file);
  if (status) return status;
  fprintf(file.stream, "# t ");
  flesh_number_print(file.stream, state->t);
  fprintf(file.stream, "\n# x y z vx vy vz\n");
  for (int n = 0; n < nodes; n++)
    for (int i = 0; i < 6; i++) {
      flesh_number_print(file.stream, i < 3 ? state->x[3 * n + i] : state->v[3 * n + i - 3]);
      putc(i < 5 ? ' ' : '\n', file.stream);
    }
  if (state->multiplier_count) fprintf(file.stream, "# %s %d\n", multipliers_word, state->multiplier_count);
  for (int k = 0; k < state->multiplier_count; k++) {
    fprintf(file.stream, "# ");
    flesh_number_print(file.stream, state->multipliers[k]);
    putc('\n', file.stream);
  }
  return flesh_file_commit(&file);
}
