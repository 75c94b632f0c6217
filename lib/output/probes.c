/* probes.c: a CSV file with a row per step, of values at chosen places. */
#include "flesh/probe.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/file.h"
#include "math/mat3.h"
#include "math/svd3.h"
#include "mesh/mesh.h"
#include "mesh/pieces.h"
#include "output/node_forces.h"
#include "output/probe_patch.h"
#include "output/probe_place.h"
#include "output/resume.h"
#include "output/rows.h"
#include "output/tet_shape.h"
#include "output/tet_stress.h"
#include "system/ranks.h"

/* Columns of a quantity with their units, and names and units for a point if these differ. */
static const struct {
  flesh_probe_quantity quantity;
  const char *name, *unit, *point_name, *point_unit; /* NULL: the same for a point as for nodes */
} columns[] = {
    {FLESH_PROBE_POSITION, "position_x", "m", NULL, NULL},
    {FLESH_PROBE_POSITION, "position_y", "m", NULL, NULL},
    {FLESH_PROBE_POSITION, "position_z", "m", NULL, NULL},
    {FLESH_PROBE_VELOCITY, "velocity_x", "m/s", NULL, NULL},
    {FLESH_PROBE_VELOCITY, "velocity_y", "m/s", NULL, NULL},
    {FLESH_PROBE_VELOCITY, "velocity_z", "m/s", NULL, NULL},
    {FLESH_PROBE_REACTION, "reaction_x", "N", NULL, NULL},
    {FLESH_PROBE_REACTION, "reaction_y", "N", NULL, NULL},
    {FLESH_PROBE_REACTION, "reaction_z", "N", NULL, NULL},
    {FLESH_PROBE_REACTION, "reaction_moment_x", "N m", NULL, NULL},
    {FLESH_PROBE_REACTION, "reaction_moment_y", "N m", NULL, NULL},
    {FLESH_PROBE_REACTION, "reaction_moment_z", "N m", NULL, NULL},
    {FLESH_PROBE_J, "J_mean", "1", "J", NULL},
    {FLESH_PROBE_STRETCH, "stretch_1", "1", NULL, NULL},
    {FLESH_PROBE_STRETCH, "stretch_2", "1", NULL, NULL},
    {FLESH_PROBE_STRETCH, "stretch_3", "1", NULL, NULL},
    {FLESH_PROBE_STRESS, "stress_xx", "Pa", NULL, NULL},
    {FLESH_PROBE_STRESS, "stress_yy", "Pa", NULL, NULL},
    {FLESH_PROBE_STRESS, "stress_zz", "Pa", NULL, NULL},
    {FLESH_PROBE_STRESS, "stress_xy", "Pa", NULL, NULL},
    {FLESH_PROBE_STRESS, "stress_yz", "Pa", NULL, NULL},
    {FLESH_PROBE_STRESS, "stress_xz", "Pa", NULL, NULL},
    {FLESH_PROBE_ENERGY, "energy", "J", NULL, "J/m^3"},
    {FLESH_PROBE_CONTACT_FORCE, "contact_force_x", "N", NULL, NULL},
    {FLESH_PROBE_CONTACT_FORCE, "contact_force_y", "N", NULL, NULL},
    {FLESH_PROBE_CONTACT_FORCE, "contact_force_z", "N", NULL, NULL},
    {FLESH_PROBE_CONTACT_FORCE, "contact_moment_x", "N m", NULL, NULL},
    {FLESH_PROBE_CONTACT_FORCE, "contact_moment_y", "N m", NULL, NULL},
    {FLESH_PROBE_CONTACT_FORCE, "contact_moment_z", "N m", NULL, NULL},
};
enum { COLUMNS = sizeof columns / sizeof *columns, VOLUME_AT = COLUMNS, NUMBERS };

typedef struct place {
  flesh_probe probe; /* with its own name and nodes */
  char *name;
  int *nodes, *tets; /* NULL for a point that is not smoothed, whose tet is in the probe */
  double *weights;   /* [4*tet_count] of the quadrature points by which a point is smoothed; NULL: no place of that kind */
  int tet_count;
  double node_count; /* over all ranks */
} place;

