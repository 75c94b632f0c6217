/* quantity.c: compares columns with those of companions. */
#include "error/quantity.h"

#include <fnmatch.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/confine.h"
#include "base/error.h"
#include "base/file.h"
#include "base/text.h"
#include "sensitivity/sensitivity.h"

const char *const flesh_error_kind_names[FLESH_ERROR_KINDS] = {"mesh", "step"};

/* Twice the step must change a quantity by this many times what half the step does, as an order of convergence would:
 * 2 for the first. Changes of less than this share of its range are let pass, as solves leave them. */
static const double least_ratio = 1.6, small_share = 1e-4;
/* Rows that a bar looks ahead: what is off later than the companion shows it was off a little before. */
enum { AHEAD = 3 };
/* Differences may be small by chance: a component's bar is at least a share of the widest among its vector's, and one from
 * a coarser mesh a share of what another element changes there, which stresses follow less. Errors of forces from a coarser
 * mesh are so many times larger beside the differences. By data/results/error_bars.md. */
static const struct part {
  const char *name;
  double factor, of_vector, of_element;
} parts[] = {{".stress_", 1.2, 0.5, 0}, {".reaction_", 1.5, 0.3, 0.3}, {NULL, 1, 0.3, 0.3}};

static const struct part *find_part(const flesh_error_judge *judge, const flesh_error_quantity *q)
{
  const struct part *part = parts;
  while (part->name && !(judge->coarser && strstr(q->name, part->name))) part++;
  return part;
}

static int no_memory(void) { return flesh_fail(FLESH_ERR_MEMORY, "out of memory for error bars"); }

int flesh_error_table_read(const char *folder, const char *name, flesh_error_table *table)
{
  char *path = flesh_text_new("%s/%s", folder, name);
  *table = (flesh_error_table){0};
  if (!path) return no_memory();
  int status = flesh_path_is_there(path) ? flesh_csv_read(path, FLESH_CSV_WHOLE, &table->csv) : FLESH_OK;
  table->t = malloc(((size_t)table->csv.rows + 1) * sizeof *table->t);
  if (!status && !table->t) status = no_memory();
  for (int row = 0; row < table->csv.rows && !status; row++)
    if (!flesh_csv_number(&table->csv, row, 0, &table->t[row])) table->t[row] = NAN;
  free(path);
  return status;
}

void flesh_error_table_clear(flesh_error_table *table)
{
  flesh_csv_clear(&table->csv);
  free(table->t);
  *table = (flesh_error_table){0};
}

/* Columns of the history that are quantities of the whole body; the others count work, or are extremes. */
static int is_listed(const flesh_csv *csv, int column, int of_probes)
{
  static const char *const figures[] = {"energy_*", "volume", "volume_ratio", "contact*_force", "weld*_broken",
                                        "weld*_released", "J_min", "J_bound", "contact*_gap", "weld*_traction"};
  const char *name = csv->names[column];
  if (!column || strstr(name, "_error_mesh") || strstr(name, "_error_step")) return 0;
  int found = of_probes;
  for (size_t k = 0; k < sizeof figures / sizeof *figures && !found; k++) found = !fnmatch(figures[k], name, 0);
  return found;
}

/* An extreme over the body. */
static int is_extreme(const char *name)
{
  return !strcmp(name, "J_min") || !strcmp(name, "J_bound") || !fnmatch("contact*_gap", name, 0) ||
         !fnmatch("weld*_traction", name, 0);
}

/* Refuses bars that would not be honest. */
static int refuse(flesh_error_quantity *q, const flesh_scene *scene, int of_probes)
{
  const char *part = strrchr(q->name, '.');
  const int is_strain = part && (!strncmp(part, ".stress", 7) || !strncmp(part, ".stretch", 8) || !strncmp(part, ".energy", 7) ||
                                 !strncmp(part, ".J", 2));
  const flesh_probe *probe = is_strain ? flesh_probe_of(scene, q->name) : NULL;
  int held = 0;
  if (!of_probes && is_extreme(q->name))
    for (int k = 0; k < FLESH_ERROR_KINDS; k++)
      strcpy(q->why[k], "an extreme over the body, which need not settle as mesh and steps get finer");
  if (probe && flesh_probe_is_at_pin(scene, probe, 0, &held)) return FLESH_ERR_MEMORY;
  if (held) strcpy(q->why[FLESH_ERROR_MESH], "a strain beside a pin, which grows without end as the mesh gets finer");
  return FLESH_OK;
}

