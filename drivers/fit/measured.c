/* measured.c: reads files of measurements; finds which states of an experiment give the measured numbers, and by which
 * weights. */
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "fit/fit.h"
#include "fit/observation.h"
#include "output/tet_shape.h"
#include "scene/scene.h"
#include "scene/words.h"
#include "skin/locator.h"

static const char *const tables[] = {"probes", "history", "positions"};

/* A file that is being read. */
typedef struct reading {
  flesh_arena *arena;
  const flesh_scene *scene;
  flesh_fit_measured *to;
  flesh_csv csv;
  int time;         /* column of the time; -1: none */
  flesh_locator *locator; /* finds places in the body; NULL until positions need it */
} reading;

/* A point may lie outside the body by up to this share of the mean edge; it then belongs to the nearest tet. Two meshes
 * of a curved body have different surfaces, and a scanner is not exact. */
static const double outside = 0.25;

/* Returns the column with that name, whatever its unit; -1: none. */
static int find(const flesh_csv *csv, const char *wanted) { return flesh_csv_find_label(csv, wanted, (char[FLESH_CSV_NAME]){0}); }

static const char suffix[] = "_deviation";

static int is_deviation(const char *name)
{
  const size_t length = strlen(name), end = strlen(suffix);
  return length > end && !strcmp(name + length - end, suffix);
}

/* Returns whether a column gives a place or a time, not a measured number. */
static int is_place(const reading *r, const char *name)
{
  static const char *const names[] = {"t", "node", "X", "Y", "Z"};
  int is = 0;
  for (int k = 0; k < (r->to->table == FLESH_FIT_OF_POSITIONS ? 5 : 1); k++) is |= !strcmp(name, names[k]);
  return is;
}

static int add_quantity(reading *r, int column)
{
  flesh_fit_quantity *q = &r->to->quantities[r->to->quantity_count];
  char wanted[FLESH_CSV_NAME + 16];
  flesh_csv_label(&r->csv, column, q->name, q->unit);
  if (r->to->table == FLESH_FIT_OF_POSITIONS && (strlen(q->name) != 1 || !strchr("xyz", *q->name)))
    return flesh_node_fail(r->to->node, "%s has the column %s; positions have x, y, z, node or X, Y, Z, and x_deviation",
                           r->to->path, q->name);
  for (int other = 0; other < r->to->quantity_count; other++)
    if (!strcmp(r->to->quantities[other].name, q->name))
      return flesh_node_fail(r->to->node, "%s: column %s stands twice; it must stand once", r->to->path, q->name);
  snprintf(wanted, sizeof wanted, "%s%s", q->name, suffix);
  q->column = column;
  q->deviation = find(&r->csv, wanted);
  if (isnan(r->to->deviation) && q->deviation < 0)
    return flesh_node_fail(r->to->node, "deviation is missing; it must be a number > 0, or %s must have the column %s",
                           r->to->path, wanted);
  r->to->quantity_count++;
  return FLESH_OK;
}

/* Checks the units in the file: times are in seconds, positions and places at rest in metres, deviations in the unit of
 * their quantity. */
static int check_units(const reading *r)
{
  char name[FLESH_CSV_NAME], unit[FLESH_CSV_NAME], of[FLESH_CSV_NAME], right[FLESH_CSV_NAME];
  for (int c = 0; c < r->csv.columns; c++) {
    flesh_csv_label(&r->csv, c, name, unit);
    snprintf(right, sizeof right, "%s", c == r->time ? "s" : r->to->table == FLESH_FIT_OF_POSITIONS ? "m" : "");
    if (!*right && is_deviation(name)) {
      snprintf(of, sizeof of, "%.*s", (int)(strlen(name) - strlen(suffix)), name);
      if (flesh_csv_find_label(&r->csv, of, right) < 0) *right = 0;
    }
    if (*unit && *right && strcmp(unit, right))
      return flesh_node_fail(r->to->node, "%s: column %s is in %s; it must be in %s", r->to->path, name, unit, right);
  }
  return FLESH_OK;
}

