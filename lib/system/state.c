/* state.c: states as text: a row of position and velocity per node. */
#include <errno.h>
#include <math.h>
#include <string.h>
#include <sys/stat.h>

#include "base/confine.h"
#include "base/error.h"
#include "flesh/state.h"
#include "base/file.h"
#include "base/scan.h"
#include "system/state.h"

/* Reads the time of a first line `# t <seconds>`; 0 without one. */
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

/* Numbers that a state has in addition to those of its nodes, written as comments after the rows, so that readers that know
 * only rows can read these files, too. */
typedef struct column {
  const char *word;  /* `# word count` comes before them */
  const char *one, *form; /* name of a number, and format of its line */
  const char *owners, *kind; /* for messages: what has the numbers, how many, of what kind */
  int count;
  double *values; /* NULL: not wanted */
} column;

enum { COLUMNS = 2 };

static void columns_of(const flesh_state *state, column columns[COLUMNS])
{
  columns[0] = (column){"multipliers", "multiplier", "# pascals", "a state has one for each of the mesh's", " tets",
                        state->multiplier_count, state->multipliers};
  columns[1] = (column){"internal", "internal variable", "# number", "the effects of the state have", "",
                        state->internal_count, state->internal};
}

/* Whether the line is `# word <count>`; `line` is at its start. */
static int begins(flesh_scanner *line, const char *word)
{
  if (line->at >= line->end || *line->at != '#') return 0;
  line->at++;
  return flesh_scan_next_in_line(line) && flesh_scan_word(line, word);
}

static int read_count(flesh_scanner *line, const column *c)
{
  int64_t given;
  int status = flesh_scan_integer(line, &given);
  if (!status) status = flesh_scan_row_end(line);
  if (status || given == c->count) return status;
  return flesh_scan_fail(line, "%lld %ss; %s %d%s", (long long)given, c->one, c->owners, c->count, c->kind);
}

static int read_column(flesh_scanner s, const column *c)
{
  flesh_scanner line = s;
  int status = FLESH_OK, found = 0;
  char form[32];
  snprintf(form, sizeof form, "# %s count", c->word);
  s.item = c->word;
  s.form = form;
  s.index = -1;
  for (; s.at < s.end && !found; flesh_scan_skip_line(&s)) {
    line = s;
    found = begins(&line, c->word);
  }
  for (int k = 0; k < c->count; k++) c->values[k] = 0;
  if (found) status = read_count(&line, c);
  s.item = c->one;
  s.form = c->form;
  for (int k = 0; k < c->count && found && !status; k++, flesh_scan_skip_line(&s)) {
    line = s;
    line.index = k;
    if (line.at >= line.end || *line.at++ != '#' || !flesh_scan_next_in_line(&line))
      return flesh_scan_fail(&line, "the file has only %d of its %d %ss", k, c->count, c->one);
    status = flesh_scan_real(&line, &c->values[k]);
    if (!status) status = flesh_scan_row_end(&line);
  }
  return status;
}

/* The rows to keep: all (NULL), or those of these nodes, ascending. */
typedef struct wanted {
  int count;
  const int *numbers;
} wanted;