/* Whether both are components of one quantity of a probe, or both energies. */
static int is_same_kind(const flesh_error_quantity *a, const flesh_error_quantity *b)
{
  const char *dot = strrchr(a->name, '.');
  const size_t begin = dot ? (size_t)(dot - a->name) : 0, length = begin + strcspn(a->name + begin, "_");
  return !strcmp(a->unit, b->unit) && strlen(b->name) >= length && !strncmp(a->name, b->name, length) &&
         (!b->name[length] || b->name[length] == '_');
}

static int add_quantity(flesh_error_quantities *all, int column, const flesh_scene *scene, int of_probes)
{
  const flesh_csv *csv = &all->table.csv;
  flesh_error_quantity *q = &all->list[all->count];
  *q = (flesh_error_quantity){.column = column, .better = NAN, .kind = all->count,
                              .values = malloc(((size_t)csv->rows + 1) * sizeof(double))};
  all->count++;
  if (!q->values) return no_memory();
  flesh_csv_label(csv, column, q->name, q->unit);
  double least = INFINITY, most = -INFINITY;
  for (int row = 0; row < csv->rows; row++) {
    if (!flesh_csv_number(csv, row, column, &q->values[row])) q->values[row] = NAN;
    least = fmin(least, q->values[row]);
    most = fmax(most, q->values[row]);
  }
  for (int k = all->count - 2; k >= 0; k--)
    if (is_same_kind(&all->list[k], q)) q->kind = all->list[k].kind;
  flesh_error_quantity *first = &all->list[q->kind];
  first->range = fmax(first->range, most - least);
  return refuse(q, scene, of_probes);
}

int flesh_error_quantities_read(const char *folder, const char *name, const flesh_scene *scene,
                                flesh_error_quantities *all)
{
  const int of_probes = !strcmp(name, "probes.csv");
  *all = (flesh_error_quantities){0};
  int status = flesh_error_table_read(folder, name, &all->table);
  all->list = calloc((size_t)all->table.csv.columns + 1, sizeof *all->list);
  if (!status && !all->list) status = no_memory();
  for (int c = 0; c < all->table.csv.columns && !status; c++)
    if (is_listed(&all->table.csv, c, of_probes)) status = add_quantity(all, c, scene, of_probes);
  return status;
}

void flesh_error_quantities_clear(flesh_error_quantities *all)
{
  for (int k = 0; k < all->count; k++) {
    free(all->list[k].values);
    for (int kind = 0; kind < FLESH_ERROR_KINDS; kind++) free(all->list[k].bars[kind]);
  }
  free(all->list);
  flesh_error_table_clear(&all->table);
  *all = (flesh_error_quantities){0};
}

/* The largest difference of a column of two tables at the times of both, up to AHEAD rows later. *last is the second's
 * last value. NaN where a table lacks a number. */
static void compare(const flesh_error_table *a, int column_a, const flesh_error_table *b, int column_b, double *largest,
                    double *last)
{
  const char *name = a->csv.names[column_a];
  const int of_place = strstr(name, ".position_") != NULL, rows = a->csv.rows;
  const int of_force = strstr(name, ".reaction_") || strstr(name, ".contact_"); /* the start need not be in balance */
  double most = 0, begin = 0;
  int at = 0;
  *last = NAN;
  for (int row = 0; row < rows; row++) {
    double x = NAN, y = NAN;
    const double near = 1e-9 * fabs(a->t[row]);
    while (at < b->csv.rows && b->t[at] < a->t[row] - near) at++;
    largest[row] = most;
    if (at >= b->csv.rows || !(fabs(b->t[at] - a->t[row]) <= near)) continue;
    flesh_csv_number(&a->csv, row, column_a, &x);
    flesh_csv_number(&b->csv, at++, column_b, &y); /* an equilibrium may be at the time of the start */
    /* The mean place of nodes at rest depends on the mesh; how they have moved counts. */
    if (!row && of_place) begin = y - x;
    *last = y - begin;
    const double difference = of_force && !row ? 0 : fabs(*last - x);
    most = difference <= most ? most : difference; /* NaN stays */
    largest[row] = most;
  }
  for (int row = 0; row < rows; row++) largest[row] = largest[row + AHEAD < rows ? row + AHEAD : rows - 1];
}

