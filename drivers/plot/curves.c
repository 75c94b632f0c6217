/* curves.c: the curves that `flesh plot` draws: columns of the tables of runs. */
#include "plot/curves.h"

#include <fnmatch.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/confine.h"
#include "base/error.h"
#include "base/text.h"

enum { TABLES = 6, LABEL = 200 };

/* A folder of results or a file. */
typedef struct source {
  const char *path;
  char label[LABEL];
  int count;
  flesh_csv tables[TABLES];
} source;

typedef struct reading {
  const flesh_curves_wanted *wanted;
  int source_count, room;
  source *sources;
  flesh_curves *curves;
  char name[FLESH_CSV_NAME], unit[FLESH_CSV_NAME]; /* of the first curve's y */
  int several; /* columns of y */
} reading;

static int no_memory(void) { return flesh_fail(FLESH_ERR_MEMORY, "out of memory"); }

/* The units of history.csv's columns (observer.h), whose header has none. Those of effects go by what is reported:
 * weld_traction, and weld_2_traction of the second weld. */
static const char *history_unit(const char *name)
{
  static const char *const units[][2] = {
      {"t", "s"},   {"h", "s"},     {"residual", "N"}, {"residual_target", "N"}, {"volume", "m^3"},
      {"gap", "m"}, {"force", "N"}, {"released", "J"}, {"traction", "Pa"}};
  if (!strncmp(name, "energy_", 7)) return "J";
  if (!strncmp(name, "contact_", 8) || !strncmp(name, "weld_", 5)) name = strrchr(name, '_') + 1;
  for (size_t k = 0; k < sizeof units / sizeof *units; k++)
    if (!strcmp(name, units[k][0])) return units[k][1];
  return "";
}

void flesh_csv_label(const flesh_csv *csv, int column, char name[FLESH_CSV_NAME], char unit[FLESH_CSV_NAME])
{
  const char *header = csv->names[column], *bracket = strrchr(header, '['), *slash = strrchr(csv->path, '/');
  size_t length = strlen(header);
  *unit = 0;
  if (bracket && bracket > header && header[length - 1] == ']') {
    snprintf(unit, FLESH_CSV_NAME, "%.*s", (int)(header + length - 1 - bracket - 1), bracket + 1);
    length = (size_t)(bracket - header);
    while (length && header[length - 1] == ' ') length--;
  }
  snprintf(name, FLESH_CSV_NAME, "%.*s", (int)length, header);
  if (!*unit && !strcmp(slash ? slash + 1 : csv->path, "history.csv"))
    snprintf(unit, FLESH_CSV_NAME, "%s", history_unit(name));
  if (!strcmp(unit, "1")) *unit = 0;
}

/* Whether `word` means the column: its header, its header without the unit, either with "probe." before it,
 * NAME.x of NAME.position_x; * stands for any letters. */
static int matches(const flesh_csv *csv, int column, const char *word)
{
  char name[FLESH_CSV_NAME], unit[FLESH_CSV_NAME], longer[FLESH_CSV_NAME + 16];
  flesh_csv_label(csv, column, name, unit);
  if (!strcmp(word, csv->names[column])) return 1;
  if (!strncmp(word, "probe.", 6) && strcmp(word, "probe.")) word += 6;
  if (!strcmp(word, csv->names[column]) || !fnmatch(word, name, 0)) return 1;
  const char *dot = strrchr(word, '.');
  if (!dot || !dot[1] || dot[2] || !strchr("xyz", dot[1])) return 0;
  snprintf(longer, sizeof longer, "%.*s.position_%c", (int)(dot - word < FLESH_CSV_NAME ? dot - word : 0), word, dot[1]);
  return !strcmp(longer, name);
}