struct flesh_probes {
  flesh_rows rows; /* on the first rank */
  const flesh_mesh *mesh;
  const flesh_team *team; /* the system's; NULL: a single rank */
  flesh_tet_stress stress;
  flesh_node_forces forces;
  int count;
  place *places;   /* [count], of twice the room, for smoothed ones */
  double *numbers; /* [count*NUMBERS] numbers of a row; the same */
  double *figures; /* borrowed; NULL: not wanted */
};

static int is_point(const flesh_probe *probe) { return !isnan(probe->point[0]); }

static int copy_place(const flesh_mesh *mesh, const flesh_probe *probe, place *to)
{
  to->probe = *probe;
  to->probe.name = to->name = strdup(probe->name);
  if (!to->name) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a probe");
  to->tet_count = is_point(probe) && probe->tet >= 0;
  if (is_point(probe)) return FLESH_OK;
  const size_t count = (size_t)probe->node_count;
  to->probe.nodes = to->nodes = malloc((count + 1) * sizeof *to->nodes);
  if (!to->nodes) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a probe of %zu nodes", count);
  memcpy(to->nodes, probe->nodes, count * sizeof *to->nodes);
  if (!(probe->quantities & FLESH_PROBE_OF_TETS)) return FLESH_OK;
  return flesh_probe_find_tets(mesh, probe, &to->tet_count, &to->tets);
}

int flesh_probe_columns(const flesh_probe *probe, flesh_probe_column found[FLESH_PROBE_COLUMNS])
{
  _Static_assert((int)FLESH_PROBE_COLUMNS == (int)COLUMNS, "the columns of a probe");
  const int at_point = is_point(probe);
  int count = 0;
  for (int c = 0; c < COLUMNS; c++)
    if (probe->quantities & columns[c].quantity)
      found[count++] =
          (flesh_probe_column){at_point && columns[c].point_name ? columns[c].point_name : columns[c].name,
                               at_point && columns[c].point_unit ? columns[c].point_unit : columns[c].unit};
  return count;
}

static void print_header(const flesh_probes *probes)
{
  FILE *stream = probes->rows.stream;
  flesh_probe_column found[FLESH_PROBE_COLUMNS];
  fputs("t [s]", stream);
  for (int k = 0; k < probes->count; k++) {
    const int count = flesh_probe_columns(&probes->places[k].probe, found);
    for (int c = 0; c < count; c++)
      fprintf(stream, ",%s.%s%s [%s]", probes->places[k].probe.name, found[c].name, probes->places[k].weights ? "_smooth" : "",
              found[c].unit);
  }
  putc('\n', stream);
}

/* Makes the probes, without communication between ranks. */
static int create_here(const flesh_body *body, const flesh_system *system, int count, const flesh_probe *probes,
                       flesh_probes **result)
{
  const flesh_team *team = flesh_system_team(system);
  int status = flesh_mesh_check_counts(flesh_system_mesh(system), "the body", "", body->mesh->nodes, body->mesh->tets);
  if (!status) status = flesh_probes_check(body->mesh, count, probes, team);
  if (status) return status;
  flesh_probes *made = *result = calloc(1, sizeof *made);
  if (made)
    *made = (flesh_probes){.mesh = body->mesh, .team = team, .places = calloc(2 * (size_t)count + 1, sizeof *made->places),
                           .numbers = calloc(2 * (size_t)count * NUMBERS + 1, sizeof *made->numbers)};
  if (!made || !made->places || !made->numbers) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d probes", count);
  unsigned wanted = 0;
  for (int k = 0; k < count && !status; k++) {
    place *at = &made->places[made->count++];
    status = copy_place(made->mesh, &probes[k], at);
    wanted |= probes[k].quantities;
    for (int i = 0; i < at->probe.node_count && !is_point(&at->probe) && !status; i++)
      at->node_count += flesh_probe_counts(&at->probe, team, i);
  }
  return !status && wanted & FLESH_PROBE_OF_TETS ? flesh_tet_stress_open(body, system, &made->stress) : status;
}

int flesh_probes_open(const flesh_body *body, const flesh_system *system, flesh_method method, int count,
                      const flesh_probe *probes, flesh_probes **result)
{
  *result = NULL;
  unsigned wanted = 0;
  for (int k = 0; k < count; k++) wanted |= probes[k].quantities;
  flesh_node_forces forces = {0};
  int status = create_here(body, system, count, probes, result);
  status = flesh_node_forces_open(status, body, system, method == FLESH_METHOD_STATIC,
                                  (wanted & FLESH_PROBE_REACTION) != 0, (wanted & FLESH_PROBE_CONTACT_FORCE) != 0, &forces);
  if (*result) (*result)->forces = forces;
  for (int k = 0; k < count && !status; k++)
    flesh_team_sum(flesh_system_team(system), 1, &(*result)->places[k].node_count);
  if (status) flesh_probes_close(result);
  return status;
}