/* How much twice the step changes quantities of a kind, over what half the step does; the latter, too. */
static double find_ratio(const flesh_error_quantities *all, int kind, const flesh_error_table *twice, double *room,
                         double *change)
{
  const int last = all->table.csv.rows - 1;
  double by_twice = 0, end;
  *change = 0;
  for (int k = 0; k < all->count; k++) {
    const flesh_error_quantity *q = &all->list[k];
    const int column = flesh_csv_find(&twice->csv, all->table.csv.names[q->column]);
    if (q->kind != kind || !q->bars[FLESH_ERROR_STEP] || column < 0) continue;
    compare(&all->table, q->column, twice, column, room, &end);
    by_twice = fmax(by_twice, room[last]);
    *change = fmax(*change, q->bars[FLESH_ERROR_STEP][last]);
  }
  return *change <= small_share * all->list[kind].range ? INFINITY : by_twice / *change;
}

/* Takes the bars of a kind of quantities away where the steps do not show an order. */
static void check_order(flesh_error_quantities *all, int kind, const flesh_error_table *tables, double *room)
{
  double change;
  const double ratio = find_ratio(all, kind, &tables[1], room, &change);
  if (ratio >= least_ratio) return;
  for (int k = 0; k < all->count; k++) {
    flesh_error_quantity *q = &all->list[k];
    if (q->kind != kind || !q->bars[FLESH_ERROR_STEP]) continue;
    free(q->bars[FLESH_ERROR_STEP]);
    q->bars[FLESH_ERROR_STEP] = NULL;
    snprintf(q->why[FLESH_ERROR_STEP], FLESH_ERROR_WORDS,
             "not asymptotic: half the step changes %s by %.2g%s%s, and twice the step by %.2g times that only",
             kind + 1 < all->count && all->list[kind + 1].kind == kind ? "these" : "it", change, *q->unit ? " " : "", q->unit,
             ratio);
  }
}

/* Widens a bar to a share of the largest difference between two companions up to its rows. */
static int widen(const flesh_error_table *own, const char *name, const flesh_error_table *a, const flesh_error_table *b,
                 double share, double *bar)
{
  const int first = flesh_csv_find(&a->csv, name), second = flesh_csv_find(&b->csv, name);
  const int rows = first >= 0 && second >= 0 ? a->csv.rows : 0;
  double *room = malloc(((size_t)rows + 1) * sizeof *room), last;
  if (!room) return no_memory();
  if (rows) compare(a, first, b, second, room, &last);
  for (int row = 0, at = 0; row < own->csv.rows && rows; row++) {
    while (at + 1 < rows && a->t[at + 1] <= own->t[row] * (1 + 1e-9)) at++;
    if (bar[row] < share * room[at]) bar[row] = share * room[at];
  }
  free(room);
  return FLESH_OK;
}

/* Widens a bar from a coarser mesh by what that mesh changes with twice the step, as waves that steps do not follow come
 * out alike on two meshes by chance, and by what another element changes there. */
static int widen_by_others(const flesh_error_quantities *all, const flesh_error_quantity *q, const flesh_error_judge *judge,
                           flesh_error_table (*tables)[FLESH_ERROR_COMPANIONS])
{
  const char *name = all->table.csv.names[q->column];
  const flesh_error_table *own = tables[FLESH_ERROR_MESH], *other = own + 1 + judge->doubled;
  int status = widen(&all->table, name, own, other, find_part(judge, q)->of_element, q->bars[FLESH_ERROR_MESH]);
  if (!status && judge->doubled)
    status = widen(&all->table, name, &tables[FLESH_ERROR_STEP][1], own + 1, 1, q->bars[FLESH_ERROR_MESH]);
  return status;
}