static int read_folder(source *s)
{
  static const char *const names[TABLES] = {"history.csv", "probes.csv",    "drift.csv",
                                            "accuracy.csv", "orders.csv", "hardcases.csv"};
  int status = flesh_confine(s->path);
  for (int k = 0; k < TABLES && !status; k++) {
    char *path = flesh_text_new("%s/%s", s->path, names[k]);
    if (!path) return no_memory();
    status = flesh_path_check(path);
    if (!status && flesh_path_is_file(path)) status = flesh_csv_read(path, FLESH_CSV_WHOLE, &s->tables[s->count++]);
    free(path);
  }
  if (!status && !s->count)
    return flesh_fail(FLESH_ERR_FILE,
                      "%s: this folder has no history.csv, nor another table of flesh's; give the folder of a run or "
                      "a CSV file",
                      s->path);
  return status;
}

/* The last part of a path, of "run/history.csv" that of "run". */
static void find_label(source *s, int is_folder)
{
  char *path = strdup(s->path), *slash;
  if (!path) return;
  for (size_t n = strlen(path); n > 1 && path[n - 1] == '/'; n--) path[n - 1] = 0;
  slash = strrchr(path, '/');
  if (!is_folder && slash > path && (!strcmp(slash, "/history.csv") || !strcmp(slash, "/probes.csv"))) {
    *slash = 0;
    slash = strrchr(path, '/');
  }
  snprintf(s->label, LABEL, "%s", slash && slash[1] ? slash + 1 : path);
  char *dot = strrchr(s->label, '.');
  if (!is_folder && dot && !strcmp(dot, ".csv")) *dot = 0;
  free(path);
}

static int read_sources(reading *r)
{
  int status = FLESH_OK, same = 0;
  for (int k = 0; k < r->wanted->path_count && !status; k++) {
    source *s = &r->sources[r->source_count++];
    struct stat info;
    s->path = r->wanted->paths[k];
    const int is_folder = !flesh_path_stat(s->path, &info) && S_ISDIR(info.st_mode);
    status = is_folder ? read_folder(s) : flesh_csv_read(s->path, FLESH_CSV_WHOLE, &s->tables[0]);
    if (!is_folder && !status) s->count = 1;
    find_label(s, is_folder);
    for (int j = 0; j < k; j++) same |= !strcmp(r->sources[j].label, s->label);
  }
  for (int k = 0; k < r->source_count && same; k++) snprintf(r->sources[k].label, LABEL, "%s", r->sources[k].path);
  return status;
}

/* The column that `word` means, the first one, in a table; -1: none. */
static int find_column(const flesh_csv *csv, const char *word)
{
  for (int c = 0; c < csv->columns; c++)
    if (matches(csv, c, word)) return c;
  return -1;
}

/* "there is no column ...; there are ..." */
static int refuse_column(const source *s, const char *word)
{
  size_t size = 1;
  for (int t = 0; t < s->count; t++)
    for (int c = 0; c < s->tables[t].columns; c++) size += strlen(s->tables[t].names[c]) + 2;
  char *list = calloc(size, 1), name[FLESH_CSV_NAME], unit[FLESH_CSV_NAME];
  if (!list) return no_memory();
  for (int t = 0; t < s->count; t++)
    for (int c = 0; c < s->tables[t].columns; c++) {
      flesh_csv_label(&s->tables[t], c, name, unit);
      if (t && !strcmp(name, "t")) continue; /* every table's */
      sprintf(list + strlen(list), "%s%s", *list ? ", " : "", name);
    }
  int status = flesh_fail(FLESH_ERR_ARGUMENT, "%s has no column %s; it has %s", s->path, word, list);
  free(list);
  return status;
}

/* The table and column of x for a y of table `t`: there, or in another table with as many rows. */
static int find_x(const reading *r, const source *s, int t, const flesh_csv **table, int *column)
{
  const char *word = r->wanted->x;
  *table = &s->tables[t];
  *column = find_column(*table, word ? word : "t");
  if (*column < 0 && !word) *column = 0;
  for (int k = 0; k < s->count && *column < 0; k++) {
    *column = find_column(&s->tables[k], word);
    if (*column < 0) continue;
    *table = &s->tables[k];
    if ((*table)->rows != s->tables[t].rows)
      return flesh_fail(FLESH_ERR_ARGUMENT,
                        "%s is in %s, which has %d rows; %s has %d, so that the two do not make a curve", word,
                        (*table)->path, (*table)->rows, s->tables[t].path, s->tables[t].rows);
  }
  return *column < 0 ? refuse_column(s, word) : FLESH_OK;
}

