/* probes.c: a CSV file with a row per step, of chosen places. */
#include "flesh/probe.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/file.h"
#include "math/svd3.h"
#include "output/node_forces.h"
#include "output/probe_place.h"
#include "output/resume.h"
#include "output/rows.h"
#include "output/tet_shape.h"
#include "output/tet_stress.h"

/* Columns of a quantity, with their unit and that of points where it is another. */
static const struct {
  flesh_probe_quantity quantity;
  const char *name, *unit, *point_unit;
} columns[] = {
    {FLESH_PROBE_POSITION, "position_x", "m", NULL},
    {FLESH_PROBE_POSITION, "position_y", "m", NULL},
    {FLESH_PROBE_POSITION, "position_z", "m", NULL},
    {FLESH_PROBE_VELOCITY, "velocity_x", "m/s", NULL},
    {FLESH_PROBE_VELOCITY, "velocity_y", "m/s", NULL},
    {FLESH_PROBE_VELOCITY, "velocity_z", "m/s", NULL},
    {FLESH_PROBE_REACTION, "reaction_x", "N", NULL},
    {FLESH_PROBE_REACTION, "reaction_y", "N", NULL},
    {FLESH_PROBE_REACTION, "reaction_z", "N", NULL},
    {FLESH_PROBE_REACTION, "reaction_moment_x", "N m", NULL},
    {FLESH_PROBE_REACTION, "reaction_moment_y", "N m", NULL},
    {FLESH_PROBE_REACTION, "reaction_moment_z", "N m", NULL},
    {FLESH_PROBE_J, "J", "1", NULL},
    {FLESH_PROBE_STRETCH, "stretch_1", "1", NULL},
    {FLESH_PROBE_STRETCH, "stretch_2", "1", NULL},
    {FLESH_PROBE_STRETCH, "stretch_3", "1", NULL},
    {FLESH_PROBE_STRESS, "stress_xx", "Pa", NULL},
    {FLESH_PROBE_STRESS, "stress_yy", "Pa", NULL},
    {FLESH_PROBE_STRESS, "stress_zz", "Pa", NULL},
    {FLESH_PROBE_STRESS, "stress_xy", "Pa", NULL},
    {FLESH_PROBE_STRESS, "stress_yz", "Pa", NULL},
    {FLESH_PROBE_STRESS, "stress_xz", "Pa", NULL},
    {FLESH_PROBE_ENERGY, "energy", "J", "J/m^3"},
    {FLESH_PROBE_CONTACT_FORCE, "contact_force_x", "N", NULL},
    {FLESH_PROBE_CONTACT_FORCE, "contact_force_y", "N", NULL},
    {FLESH_PROBE_CONTACT_FORCE, "contact_force_z", "N", NULL},
    {FLESH_PROBE_CONTACT_FORCE, "contact_moment_x", "N m", NULL},
    {FLESH_PROBE_CONTACT_FORCE, "contact_moment_y", "N m", NULL},
    {FLESH_PROBE_CONTACT_FORCE, "contact_moment_z", "N m", NULL},
};
enum { COLUMNS = sizeof columns / sizeof *columns };
static const unsigned forces_of = FLESH_PROBE_REACTION | FLESH_PROBE_CONTACT_FORCE;

typedef struct place {
  flesh_probe probe; /* with its own name and nodes */
  char *name;
  int *nodes, *tets;
  int tet_count;
} place;

struct flesh_probes {
  flesh_rows rows;
  const flesh_mesh *mesh;
  flesh_tet_stress stress;
  flesh_node_forces forces;
  int count;
  place *places; /* [count] */
};

static int is_point(const flesh_probe *probe) { return !isnan(probe->point[0]); }

static int copy_place(const flesh_mesh *mesh, const flesh_probe *probe, place *to)
{
  to->probe = *probe;
  to->probe.name = to->name = strdup(probe->name);
  if (!to->name) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a probe");
  if (is_point(probe)) return FLESH_OK;
  const size_t count = (size_t)probe->node_count;
  to->probe.nodes = to->nodes = malloc((count + 1) * sizeof *to->nodes);
  if (!to->nodes) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a probe of %zu nodes", count);
  memcpy(to->nodes, probe->nodes, count * sizeof *to->nodes);
  if (!(probe->quantities & FLESH_PROBE_OF_TETS)) return FLESH_OK;
  return flesh_probe_find_tets(mesh, probe, &to->tet_count, &to->tets);
}