static int writes(const flesh_probes *probes) { return !probes->team || probes->team->rank == 0; }

/* Agrees on the status, so that all ranks continue or all close their probes. */
static int settle(int status, flesh_probes **probes)
{
  status = flesh_team_agree((*probes)->team, status);
  if (status) flesh_probes_close(probes);
  return status;
}

int flesh_probes_smooth(flesh_probes **probes)
{
  flesh_probes *p = *probes;
  int status = FLESH_OK;
  for (int k = 0, count = p->count; k < count && !status; k++) {
    flesh_probe probe = p->places[k].probe;
    place *made = &p->places[p->count];
    probe.quantities &= FLESH_PROBE_OF_TETS;
    if (!is_point(&probe) || !probe.quantities || !flesh_mesh_is_quadratic(p->mesh, probe.tet)) continue;
    p->count++;
    status = copy_place(p->mesh, &probe, made);
    if (!status) status = flesh_patch_find(&p->stress, probe.tet, probe.point, &made->tet_count, &made->tets, &made->weights);
  }
  if (status) flesh_probes_close(probes);
  return status;
}

int flesh_probes_begin(flesh_probes **probes, const char *path)
{
  int status = FLESH_OK;
  if (writes(*probes)) status = flesh_rows_open(path, &(*probes)->rows);
  if (writes(*probes) && !status) {
    print_header(*probes);
    status = flesh_rows_flush(&(*probes)->rows);
  }
  return settle(status, probes);
}

int flesh_probes_create(const char *path, const flesh_body *body, const flesh_system *system, flesh_method method,
                        int count, const flesh_probe *probes, flesh_probes **result)
{
  FLESH_NEED({result, "result"});
  *result = NULL;
  FLESH_NEED({path, "path"}, {body, "body"}, {system, "system"}, {probes, "probes"});
  if (count < 0) return flesh_fail(FLESH_ERR_ARGUMENT, "count is %d probes; it must not be negative", count);
  const int status = flesh_probes_open(body, system, method, count, probes, result);
  return status ? status : flesh_probes_begin(result, path);
}

int flesh_probes_resume(flesh_probes **probes, const char *path, long length)
{
  return settle(writes(*probes) ? flesh_rows_resume(path, length, &(*probes)->rows) : FLESH_OK, probes);
}

void flesh_probes_note(flesh_probes *probes, double *figures) { probes->figures = figures; }

flesh_node_forces *flesh_probes_forces(flesh_probes *probes) { return &probes->forces; }

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
    free(p->places[k].weights);
  }
  free(p->places);
  free(p->numbers);
  flesh_tet_stress_clear(&p->stress);
  flesh_node_forces_clear(&p->forces);
  free(p);
  *probes = NULL;
  return status;
}

/* Adds the value at the point, or the sum over the nodes, of a vector x [3*n]. Here and below, other ranks' nodes and
 * tets contribute 0. */
static void find_vector(const flesh_probes *probes, const flesh_probe *probe, const double *x, double value[3])
{
  const flesh_mesh *mesh = probes->mesh;
  int nodes[10];
  double weights[10];
  if (is_point(probe) && probe->tet < 0) return;
  if (is_point(probe)) {
    const int size = flesh_tet_weights(mesh, probe->tet, probe->weights, nodes, weights);
    for (int a = 0; a < size; a++)
      for (int d = 0; d < 3; d++) value[d] += weights[a] * x[3 * (size_t)nodes[a] + (size_t)d];
    return;
  }
  for (int k = 0; k < probe->node_count; k++)
    for (int d = 0; d < 3 && flesh_probe_counts(probe, probes->team, k); d++)
      value[d] += x[3 * (size_t)probe->nodes[k] + (size_t)d];
}

