/* fields.c: stress, strain, energy and forces as arrays over nodes, tets and the points of tets, for frames.
 *
 * The stress and stretch of a node are means over the tets around it, weighted by rest volume, of the tet's value at
 * the node. This value is constant in a tet of four nodes; in a tet of ten it is linear through the four quadrature
 * points, extrapolated to the corners (Hinton & Campbell 1974, local smoothing), and half-way on an edge. J and energy
 * are means of the tets' means, as extrapolated values could change their sign. Pressures of tet10-mean are smoothed
 * (even_pressure.h). */
#include "output/fields.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "math/svd3.h"
#include "mesh/edges.h"
#include "mesh/mesh.h"
#include "mesh/pieces.h"
#include "mesh/tet10.h"
#include "system/ranks.h"

enum { J, STRETCH, STRESS, VON_MISES, PRESSURE, ENERGY_DENSITY };
_Static_assert(ENERGY_DENSITY + 1 == FLESH_TET_FIELDS, "a field is missing");

static const char *const stretch_names[] = {"1", "2", "3"};
static const char *const stress_names[] = {"XX", "YY", "ZZ", "XY", "YZ", "XZ"}; /* VTK's order */

/* `at`: index of the field's first value in a sample; -1: the field is computed from the stress. */
static const struct {
  const char *name, *points_name, *unit;
  int components, at;
  const char *const *component_names;
} rows[FLESH_TET_FIELDS] = {{"J_mean", "J_at_points", "1", 1, 0, NULL},
                            {"stretch", "stretch_at_points", "1", 3, 1, stretch_names},
                            {"stress", "stress_at_points", "Pa", 6, 4, stress_names},
                            {"von_mises", "von_mises_at_points", "Pa", 1, -1, NULL},
                            {"pressure", "pressure_at_points", "Pa", 1, -1, NULL},
                            {"energy_density", "energy_density_at_points", "J/m^3", 1, 10, NULL}};

/* Number of values at a point: J, three stretches, six stresses and the energy. */
enum { SAMPLE = 11 };
static const int tensor_place[6] = {0, 4, 8, 1, 5, 2};

static const unsigned of_tets = FLESH_FIELD_J | FLESH_FIELD_STRETCH | FLESH_FIELD_STRESS | FLESH_FIELD_VON_MISES |
                                FLESH_FIELD_PRESSURE | FLESH_FIELD_ENERGY_DENSITY;
static const unsigned of_stress = FLESH_FIELD_STRESS | FLESH_FIELD_VON_MISES | FLESH_FIELD_PRESSURE;

static int wants(const flesh_fields *f, int row) { return (f->fields & (unsigned)FLESH_FIELD_J << row) != 0; }

static int has_even_pressures(const flesh_fields *f) { return f->at_nodes[PRESSURE] || f->at_tets[PRESSURE]; }

int flesh_fields_check(const flesh_body *body, const flesh_system *system, unsigned fields, unsigned places)
{
  const unsigned of_material = of_stress | FLESH_FIELD_ENERGY_DENSITY, all = 2 * FLESH_FIELD_CONTACT_FORCE - 1,
                 all_places = FLESH_AT_NODES | FLESH_AT_TETS | FLESH_AT_POINTS;
  if (fields & ~all || places & ~all_places)
    return flesh_fail(FLESH_ERR_ARGUMENT, "fields are %#x at %#x; valid bits are those of %#x at %#x", fields, places, all, all_places);
  if (fields & of_tets && !places)
    return flesh_fail(FLESH_ERR_ARGUMENT, "fields_at is empty; it must name some of nodes, tets and points");
  if (fields & of_material && !body->materials)
    return flesh_fail(FLESH_ERR_ARGUMENT, "fields has %s, but the body has no material",
                      fields & FLESH_FIELD_STRESS      ? "stress"
                      : fields & FLESH_FIELD_VON_MISES ? "von_mises"
                      : fields & FLESH_FIELD_PRESSURE  ? "pressure"
                                                       : "energy_density");
  if (fields & FLESH_FIELD_CONTACT_FORCE && !flesh_system_has_role(system, FLESH_ROLE_CONTACT))
    return flesh_fail(FLESH_ERR_ARGUMENT, "fields has contact_force, but nothing touches the body; add contact");
  return FLESH_OK;
}

/* Returns the largest number of quadrature points of a tet; a tet of four nodes beside others of ten has the same value
 * at all of them. */
static int point_count(const flesh_body *body)
{
  return flesh_mesh_order(body->mesh) == 2 ? FLESH_TET10_POINTS : 1;
}