static void print_header(const flesh_probes *probes)
{
  FILE *stream = probes->rows.stream;
  fputs("t [s]", stream);
  for (int k = 0; k < probes->count; k++) {
    const flesh_probe *probe = &probes->places[k].probe;
    for (int c = 0; c < COLUMNS; c++) {
      if (!(probe->quantities & columns[c].quantity)) continue;
      const char *unit = is_point(probe) && columns[c].point_unit ? columns[c].point_unit : columns[c].unit;
      fprintf(stream, ",%s.%s [%s]", probe->name, columns[c].name, unit);
    }
  }
  putc('\n', stream);
}

static int check_probes(int count, const flesh_probe *probes)
{
  for (int k = 0; k < count; k++) {
    const flesh_probe *p = &probes[k];
    if (!p->name || !p->quantities || (is_point(p) ? p->tet < 0 : p->node_count < 1 || !p->nodes))
      return flesh_fail(FLESH_ERR_ARGUMENT, "probes[%d] is not prepared; flesh_probe_prepare does that", k);
    for (int j = 0; j < k; j++)
      if (!strcmp(probes[j].name, p->name))
        return flesh_fail(FLESH_ERR_ARGUMENT, "probes[%d] and probes[%d] are both named %s; names must differ", j, k,
                          p->name);
  }
  return FLESH_OK;
}

/* Without its file. */
static int create(const flesh_body *body, const flesh_system *system, flesh_method method, int count,
                  const flesh_probe *probes, flesh_probes **result)
{
  int status = check_probes(count, probes);
  if (status) return status;
  flesh_probes *made = calloc(1, sizeof *made);
  if (made) made->places = calloc((size_t)count + 1, sizeof *made->places);
  if (!made || !made->places) {
    free(made);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d probes", count);
  }
  made->mesh = body->mesh;
  unsigned wanted = 0;
  for (int k = 0; k < count && !status; k++) {
    status = copy_place(made->mesh, &probes[k], &made->places[made->count++]);
    wanted |= probes[k].quantities;
  }
  if (!status && wanted & FLESH_PROBE_OF_TETS) status = flesh_tet_stress_open(body, system, &made->stress);
  const int is_static = method == FLESH_METHOD_STATIC;
  if (!status && wanted & forces_of)
    status = flesh_node_forces_open(body, system, is_static, (wanted & FLESH_PROBE_REACTION) != 0,
                                    (wanted & FLESH_PROBE_CONTACT_FORCE) != 0, &made->forces);
  *result = made;
  return status;
}

int flesh_probes_create(const char *path, const flesh_body *body, const flesh_system *system, flesh_method method,
                        int count, const flesh_probe *probes, flesh_probes **result)
{
  FLESH_NEED({result, "result"});
  *result = NULL;
  FLESH_NEED({path, "path"}, {body, "body"}, {system, "system"}, {probes, "probes"});
  int status = create(body, system, method, count, probes, result);
  if (!status) status = flesh_rows_open(path, &(*result)->rows);
  if (!status) {
    print_header(*result);
    status = flesh_rows_flush(&(*result)->rows);
  }
  if (status) flesh_probes_close(result);
  return status;
}

int flesh_probes_resume(const char *path, const flesh_body *body, const flesh_system *system, flesh_method method,
                        int count, const flesh_probe *probes, long length, flesh_probes **result)
{
  *result = NULL;
  int status = create(body, system, method, count, probes, result);
  if (!status) status = flesh_rows_resume(path, length, &(*result)->rows);
  if (status) flesh_probes_close(result);
  return status;
}

long flesh_probes_length(const flesh_probes *probes) { return probes->rows.whole; }

int flesh_probes_close(flesh_probes **probes)
{
  if (!probes || !*probes) return FLESH_OK;
  flesh_probes *p = *probes;
  int status = flesh_rows_close(&p->rows);
  for (int k = 0; k < p->count; k++) {
    free(p->places[k].name);
    free(p->places[k].nodes);
    free(p->places[k].tets);
  }
  free(p->places);
  flesh_tet_stress_clear(&p->stress);
  flesh_node_forces_clear(&p->forces);
  free(p);
  *probes = NULL;
  return status;
}

/* Of a vector on nodes [3*n]: at the point, or its mean. */
static void find_vector(const flesh_mesh *mesh, const flesh_probe *probe, const double *x, double value[3])
{
  int nodes[10];
  double weights[10];
  for (int d = 0; d < 3; d++) value[d] = 0;
  if (is_point(probe)) {
    const int size = flesh_tet_weights(mesh, probe->tet, probe->weights, nodes, weights);
    for (int a = 0; a < size; a++)
      for (int d = 0; d < 3; d++) value[d] += weights[a] * x[3 * (size_t)nodes[a] + (size_t)d];
    return;
  }
  for (int k = 0; k < probe->node_count; k++)
    for (int d = 0; d < 3; d++) value[d] += x[3 * (size_t)probe->nodes[k] + (size_t)d];
  for (int d = 0; d < 3; d++) value[d] /= probe->node_count;
}