static int read_rows(flesh_scanner *s, int nodes, const wanted *some, flesh_state *state)
{
  s->item = "node";
  s->form = "x y z vx vy vz";
  int rows = 0, kept = 0;
  for (; flesh_scan_next(s); rows++) {
    double other[6];
    const int keep = !some->numbers || (kept < some->count && some->numbers[kept] == rows);
    const size_t to = 3 * (size_t)kept;
    kept += keep;
    if (rows == nodes)
      return flesh_scan_fail(
          s, "more than %d rows; a state has one for each of the mesh's %d nodes", nodes, nodes);
    s->index = rows;
    for (int i = 0; i < 6; i++) {
      double *value = !keep ? &other[i] : i < 3 ? &state->x[to + (size_t)i] : &state->v[to + (size_t)i - 3];
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

static int read_state(const char *path, int nodes, const wanted *some, flesh_state *state)
{
  struct stat info;
  if (flesh_path_stat(path, &info))
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
  if (!status) status = read_rows(&scanner, nodes, some, state);
  whole.line = 1;
  column columns[COLUMNS];
  columns_of(state, columns);
  for (int k = 0; k < COLUMNS && !status; k++)
    if (columns[k].values) status = read_column(whole, &columns[k]);
  flesh_scan_close(&scanner);
  return status;
}

int flesh_state_check(const char *function, const flesh_state *s)
{
  const char *missing = !s                                      ? "state"
                        : !s->x                                 ? "state->x"
                        : !s->v                                 ? "state->v"
                        : !s->multipliers && s->multiplier_count ? "state->multipliers"
                        : !s->internal && s->internal_count      ? "state->internal"
                                                                 : NULL;
  if (missing) return flesh_fail(FLESH_ERR_ARGUMENT, "%s: %s is NULL", function, missing);
  return s->x != s->v ? FLESH_OK
                      : flesh_fail(FLESH_ERR_ARGUMENT, "%s: state->x and state->v are the same array", function);
}

int flesh_state_read(const char *path, int nodes, flesh_state *state)
{
  FLESH_NEED({path, "path"});
  FLESH_NEED_STATE(state);
  return read_state(path, nodes, &(wanted){0}, state);
}

int flesh_state_read_some(const char *path, int nodes, int count, const int *numbers, flesh_state *state)
{
  return read_state(path, nodes, &(wanted){count, numbers}, state);
}

void flesh_state_write_head(flesh_file *file, double t)
{
  fprintf(file->stream, "# t ");
  flesh_number_print(file->stream, t);
  fprintf(file->stream, "\n# x y z vx vy vz\n");
}

void flesh_state_write_rows(flesh_file *file, int nodes, const double *x, const double *v)
{
  for (int n = 0; n < nodes; n++)
    for (int i = 0; i < 6; i++) {
      flesh_number_print(file->stream, i < 3 ? x[3 * (size_t)n + (size_t)i] : v[3 * (size_t)n + (size_t)i - 3]);
      putc(i < 5 ? ' ' : '\n', file->stream);
    }
}

int flesh_state_write(const char *path, int nodes, const flesh_state *state)
{
  FLESH_NEED({path, "path"});
  FLESH_NEED_STATE(state);
  if (nodes < 0) return flesh_fail(FLESH_ERR_ARGUMENT, "nodes is %d; it must not be negative", nodes);
  if (!isfinite(state->t))
    return flesh_fail(FLESH_ERR_NONFINITE, "%s: not written: the state's time is not finite", path);
  for (int i = 0; i < 3 * nodes; i++)
    if (!isfinite(state->x[i]) || !isfinite(state->v[i]))
      return flesh_fail(FLESH_ERR_NONFINITE, "%s: not written: node %d of the state is not finite",
                        path, i / 3);
  column columns[COLUMNS];
  columns_of(state, columns);
  for (const column *c = columns; c < columns + COLUMNS; c++)
    for (int k = 0; k < c->count; k++)
      if (!isfinite(c->values[k]))
        return flesh_fail(FLESH_ERR_NONFINITE, "%s: not written: %s %d of the state is not finite", path, c->one, k);
  flesh_file file;
  int status = flesh_file_open(path, &file);
  if (status) return status;
  flesh_state_write_head(&file, state->t);
  flesh_state_write_rows(&file, nodes, state->x, state->v);
  for (const column *c = columns; c < columns + COLUMNS; c++) {
    if (c->count) fprintf(file.stream, "# %s %d\n", c->word, c->count);
    for (int k = 0; k < c->count; k++) {
      fprintf(file.stream, "# ");
      flesh_number_print(file.stream, c->values[k]);
      putc('\n', file.stream);
    }
  }
  return flesh_file_commit(&file);
}