/* Multiplies the differences by the factor, and widens those of components. */
static void scale(flesh_error_quantities *all, flesh_error_kind kind, const flesh_error_judge *judge)
{
  for (int row = 0; row < all->table.csv.rows; row++)
    for (int k = 0; k < all->count; k++) {
      const struct part *part = find_part(judge, &all->list[k]);
      double most = 0;
      if (all->list[k].kind != k) continue;
      for (int j = k; j < all->count; j++)
        if (all->list[j].kind == k && all->list[j].bars[kind] && strchr(all->list[j].name, '.'))
          most = fmax(most, all->list[j].bars[kind][row]);
      for (int j = k; j < all->count; j++) {
        double *bar = all->list[j].kind == k ? all->list[j].bars[kind] : NULL;
        if (bar && bar[row] < part->of_vector * most) bar[row] = part->of_vector * most;
        if (bar) bar[row] *= judge->factor * part->factor;
      }
    }
}

int flesh_error_quantities_judge(flesh_error_quantities *all, flesh_error_kind kind, const flesh_error_judge *judge,
                                 flesh_error_table (*of_all)[FLESH_ERROR_COMPANIONS])
{
  const flesh_error_table *tables = of_all[kind];
  const size_t rows = (size_t)all->table.csv.rows;
  for (int k = 0; k < all->count; k++) {
    flesh_error_quantity *q = &all->list[k];
    double last;
    const int column = flesh_csv_find(&tables[0].csv, all->table.csv.names[q->column]);
    if (*q->why[kind] || column < 0 || !rows) continue;
    q->bars[kind] = malloc((rows + 1) * sizeof(double));
    if (!q->bars[kind]) return no_memory();
    compare(&all->table, q->column, &tables[0], column, q->bars[kind], &last);
    if (judge->better) q->better = last;
    if (!judge->coarser) continue;
    const int status = widen_by_others(all, q, judge, of_all);
    if (status) return status;
  }
  const int ordered = judge->count > 1 && !judge->coarser;
  double *room = ordered ? malloc((rows + 1) * sizeof *room) : NULL;
  if (ordered && !room) return no_memory();
  for (int k = 0; k < all->count && ordered; k++)
    if (all->list[k].kind == k) check_order(all, k, tables, room);
  free(room);
  scale(all, kind, judge);
  return FLESH_OK;
}

/* "tip.position_z [m]" becomes "tip.position_z_error_mesh [m]". */
static void print_name(FILE *stream, const char *name, const char *kind)
{
  const char *unit = strrchr(name, '[');
  const int length = unit && unit > name && unit[-1] == ' ' ? (int)(unit - 1 - name) : (int)strlen(name);
  fprintf(stream, ",%.*s_error_%s%s", length, name, kind, name + length);
}

int flesh_error_quantities_write(const flesh_error_quantities *all, const char *folder, const char *name)
{
  const flesh_csv *csv = &all->table.csv;
  char *path = flesh_text_new("%s/%s", folder, name);
  flesh_file file;
  if (!path) return no_memory();
  int status = flesh_file_open(path, &file);
  for (int row = -1; row < csv->rows && !status; row++) {
    for (int c = 0; c < csv->columns; c++) {
      if (strstr(csv->names[c], "_error_mesh") || strstr(csv->names[c], "_error_step")) continue;
      if (c) putc(',', file.stream);
      flesh_csv_print(file.stream, row < 0 ? csv->names[c] : flesh_csv_cell(csv, row, c));
    }
    for (int k = 0; k < all->count; k++)
      for (int kind = 0; kind < FLESH_ERROR_KINDS; kind++) {
        const double *bar = all->list[k].bars[kind];
        if (bar && row < 0) print_name(file.stream, csv->names[all->list[k].column], flesh_error_kind_names[kind]);
        else if (bar) putc(',', file.stream), flesh_number_print(file.stream, bar[row]);
      }
    putc('\n', file.stream);
  }
  if (!status) status = flesh_file_commit(&file);
  free(path);
  return status;
}