/* Sums forces [3*n] on the probe's nodes, and their moment; with `holder`, only those of the probe's holder. */
static void sum_forces(const flesh_probes *probes, const flesh_probe *probe, const double *x, const double *force,
                       const int *holder, double sums[6])
{
  for (int k = 0; k < probe->node_count; k++) {
    if (!flesh_probe_counts(probe, probes->team, k)) continue;
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

/* Indices of a point's numbers, in the order of the columns. */
enum { J_AT = FLESH_POINT_J, STRETCH_AT = FLESH_POINT_STRETCH, STRESS_AT = FLESH_POINT_TAU, OF_TETS = FLESH_POINT_NUMBERS };

/* Adds a point's integrals over `volume` at rest: J, stretches if they are wanted, tau, energy. */
static void add_point(const flesh_strain_point *p, double volume, int stretches, double sums[OF_TETS])
{
  double U[9], V[9], stretch[3] = {0};
  if (stretches) flesh_svd3(p->F, U, stretch, V);
  sums[J_AT] += volume * p->J;
  for (int k = 0; k < 3; k++) sums[STRETCH_AT + k] += volume * stretch[k];
  for (int k = 0; k < 6; k++) sums[STRESS_AT + k] += volume * p->tau[flesh_tau_place[k]];
  sums[FLESH_POINT_ENERGY] += volume * p->energy;
}

/* Finds the points of the place's k-th tet; returns their number. */
static int find_points(const flesh_probes *probes, const place *at, const flesh_state *state, int k, flesh_strain_point points[4])
{
  const flesh_probe *probe = &at->probe;
  if (at->tets) {
    const int count = flesh_tet_stress_points(&probes->stress, state, at->tets[k], points);
    for (int q = 0; q < count && at->weights; q++) points[q].volume = at->weights[count * k + q];
    return count;
  }
  flesh_tet_stress_at(&probes->stress, state, probe->tet, probe->weights, points);
  points->volume = 1;
  return 1;
}

/* Adds the integrals over the place's k-th tet, and its rest volume. */
static void add_tet(const flesh_probes *probes, const place *at, const flesh_state *state, int k, double value[OF_TETS],
                    double *volume)
{
  flesh_strain_point points[4];
  const int count = find_points(probes, at, state, k, points);
  for (int q = 0; q < count; q++) {
    *volume += points[q].volume;
    add_point(&points[q], points[q].volume, (at->probe.quantities & FLESH_PROBE_STRETCH) != 0, value);
  }
}

/* Index of each quantity's first number among a probe's numbers. */
enum { VELOCITY_AT = 3, REACTION_AT = 6, TETS_AT = 12, CONTACT_AT = TETS_AT + OF_TETS };
_Static_assert((int)CONTACT_AT + 6 == (int)COLUMNS, "a quantity is missing");

/* Computes this rank's contribution to a row, [NUMBERS]. */
static void find_numbers(flesh_probes *probes, const place *at, const flesh_step_record *record, double *numbers)
{
  const flesh_state *state = record->state;
  const flesh_probe *probe = &at->probe;
  memset(numbers, 0, NUMBERS * sizeof *numbers);
  find_vector(probes, probe, state->x, numbers);
  find_vector(probes, probe, state->v, numbers + VELOCITY_AT);
  if (probe->quantities & FLESH_PROBE_REACTION)
    sum_forces(probes, probe, state->x, probes->forces.reaction, probe->holder ? probes->forces.holder : NULL,
               numbers + REACTION_AT);
  for (int k = 0; k < at->tet_count && probe->quantities & FLESH_PROBE_OF_TETS; k++)
    add_tet(probes, at, state, k, numbers + TETS_AT, numbers + VOLUME_AT);
  if (probe->quantities & FLESH_PROBE_CONTACT_FORCE)
    sum_forces(probes, probe, record->stage->x,
               probe->contact ? flesh_node_forces_of_contact(&probes->forces, record, probe->contact - 1)
                              : probes->forces.contact,
               NULL, numbers + CONTACT_AT);
}

/* Records a column's last, smallest and largest value. */
static void note(double figures[FLESH_PROBE_FIGURES], double value)
{
  figures[0] = value;
  figures[1] = fmin(figures[1], value);
  figures[2] = fmax(figures[2], value);
}

/* Turns sums over all ranks into means and writes a row. Moves `figures` past those of the probe. */
static void put_row(flesh_probes *probes, const place *at, double *values, double **figures)
{
  const flesh_probe *probe = &at->probe;
  double *of_tets = values + TETS_AT;
  for (int d = 0; d < REACTION_AT && !is_point(probe); d++) values[d] /= at->node_count;
  if (probe->quantities & FLESH_PROBE_OF_TETS) {
    for (int k = 0; k < 6; k++) of_tets[STRESS_AT + k] /= of_tets[J_AT];
    for (int k = 0; k < STRESS_AT; k++) of_tets[k] /= values[VOLUME_AT];
  }
  for (int c = 0; c < COLUMNS; c++) {
    if (!(probe->quantities & columns[c].quantity)) continue;
    if (*figures && !at->weights) note(*figures, values[c]), *figures += FLESH_PROBE_FIGURES;
    if (!probes->rows.stream) continue;
    putc(',', probes->rows.stream);
    flesh_number_print(probes->rows.stream, values[c]);
  }
}

int flesh_probes_observe(void *data, const flesh_step_record *record)
{
  FLESH_NEED({data, "probes"}, {record, "record"});
  flesh_probes *probes = data;
  const int status = flesh_mesh_check_counts(flesh_system_mesh(record->system), "probes", "", probes->mesh->nodes,
                                             probes->mesh->tets);
  if (status) return status;
  if (probes->forces.system) flesh_node_forces_find(&probes->forces, record);
  for (int k = 0; k < probes->count; k++)
    find_numbers(probes, &probes->places[k], record, probes->numbers + (size_t)NUMBERS * (size_t)k);
  flesh_team_sum(probes->team, probes->count * NUMBERS, probes->numbers);
  if (!writes(probes)) return FLESH_OK;
  double *figures = probes->figures;
  if (probes->rows.stream) flesh_number_print(probes->rows.stream, record->state->t);
  for (int k = 0; k < probes->count; k++)
    put_row(probes, &probes->places[k], probes->numbers + (size_t)NUMBERS * (size_t)k, &figures);
  if (!probes->rows.stream) return FLESH_OK;
  putc('\n', probes->rows.stream);
  return flesh_rows_flush(&probes->rows);
}

/* Adds to by_x [3*n] `scale` times the derivative of a number's integral over the place's k-th tet. */
static void add_slopes(const flesh_probes *probes, const place *at, const flesh_state *state, int k, int number, double scale,
                       double *by_x)
{
  flesh_strain_point points[4];
  const int tet = is_point(&at->probe) ? at->probe.tet : at->tets[k], count = find_points(probes, at, state, k, points);
  double by_F[9], by_mean, all = 0, volume = 0;
  for (int q = 0; q < count; q++) {
    const double size = scale * points[q].volume;
    flesh_tet_stress_slope(&probes->stress, state, tet, &points[q], number, by_F, &by_mean);
    all += size * by_mean;
    for (int i = 0; i < 9; i++) by_F[i] *= size;
    flesh_tet_gradient_back(probes->mesh, tet, points[q].L, by_F, by_x);
  }
  if (all == 0) return;
  const int meant = flesh_tet_stress_points(&probes->stress, state, tet, points);
  for (int q = 0; q < meant; q++) volume += points[q].volume;
  for (int q = 0; q < meant; q++) {
    flesh_mat3_cofactor(points[q].F, by_F);
    for (int i = 0; i < 9; i++) by_F[i] *= all * points[q].volume / volume;
    flesh_tet_gradient_back(probes->mesh, tet, points[q].L, by_F, by_x);
  }
}

void flesh_probes_differentiate(const flesh_probes *probes, const flesh_state *state, int column, double *by_x)
{
  const place *at = probes->places;
  const unsigned quantity = at->probe.quantities;
  double sums[OF_TETS + 1] = {0};
  int first = 0;
  while (columns[first].quantity != quantity) first++;
  const int number = first + column - TETS_AT;
  for (int k = 0; k < at->tet_count && quantity != FLESH_PROBE_ENERGY; k++) add_tet(probes, at, state, k, sums, sums + OF_TETS);
  const double whole = quantity == FLESH_PROBE_ENERGY ? 1 : sums[quantity == FLESH_PROBE_STRESS ? J_AT : OF_TETS];
  for (int k = 0; k < at->tet_count; k++) {
    add_slopes(probes, at, state, k, number, 1 / whole, by_x);
    if (quantity == FLESH_PROBE_STRESS) add_slopes(probes, at, state, k, J_AT, -sums[number] / whole / whole, by_x);
  }
}