/* The sum of forces [3*n] on the probe's nodes, and their moment; with `holder`, of the probe's holder alone. */
static void sum_forces(const flesh_probe *probe, const double *x, const double *force, const int *holder,
                       double sums[6])
{
  for (int c = 0; c < 6; c++) sums[c] = 0;
  for (int k = 0; k < probe->node_count; k++) {
    const size_t at = 3 * (size_t)probe->nodes[k];
    const double *y = x + at;
    double f[3];
    for (int d = 0; d < 3; d++) f[d] = holder && holder[at + (size_t)d] != probe->holder ? 0 : force[at + (size_t)d];
    for (int d = 0; d < 3; d++) {
      const int e = (d + 1) % 3, g = (d + 2) % 3;
      sums[d] += f[d];
      sums[3 + d] += (y[e] - probe->about[e]) * f[g] - (y[g] - probe->about[g]) * f[e];
    }
  }
}

/* J, three stretches, six stresses and the energy, in the order of their columns. */
enum { J_AT, STRETCH_AT, STRESS_AT = 4, ENERGY_AT = 10, OF_TETS = 11 };

/* Adds a point's integrals over `volume` at rest: J, stretches, tau, energy. */
static void add_point(const flesh_strain_point *p, double volume, double sums[OF_TETS])
{
  static const int place[6] = {0, 4, 8, 1, 5, 2};
  double U[9], V[9], stretch[3];
  flesh_svd3(p->F, U, stretch, V);
  sums[J_AT] += volume * p->J;
  for (int k = 0; k < 3; k++) sums[STRETCH_AT + k] += volume * stretch[k];
  for (int k = 0; k < 6; k++) sums[STRESS_AT + k] += volume * p->tau[place[k]];
  sums[ENERGY_AT] += volume * p->energy;
}

static void find_strain(const flesh_probes *probes, const place *at, const flesh_state *state, double value[OF_TETS])
{
  flesh_strain_point points[4];
  double volume = 0;
  for (int k = 0; k < OF_TETS; k++) value[k] = 0;
  if (is_point(&at->probe)) {
    flesh_tet_stress_at(&probes->stress, state, at->probe.tet, at->probe.weights, points);
    add_point(points, volume = 1, value);
  }
  for (int e = 0; e < at->tet_count; e++) {
    const int count = flesh_tet_stress_points(&probes->stress, state, at->tets[e], points);
    for (int q = 0; q < count; q++) {
      volume += points[q].volume;
      add_point(&points[q], points[q].volume, value);
    }
  }
  for (int k = 0; k < 6; k++) value[STRESS_AT + k] /= value[J_AT];
  for (int k = 0; k < STRESS_AT; k++) value[k] /= volume;
}

static void put_row(flesh_probes *probes, const place *at, const flesh_state *state)
{
  const flesh_probe *probe = &at->probe;
  double values[COLUMNS] = {0}, *next = values;
  find_vector(probes->mesh, probe, state->x, next);
  find_vector(probes->mesh, probe, state->v, next += 3);
  next += 3;
  if (probe->quantities & FLESH_PROBE_REACTION)
    sum_forces(probe, state->x, probes->forces.reaction, probe->holder ? probes->forces.holder : NULL, next);
  next += 6;
  if (probe->quantities & FLESH_PROBE_OF_TETS) find_strain(probes, at, state, next);
  next += OF_TETS;
  if (probe->quantities & FLESH_PROBE_CONTACT_FORCE)
    sum_forces(probe, state->x,
               probe->contact ? flesh_node_forces_of_contact(&probes->forces, state, probe->contact - 1)
                              : probes->forces.contact,
               NULL, next);
  for (int c = 0; c < COLUMNS; c++) {
    if (!(probe->quantities & columns[c].quantity)) continue;
    putc(',', probes->rows.stream);
    flesh_number_print(probes->rows.stream, values[c]);
  }
}

int flesh_probes_observe(void *data, const flesh_step_record *record)
{
  FLESH_NEED({data, "probes"}, {record, "record"});
  flesh_probes *probes = data;
  probes->forces.proximity = record->proximity;
  if (probes->forces.system) flesh_node_forces_find(&probes->forces, record->state);
  flesh_number_print(probes->rows.stream, record->state->t);
  for (int k = 0; k < probes->count; k++) put_row(probes, &probes->places[k], record->state);
  putc('\n', probes->rows.stream);
  return flesh_rows_flush(&probes->rows);
}