/* Allocates an array and adds it to the list. */
static int add_array(flesh_field_list *list, const char *name, int row, int groups, int count, double **values)
{
  const int components = groups * rows[row].components;
  *values = calloc((size_t)count * (size_t)components + 1, sizeof **values);
  list->arrays[list->count++] = (flesh_vtu_array){.name = name,
                                                  .components = components,
                                                  .doubles = *values,
                                                  .unit = rows[row].unit,
                                                  .component_names = rows[row].component_names,
                                                  .groups = groups};
  return *values ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for the field %s of %d places", name, count);
}

static int add_arrays(flesh_fields *f)
{
  const int n = flesh_mesh_node_count(f->body->mesh), tets = flesh_mesh_tet_count(f->body->mesh);
  int status = FLESH_OK;
  for (int row = 0; row < FLESH_TET_FIELDS && !status; row++) {
    /* von Mises stress and pressure are computed from the stress, which stays out of the lists unless it is asked
     * for. */
    const int hidden = row == STRESS && !wants(f, row) && f->fields & of_stress;
    const int node_count = f->nodes.count, tet_count = f->tets.count;
    if (!wants(f, row) && !hidden) continue;
    if (f->places & FLESH_AT_NODES) status = add_array(&f->nodes, rows[row].name, row, 1, n, &f->at_nodes[row]);
    if (!status && f->places & FLESH_AT_TETS && row != J) /* every frame has J_mean of tets */
      status = add_array(&f->tets, rows[row].name, row, 1, tets, &f->at_tets[row]);
    if (!status && f->places & FLESH_AT_POINTS)
      status = add_array(&f->tets, rows[row].points_name, row, point_count(f->body), tets, &f->at_points[row]);
    if (hidden) f->nodes.count = node_count, f->tets.count = tet_count;
  }
  return status;
}

static void add_forces(flesh_fields *f)
{
  static const char *const names[] = {"reaction", "contact_force"};
  const double *const values[] = {f->forces.reaction, f->forces.contact};
  for (int k = 0; k < 2; k++)
    if (values[k])
      f->nodes.arrays[f->nodes.count++] =
          (flesh_vtu_array){.name = names[k], .components = 3, .doubles = values[k], .unit = "N"};
}

int flesh_fields_open(const flesh_body *body, const flesh_system *system, flesh_method method, unsigned fields,
                      unsigned places, flesh_fields *f)
{
  *f = (flesh_fields){.fields = fields, .places = places, .body = body, .team = flesh_system_team(system)};
  int status = flesh_mesh_check_counts(flesh_system_mesh(system), "the body", "", body->mesh->nodes, body->mesh->tets);
  if (!status) status = flesh_fields_check(body, system, fields, places);
  if (!status) status = flesh_tet_stress_open(body, system, &f->stress);
  if (!status) status = add_arrays(f);
  if (!status && !(f->weight = calloc((size_t)flesh_mesh_node_count(body->mesh) + 1, sizeof(double))))
    status = flesh_fail(FLESH_ERR_MEMORY, "no memory for fields");
  status = flesh_node_forces_open(status, body, system, method == FLESH_METHOD_STATIC,
                                  (fields & FLESH_FIELD_REACTION) != 0, (fields & FLESH_FIELD_CONTACT_FORCE) != 0,
                                  &f->forces);
  if (!status && has_even_pressures(f)) status = flesh_even_pressure_open(&f->stress, f->team, &f->even);
  if (!status) add_forces(f);
  if (status) flesh_fields_clear(f);
  return status;
}

void flesh_fields_clear(flesh_fields *f)
{
  for (int row = 0; row < FLESH_TET_FIELDS; row++) {
    free(f->at_nodes[row]);
    free(f->at_tets[row]);
    free(f->at_points[row]);
  }
  free(f->weight);
  flesh_tet_stress_clear(&f->stress);
  flesh_even_pressure_clear(&f->even);
  flesh_node_forces_clear(&f->forces);
  *f = (flesh_fields){0};
}

/* Fills in the values at a quadrature point; the stress is Cauchy's. */
static void take_sample(const flesh_fields *f, const flesh_strain_point *p, double sample[SAMPLE])
{
  double U[9], V[9];
  sample[0] = p->J;
  if (wants(f, STRETCH)) flesh_svd3(p->F, U, sample + rows[STRETCH].at, V);
  for (int k = 0; k < 6; k++) sample[rows[STRESS].at + k] = p->tau[tensor_place[k]] / p->J;
  sample[rows[ENERGY_DENSITY].at] = p->energy;
}

/* Computes means over the tet: of stress over its current volume, of the rest over its rest volume, which is
 * returned. */