static int choose_columns(reading *r)
{
  const flesh_node *list = r->to->chosen;
  char name[FLESH_CSV_NAME], unit[FLESH_CSV_NAME], shown[FLESH_SHOW_SIZE], words[512];
  int status = FLESH_OK;
  if (list && (list->kind != FLESH_NODE_LIST || !list->count))
    return flesh_node_fail(list, "columns is %s; it must be a list of names", flesh_node_show(list, shown));
  for (int c = 0; c < r->csv.columns && !list && !status; c++) {
    flesh_csv_label(&r->csv, c, name, unit);
    if (!is_place(r, name) && !is_deviation(name)) status = add_quantity(r, c);
  }
  for (const flesh_node *child = list ? list->first : NULL; child && !status; child = child->next) {
    flesh_suggestion suggestion = {.word = child->kind == FLESH_NODE_SCALAR ? child->text : ""};
    const int column = *suggestion.word && !is_place(r, suggestion.word) ? find(&r->csv, suggestion.word) : -1;
    for (int c = 0; c < r->csv.columns && column < 0; c++) {
      flesh_csv_label(&r->csv, c, name, unit);
      if (!is_place(r, name) && !is_deviation(name)) flesh_suggestion_offer(&suggestion, name);
    }
    status = column >= 0 ? add_quantity(r, column)
                         : flesh_node_fail(child, "%s has no column %s; %s", r->to->path, flesh_node_show(child, shown),
                                           flesh_suggestion_text(&suggestion, words));
  }
  if (!status && !r->to->quantity_count)
    return flesh_node_fail(r->to->node, "%s has no measured column; it must have one beside %s", r->to->path,
                           r->to->table == FLESH_FIT_OF_POSITIONS ? "node or X, Y, Z" : "t");
  return status;
}

/* Reads a number of the table; NaN only for an empty cell. */
static int number(const reading *r, int row, int column, double *value)
{
  char shown[FLESH_SHOW_SIZE];
  const char *cell = flesh_csv_cell(&r->csv, row, column);
  if (flesh_csv_number(&r->csv, row, column, value) && (isfinite(*value) || !*cell)) return FLESH_OK;
  return flesh_node_fail(r->to->node, "%s: row %d, column %s is %s; it must be a number, or empty", r->to->path, row + 1,
                         r->csv.names[column], flesh_word_show(cell, shown));
}

/* Reads a number that must not be missing. */
static int number_needed(const reading *r, int row, int column, const char *name, double *value)
{
  const int status = number(r, row, column, value);
  if (status || !isnan(*value)) return status;
  return flesh_node_fail(r->to->node, "%s: row %d: %s is empty; it must be a number", r->to->path, row + 1, name);
}

static int read_datum(reading *r, int row, int quantity, double t)
{
  const flesh_fit_quantity *q = &r->to->quantities[quantity];
  flesh_fit_datum datum = {.quantity = quantity, .row = row, .t = t, .deviation = r->to->deviation};
  const double start = r->scene->start.t, end = r->scene->time.end;
  int status = number(r, row, q->column, &datum.value);
  if (status || isnan(datum.value)) return status;
  if (!isnan(t) && !(t >= start && t <= end))
    return flesh_node_fail(r->to->node, "%s: t is %g s; it must be a time of the run, which goes from %g to %g s", r->to->path, t,
                           start, end);
  if (isnan(datum.deviation)) status = number(r, row, q->deviation, &datum.deviation);
  if (!status && !(datum.deviation > 0))
    return flesh_node_fail(r->to->node, "%s: row %d, column %s is %s; a deviation must be > 0", r->to->path, row + 1,
                           r->csv.names[q->deviation],
                           isnan(datum.deviation) ? "empty" : flesh_csv_cell(&r->csv, row, q->deviation));
  if (!status) r->to->data[r->to->count++] = datum;
  return status;
}

/* Checks that a quantity has only one number at a time. A run has only one, and the table of a run, whose start and
 * equilibrium may have the same time, would count twice. */