static void label_of(const char *name, const char *unit, char *label)
{
  sprintf(label, !*unit ? "%s" : *name ? "%s [%s]" : "%s[%s]", name, unit);
}

/* The first curve says what the axes are; another unit on the same axis is refused. */
static int check_units(reading *r, const flesh_csv *y_table, int y, const flesh_csv *x_table, int x)
{
  char name[FLESH_CSV_NAME], unit[FLESH_CSV_NAME], label[sizeof r->curves->x_label];
  flesh_csv_label(x_table, x, name, unit);
  label_of(name, unit, label);
  if (!r->curves->count) strcpy(r->curves->x_label, label);
  flesh_csv_label(y_table, y, name, unit);
  if (!r->curves->count) {
    strcpy(r->name, name);
    strcpy(r->unit, unit);
  }
  if (strcmp(r->unit, unit))
    return flesh_fail(FLESH_ERR_ARGUMENT, "%s is in %s and %s in %s; one axis has one unit: plot them apart", r->name,
                      *r->unit ? r->unit : "numbers without a unit", name, *unit ? unit : "numbers without a unit");
  r->several |= strcmp(r->name, name) != 0;
  return FLESH_OK;
}

/* Room for one curve more, with room for `count` points. */
static flesh_curve *add_curve(reading *r, int count)
{
  flesh_curves *c = r->curves;
  if (c->count == r->room) {
    const int room = r->room ? 2 * r->room : 16;
    flesh_curve *grown = realloc(c->curves, (size_t)room * sizeof *grown);
    if (!grown) return NULL;
    c->curves = grown;
    r->room = room;
  }
  flesh_curve *curve = &c->curves[c->count];
  const size_t size = ((size_t)count + 1) * sizeof(double);
  *curve = (flesh_curve){.x = malloc(size), .y = malloc(size), .title = malloc(3 * LABEL)};
  c->count++;
  return curve->x && curve->y && curve->title ? curve : NULL;
}

static int number_of(const flesh_csv *csv, int row, int column, double *value)
{
  if (flesh_csv_number(csv, row, column, value)) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT,
                    "%s: %s of row %d is '%.80s', which is no number; --by makes a curve for each word", csv->path,
                    csv->names[column], row + 1, csv->cells[(size_t)row * (size_t)csv->columns + (size_t)column]);
}

static const char *word_of(const flesh_csv *csv, int row, int column)
{
  return column < 0 ? "" : csv->cells[(size_t)row * (size_t)csv->columns + (size_t)column];
}

static void note_point(reading *r, flesh_curve *curve)
{
  flesh_curves *c = r->curves;
  const double at[2] = {curve->x[curve->count], curve->y[curve->count]};
  int drawn = 1;
  for (int d = 0; d < 2; d++) drawn &= isfinite(at[d]) && (at[d] > 0 || !r->wanted->log[d]);
  for (int d = 0; d < 2 && drawn; d++) c->low[d] = fmin(c->low[d], at[d]), c->high[d] = fmax(c->high[d], at[d]);
  curve->drawn += drawn;
  curve->count++;
}

/* The curve of a column, or those of the groups in it. */
static int add_column(reading *r, const source *s, int t, int y)
{
  const flesh_csv *csv = &s->tables[t], *x_table;
  int x, by = -1, status = find_x(r, s, t, &x_table, &x);
  if (!status && r->wanted->by && (by = find_column(csv, r->wanted->by)) < 0) status = refuse_column(s, r->wanted->by);
  if (!status) status = check_units(r, csv, y, x_table, x);
  char name[FLESH_CSV_NAME], unit[FLESH_CSV_NAME];
  flesh_csv_label(csv, y, name, unit);
  for (int first = 0; first < csv->rows && !status; first++) {
    const char *group = word_of(csv, first, by);
    int seen = by < 0 && first > 0;
    for (int k = 0; k < first && !seen; k++) seen = !strcmp(group, word_of(csv, k, by));
    if (seen) continue;
    flesh_curve *curve = add_curve(r, csv->rows);
    if (!curve) return no_memory();
    /* Which of the three is needed is known in the end. */
    snprintf(curve->title, 3 * LABEL, "%.*s\n%.*s\n%.*s", LABEL - 2, s->label, LABEL - 2, name, LABEL - 2, group);
    for (int k = first; k < csv->rows && !status; k++) {
      if (by >= 0 && strcmp(group, word_of(csv, k, by))) continue;
      status = number_of(x_table, k, x, &curve->x[curve->count]);
      if (!status) status = number_of(csv, k, y, &curve->y[curve->count]);
      if (!status) note_point(r, curve);
    }
  }
  return status;
}