static double take_mean(int count, const flesh_strain_point *points, double (*samples)[SAMPLE], double mean[SAMPLE])
{
  double volume = 0, now = 0;
  for (int q = 0; q < count; q++) volume += points[q].volume, now += points[q].volume * points[q].J;
  for (int k = 0; k < SAMPLE; k++) {
    const int s = k - rows[STRESS].at, is_stress = s >= 0 && s < 6;
    double sum = 0;
    for (int q = 0; q < count; q++)
      sum += points[q].volume * (is_stress ? points[q].tau[tensor_place[s]] : samples[q][k]);
    mean[k] = sum / (is_stress ? now : volume);
  }
  return volume;
}

/* Writes a field of a sample to `to`; `s` is the stress, from which some fields are computed. */
static void put(int row, const double *values, const double *s, double *to)
{
  if (row == VON_MISES)
    *to = sqrt(0.5 * (pow(s[0] - s[1], 2) + pow(s[1] - s[2], 2) + pow(s[2] - s[0], 2)) +
               3 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
  else if (row == PRESSURE) *to = -(s[0] + s[1] + s[2]) / 3;
  else memcpy(to, values, (size_t)rows[row].components * sizeof *to);
}

static void put_sample(const double sample[SAMPLE], double *const arrays[FLESH_TET_FIELDS], size_t index)
{
  for (int row = 0; row < FLESH_TET_FIELDS; row++)
    if (arrays[row])
      put(row, sample + (rows[row].at < 0 ? 0 : rows[row].at), sample + rows[STRESS].at,
          arrays[row] + index * (size_t)rows[row].components);
}

/* Adds a tet's values at its nodes, times the tet's rest volume. */
static void add_to_nodes(flesh_fields *f, int tet, int count, double (*samples)[SAMPLE], const double mean[SAMPLE],
                         double volume)
{
  const double beyond = 1 / (FLESH_TET10_NEAR - FLESH_TET10_FAR); /* from point a to corner a, relative to the centroid */
  double values[10][SAMPLE], middle[SAMPLE] = {0};
  int nodes[10];
  const int size = flesh_mesh_tet_nodes(f->body->mesh, tet, nodes);
  for (int a = 0; a < 4; a++) memcpy(values[a], mean, sizeof values[a]);
  for (int k = rows[STRETCH].at; k < rows[STRESS].at + 6 && count == 4; k++) {
    for (int q = 0; q < 4; q++) middle[k] += samples[q][k] / 4;
    for (int a = 0; a < 4; a++) values[a][k] = middle[k] + beyond * (samples[a][k] - middle[k]);
  }
  for (int a = 4; a < size; a++)
    for (int k = 0; k < SAMPLE; k++)
      values[a][k] = (values[flesh_edge_corners[a - 4][0]][k] + values[flesh_edge_corners[a - 4][1]][k]) / 2;
  for (int a = 0; a < size; a++) {
    f->weight[nodes[a]] += volume;
    for (int row = 0; row < FLESH_TET_FIELDS; row++)
      for (int k = 0; f->at_nodes[row] && rows[row].at >= 0 && k < rows[row].components; k++)
        f->at_nodes[row][(size_t)nodes[a] * (size_t)rows[row].components + (size_t)k] +=
            volume * values[a][rows[row].at + k];
  }
}

/* Turns sums over the tets of all ranks into means; a node without tets has no value. */
static void finish_nodes(flesh_fields *f, int n)
{
  flesh_team_sum_nodes(f->team, 1, f->weight);
  for (int row = 0; row < FLESH_TET_FIELDS; row++)
    if (rows[row].at >= 0 && f->at_nodes[row]) flesh_team_sum_nodes(f->team, rows[row].components, f->at_nodes[row]);
  for (int row = 0; row < FLESH_TET_FIELDS; row++) {
    const size_t components = (size_t)rows[row].components;
    for (size_t i = 0; f->at_nodes[row] && i < (size_t)n; i++) {
      double *to = f->at_nodes[row] + i * components;
      if (rows[row].at < 0) put(row, to, f->at_nodes[STRESS] + 6 * i, to);
      for (size_t k = 0; rows[row].at >= 0 && k < components; k++)
        to[k] = f->weight[i] > 0 ? to[k] / f->weight[i] : NAN;
    }
  }
}

static void clear_nodes(flesh_fields *f, size_t n)
{
  memset(f->weight, 0, n * sizeof *f->weight);
  for (int row = 0; row < FLESH_TET_FIELDS; row++)
    if (f->at_nodes[row]) memset(f->at_nodes[row], 0, n * (size_t)rows[row].components * sizeof(double));
}

/* Replaces the pressures of tet10-mean, of tets and at nodes, by those of a continuous field. */
static void even_pressures(flesh_fields *f, int tets)
{
  double *at_tets = f->at_tets[PRESSURE], *at_nodes = f->at_nodes[PRESSURE];
  const double *q = f->even.q;
  flesh_even_pressure_find(&f->even);
  if (at_tets) memcpy(at_tets, f->even.p, (size_t)tets * sizeof *at_tets);
  for (int e = 0; at_nodes && e < tets; e++) {
    int nodes[10];
    const int size = flesh_mesh_tet_nodes(f->body->mesh, e, nodes);
    for (int a = 0; a < size; a++) {
      const int *ends = a < 4 ? (int[2]){a, a} : flesh_edge_corners[a - 4];
      const double p = (q[nodes[ends[0]]] + q[nodes[ends[1]]]) / 2;
      if (isfinite(p) && isfinite(at_nodes[nodes[a]])) at_nodes[nodes[a]] = p;
    }
  }
}

void flesh_fields_find(flesh_fields *f, const flesh_step_record *record)
{
  const int n = flesh_mesh_node_count(f->body->mesh), tets = flesh_mesh_tet_count(f->body->mesh);
  const int most = point_count(f->body);
  if (f->forces.system) flesh_node_forces_find(&f->forces, record);
  if (!(f->fields & of_tets)) return;
  clear_nodes(f, (size_t)n);
  for (int e = 0; e < tets; e++) {
    flesh_strain_point points[4];
    double samples[4][SAMPLE] = {{0}}, mean[SAMPLE];
    const int count = flesh_tet_stress_points(&f->stress, record->state, e, points);
    for (int q = 0; q < count; q++) take_sample(f, &points[q], samples[q]);
    for (int q = 0; q < most; q++) put_sample(samples[q < count ? q : 0], f->at_points, (size_t)(most * e + q));
    const double volume = take_mean(count, points, samples, mean);
    put_sample(mean, f->at_tets, (size_t)e);
    if (has_even_pressures(f)) put(PRESSURE, NULL, mean + rows[STRESS].at, &f->even.p[e]);
    if (f->places & FLESH_AT_NODES) add_to_nodes(f, e, count, samples, mean, volume);
  }
  if (f->places & FLESH_AT_NODES) finish_nodes(f, n);
  if (has_even_pressures(f)) even_pressures(f, tets);
}

void flesh_frame_make(const flesh_mesh *mesh, flesh_fields *fields, const flesh_team *team, double *displacement,
                      const flesh_step_record *record, flesh_frame *frame)
{
  const flesh_vtu_array of_nodes[] = {{.name = "displacement", .components = 3, .doubles = displacement, .unit = "m"},
                                      {.name = "velocity", .components = 3, .doubles = record->state->v, .unit = "m/s"},
                                      {.name = "node", .components = 1, .integers = team ? team->numbers : NULL}};
  const flesh_vtu_array of_tets[] = {{.name = "J_mean", .components = 1, .doubles = record->tet_J_mean, .unit = "1"},
                                     {.name = "J_min", .components = 1, .doubles = record->tet_J_min, .unit = "1"},
                                     {.name = "region", .components = 1, .integers = flesh_mesh_regions(mesh)},
                                     {.name = "tet", .components = 1, .integers = team ? team->tets : NULL}};
  const int points = team ? team->nodes : flesh_mesh_node_count(mesh);
  const double *x = record->state->x, *rest = flesh_mesh_positions(mesh);
  flesh_field_list *nodes = &frame->nodes, *tets = &frame->tets;
  for (int d = 0; d < 3 * points; d++) displacement[d] = x[d] - rest[d];
  if (fields->body) flesh_fields_find(fields, record);
  nodes->count = tets->count = 0;
  for (int k = 0; k < (team ? 3 : 2); k++) nodes->arrays[nodes->count++] = of_nodes[k];
  for (int k = 0; k < (team ? 4 : 3); k++) tets->arrays[tets->count++] = of_tets[k];
  for (int k = 0; k < fields->nodes.count; k++) nodes->arrays[nodes->count++] = fields->nodes.arrays[k];
  for (int k = 0; k < fields->tets.count; k++) tets->arrays[tets->count++] = fields->tets.arrays[k];
  frame->content = (flesh_vtu){.points = points, .tets = flesh_mesh_tet_count(mesh), .positions = x,
                               .tet_nodes = flesh_mesh_tets(mesh), .edge_nodes = flesh_mesh_tet_edges(mesh),
                               .point_array_count = nodes->count, .cell_array_count = tets->count,
                               .point_arrays = nodes->arrays, .cell_arrays = tets->arrays};
}