static int check_once(const reading *r, int first)
{
  const flesh_fit_datum *data = r->to->data;
  for (int d = first; d < r->to->count; d++)
    for (int k = 0; k < first; k++)
      if (data[k].t == data[d].t && data[k].quantity == data[d].quantity)
        return flesh_node_fail(r->to->node,
                               "%s: rows %d and %d both have %s at t = %g s; it must have one number at a time, as the mean of "
                               "repeated measurements",
                               r->to->path, data[k].row + 1, data[d].row + 1, r->to->quantities[data[d].quantity].name, data[d].t);
  return FLESH_OK;
}

/* Locates a point at rest in the tet that contains it or is nearest. */
static int locate(reading *r, int row, const double X[3], flesh_fit_point *point)
{
  const flesh_mesh *mesh = flesh_scene_mesh(r->scene);
  const double edge = cbrt(6 * flesh_mesh_volume(mesh, flesh_mesh_positions(mesh)) / flesh_mesh_tet_count(mesh));
  flesh_place at;
  const int status = r->locator ? FLESH_OK : flesh_locator_create(mesh, &r->locator);
  if (status) return status;
  flesh_locator_find(r->locator, X, -1, &at);
  if (at.tet < 0 || !(at.distance <= outside * edge))
    return flesh_node_fail(r->to->node, "%s: row %d: the point [%g, %g, %g] is outside of the body at rest, by more than "
                                           "%g m, a quarter of an edge",
                           r->to->path, row + 1, X[0], X[1], X[2], outside * edge);
  point->count = flesh_tet_weights(mesh, at.tet, at.weights, point->nodes, point->weights);
  return FLESH_OK;
}

/* Reads the point of a row of positions. */
static int read_point(reading *r, int row, flesh_fit_point *point)
{
  static const char *const names[] = {"X", "Y", "Z"};
  const int node = find(&r->csv, "node"), nodes = flesh_mesh_node_count(flesh_scene_mesh(r->scene));
  double value, X[3];
  if (node >= 0) {
    const int status = number(r, row, node, &value);
    if (status) return status;
    if (!(value >= 0 && value < nodes && value == floor(value)))
      return flesh_node_fail(r->to->node, "%s: row %d: node is %g; it must be a whole number from 0 to %d", r->to->path,
                             row + 1, value, nodes - 1);
    *point = (flesh_fit_point){.count = 1, .nodes = {(int)value}, .weights = {1}};
    return FLESH_OK;
  }
  for (int d = 0; d < 3; d++) {
    const int column = find(&r->csv, names[d]);
    if (column < 0)
      return flesh_node_fail(r->to->node, "%s has no column node, nor X, Y and Z; positions need either", r->to->path);
    const int status = number_needed(r, row, column, names[d], &X[d]);
    if (status) return status;
  }
  return locate(r, row, X, point);
}

static int read_rows(reading *r)
{
  flesh_fit_measured *to = r->to;
  double latest = -INFINITY; /* latest time so far */
  int status = FLESH_OK;
  if (r->time < 0 && to->table != FLESH_FIT_OF_POSITIONS && r->csv.rows != 1)
    return flesh_node_fail(r->to->node, "%s has %d rows and no column t; without t it must have one row, of the run's end",
                           to->path, r->csv.rows);
  for (int row = 0; row < r->csv.rows && !status; row++) {
    double t = NAN;
    if (r->time >= 0) status = number_needed(r, row, r->time, "t", &t);
    if (!status && to->points) status = read_point(r, row, &to->points[row]);
    const int first = to->count, later = t > latest;
    for (int q = 0; q < to->quantity_count && !status; q++) status = read_datum(r, row, q, t);
    if (later) latest = t;
    else if (!status && r->time >= 0) status = check_once(r, first);
  }
  if (!status && !to->count)
    return flesh_node_fail(r->to->node, "%s has no measured number; it must have one or more", to->path);
  return status;
}

static int read_table(reading *r)
{
  flesh_fit_measured *to = r->to;
  const int has_points = to->table == FLESH_FIT_OF_POSITIONS;
  const size_t columns = (size_t)r->csv.columns, rows = (size_t)r->csv.rows + 1;
  r->time = has_points ? -1 : find(&r->csv, "t");
  to->quantities = flesh_arena_take(r->arena, columns * sizeof *to->quantities);
  to->data = flesh_arena_take(r->arena, columns * rows * sizeof *to->data);
  if (has_points) to->points = flesh_arena_take(r->arena, rows * sizeof *to->points);
  if (!to->quantities || !to->data || (has_points && !to->points)) return flesh_no_memory();
  int status = check_units(r);
  if (!status) status = choose_columns(r);
  return status ? status : read_rows(r);
}