static int add_word(reading *r, const source *s, const char *word)
{
  int found = 0, status = FLESH_OK;
  const int is_pattern = strpbrk(word, "*?") != NULL;
  for (int t = 0; t < s->count; t++)
    for (int c = 0; c < s->tables[t].columns && !status; c++) {
      if ((found && !is_pattern) || !matches(&s->tables[t], c, word)) continue;
      found = 1;
      status = add_column(r, s, t, c);
    }
  return found ? status : refuse_column(s, word);
}

/* Keeps of run, column and group the parts that tell the curves from each other. */
static void finish_titles(reading *r)
{
  const int needed[3] = {r->wanted->path_count > 1, r->several, r->wanted->by != NULL};
  for (int k = 0; k < r->curves->count; k++) {
    char *title = r->curves->curves[k].title, *copy = strdup(title), *part = copy;
    if (!copy) continue;
    *title = 0;
    for (int p = 0; p < 3; p++) {
      char *end = strchr(part, '\n');
      if (end) *end = 0;
      if (needed[p]) sprintf(title + strlen(title), "%s%s", *title ? ", " : "", part);
      part = end ? end + 1 : part + strlen(part);
    }
    free(copy);
  }
}

static int check_drawn(const reading *r)
{
  const int *log = r->wanted->log;
  for (int k = 0; k < r->curves->count; k++)
    if (r->curves->curves[k].drawn) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT, "there is nothing to draw: %s over %s has no row with %s numbers", r->name,
                    r->curves->x_label, log[0] || log[1] ? "finite and, on logarithmic axes, positive" : "finite");
}

/* Several columns by the words that asked for them, where these are short; `name` has FLESH_CSV_NAME bytes. */
static const char *several_name(const flesh_curves_wanted *wanted, char name[FLESH_CSV_NAME])
{
  size_t length = 0;
  for (int k = 0; k < wanted->y_count; k++) length += strlen(wanted->y[k]) + 2;
  *name = 0;
  for (int k = 0; k < wanted->y_count && length < 64; k++) sprintf(name + strlen(name), k ? ", %s" : "%s", wanted->y[k]);
  return name;
}

int flesh_curves_read(const flesh_curves_wanted *wanted, flesh_curves *curves)
{
  *curves = (flesh_curves){.low = {INFINITY, INFINITY}, .high = {-INFINITY, -INFINITY}};
  reading r = {.wanted = wanted, .curves = curves};
  r.sources = calloc((size_t)wanted->path_count + 1, sizeof *r.sources);
  int status = r.sources ? read_sources(&r) : no_memory();
  for (int k = 0; k < wanted->path_count && !status; k++)
    for (int y = 0; y < wanted->y_count && !status; y++) status = add_word(&r, &r.sources[k], wanted->y[y]);
  if (!status) status = check_drawn(&r);
  if (!status) {
    finish_titles(&r);
    label_of(r.several ? several_name(wanted, r.name) : r.name, r.unit, curves->y_label);
  }
  for (int k = 0; r.sources && k < r.source_count; k++)
    for (int t = 0; t < TABLES; t++) flesh_csv_clear(&r.sources[k].tables[t]);
  free(r.sources);
  if (status) flesh_curves_clear(curves);
  return status;
}

void flesh_curves_clear(flesh_curves *curves)
{
  for (int k = 0; k < curves->count; k++) {
    free(curves->curves[k].title);
    free(curves->curves[k].x);
    free(curves->curves[k].y);
  }
  free(curves->curves);
  *curves = (flesh_curves){0};
}