int flesh_fit_measured_read(flesh_arena *arena, const flesh_scene *scene, flesh_fit_measured *to)
{
  reading r = {.arena = arena, .scene = scene, .to = to};
  int given = 0;
  for (int k = 0; k < 3; k++)
    if (to->paths[k]) given++, to->table = k, to->path = to->paths[k];
  if (given != 1) return flesh_node_fail(to->node, "a measurement has either probes, history or positions");
  if (!isnan(to->deviation) && !isnan(to->weight))
    return flesh_node_fail(flesh_node_find(to->node, "weight"), "weight stands beside deviation; give either");
  if (!isnan(to->weight)) to->deviation = 1 / sqrt(to->weight);
  int status = flesh_csv_read(to->path, FLESH_CSV_WHOLE, &r.csv);
  if (status) return flesh_node_fail_within(status, flesh_node_find(to->node, tables[to->table]), "%s", "");
  status = read_table(&r);
  flesh_locator_destroy(&r.locator);
  flesh_csv_clear(&r.csv);
  return status;
}

static size_t dof_of(const flesh_fit_measured *m, const flesh_fit_datum *d, int a)
{
  return 3 * (size_t)m->points[d->row].nodes[a] + (size_t)(*m->quantities[d->quantity].name - 'x');
}

double flesh_fit_position(const flesh_fit_measured *m, const flesh_fit_datum *d, const double *x)
{
  double sum = 0;
  for (int a = 0; a < m->points[d->row].count; a++) sum += m->points[d->row].weights[a] * x[dof_of(m, d, a)];
  return sum;
}

int flesh_fit_observation_add(flesh_fit_observation *o, double t)
{
  if (!flesh_grow(&o->times, sizeof *o->times, o->count, &o->room))
    return flesh_fail(FLESH_ERR_MEMORY, "out of memory for the derivatives of a fit");
  o->times[o->count++] = t;
  return FLESH_OK;
}

/* Returns the weight of state s for a quantity measured at t; NaN: at the end. Between states the quantity is
 * interpolated linearly. */
static double weight_of(const flesh_fit_observation *o, int s, double t)
{
  const double *times = o->times;
  const int last = o->count - 1;
  if (isnan(t) || t >= times[last]) return s == last;
  if (t == times[s]) return 1;
  if (t < times[s]) return s && t > times[s - 1] ? (t - times[s - 1]) / (times[s] - times[s - 1]) : s == 0;
  return t < times[s + 1] ? (times[s + 1] - t) / (times[s + 1] - times[s]) : 0;
}

void flesh_fit_observation_apply(const flesh_fit_observation *o, int s, const double *x, const double *columns, double *y,
                                 int stride)
{
  for (const flesh_fit_measured *m = o->e->measured; m < o->e->measured + o->e->measured_count; m++)
    for (const flesh_fit_datum *d = m->data; d < m->data + m->count; d++, y += stride) {
      const double weight = weight_of(o, s, d->t);
      if (weight != 0)
        *y += weight * (m->table == FLESH_FIT_OF_PROBES ? columns[m->first_column + d->quantity] : flesh_fit_position(m, d, x));
    }
}

void flesh_fit_observation_transpose(const flesh_fit_observation *o, int s, const double *y, double *x, double *columns)
{
  for (const flesh_fit_measured *m = o->e->measured; m < o->e->measured + o->e->measured_count; m++)
    for (const flesh_fit_datum *d = m->data; d < m->data + m->count; d++, y++) {
      const double weighted = weight_of(o, s, d->t) * *y;
      if (m->table == FLESH_FIT_OF_PROBES) columns[m->first_column + d->quantity] += weighted;
      for (int a = 0; m->points && a < m->points[d->row].count; a++)
        x[dof_of(m, d, a)] += m->points[d->row].weights[a] * weighted;
    }
}
