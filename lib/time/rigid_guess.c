/* rigid_guess.c: the rigid motions that the velocities continue, of parts not far larger than at rest. */
#include "time/rigid_guess.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "effect/effect.h"
#include "geometry/motion.h"
#include "math/mat3.h"
#include "math/svd3.h"
#include "mesh/pieces.h"
#include "system/one_effect.h"
#include "system/ranks.h"

/* A part this many times as large as at rest, across and by its volume, shrinks. Its potential goes with the sixth power
 * of its size, of which a Newton step takes off no more than a fifth; meanwhile tets become threads, whose stiffness
 * hides all other forces below round-off. Small, it is spread again by its inertia. */
static const double far_larger = 10;
static const double shrunk = 0.1; /* of the size at which the root mean square of J is 1 */

/* Mass of every node, by the force that a unit acceleration takes; ones where there is no inertia. */
static int weigh(const flesh_system *system, double *mass)
{
  const flesh_mesh *mesh = flesh_system_mesh(system);
  const int nodes = flesh_mesh_node_count(mesh);
  double *a = calloc(3 * (size_t)nodes + 1, sizeof *a), *r = calloc(3 * (size_t)nodes + 1, sizeof *r);
  int status = a && r ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for the masses of %d nodes", nodes);
  for (int i = 0; i < nodes && !status; i++) a[3 * i] = mass[i] = 1;
  const flesh_point point = {.load = 1, .x = flesh_mesh_positions(mesh), .v = a, .a = a};
  const unsigned inertia = FLESH_ROLE_BIT(FLESH_ROLE_INERTIA);
  if (!status && flesh_system_has_role(system, FLESH_ROLE_INERTIA) &&
      !flesh_system_roles_residual(system, inertia, &point, r))
    for (int i = 0; i < nodes; i++) mass[i] = r[3 * i];
  free(a);
  free(r);
  return status;
}

static void find_centre(int count, const int *nodes, const double *mass, const double *x, double centre[3])
{
  double total = 0;
  centre[0] = centre[1] = centre[2] = 0;
  for (int k = 0; k < count; k++) {
    total += mass[nodes[k]];
    for (int c = 0; c < 3; c++) centre[c] += mass[nodes[k]] * x[3 * nodes[k] + c];
  }
  for (int c = 0; c < 3; c++) centre[c] /= total;
}

/* Mean distance from the centre, m, which few nodes far away hardly change. */
static double find_extent(int count, const int *nodes, const double *x, const double centre[3])
{
  double sum = 0;
  for (int k = 0; k < count; k++) {
    double d[3];
    for (int c = 0; c < 3; c++) d[c] = x[3 * nodes[k] + c] - centre[c];
    sum += sqrt(flesh_vec3_dot(d, d));
  }
  return sum / count;
}

int flesh_rigid_parts_create(const flesh_system *system, flesh_rigid_parts *parts)
{
  const flesh_mesh *mesh = flesh_system_mesh(system);
  int nodes = flesh_mesh_node_count(mesh), tets = flesh_mesh_tet_count(mesh);
  const uint8_t *used = flesh_mesh_node_used(mesh);
  *parts = (flesh_rigid_parts){0};
  if (flesh_system_team(system)) return FLESH_OK; /* which nodes are connected no rank knows */
  int *parent = malloc(((size_t)nodes + 1) * sizeof *parent), *number = malloc(((size_t)nodes + 1) * sizeof *number);
  *parts = (flesh_rigid_parts){.first = calloc((size_t)nodes + 2, sizeof(int)),
                               .nodes = malloc(((size_t)nodes + 1) * sizeof(int)),
                               .mass = malloc(((size_t)nodes + 1) * sizeof(double)),
                               .mesh = mesh,
                               .part = malloc(((size_t)nodes + 1) * sizeof(int)),
                               .extent = malloc(((size_t)nodes + 1) * sizeof(double))};
  if (!parent || !number || !parts->first || !parts->nodes || !parts->mass || !parts->part || !parts->extent) {
    free(parent);
    free(number);
    flesh_rigid_parts_clear(parts);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the parts of %d nodes", nodes);
  }
  for (int i = 0; i < nodes; i++) parent[i] = i;
  for (int e = 0; e < tets; e++) {
    int tet[10], size = flesh_mesh_tet_nodes(mesh, e, tet);
    for (int a = 1; a < size; a++) flesh_sets_join(parent, tet[0], tet[a]);
  }
  for (int i = 0; i < nodes; i++)
    if (used[i] && flesh_set_of(parent, i) == i) number[i] = parts->count++;
  for (int i = 0; i < nodes; i++)
    if (used[i]) parts->first[number[flesh_set_of(parent, i)] + 2]++;
  for (int k = 0; k < parts->count; k++) parts->first[k + 2] += parts->first[k + 1];
  for (int i = 0; i < nodes; i++)
    if (used[i]) {
      parts->part[i] = number[flesh_set_of(parent, i)];
      parts->nodes[parts->first[parts->part[i] + 1]++] = i;
    }
  free(parent);
  free(number);
  int status = weigh(system, parts->mass);
  for (int p = 0; p < parts->count && !status; p++) {
    const int *part = parts->nodes + parts->first[p], count = parts->first[p + 1] - parts->first[p];
    double centre[3];
    find_centre(count, part, parts->mass, flesh_mesh_positions(mesh), centre);
    parts->extent[p] = find_extent(count, part, flesh_mesh_positions(mesh), centre);
  }
  return status;
}

void flesh_rigid_parts_clear(flesh_rigid_parts *parts)
{
  free(parts->first);
  free(parts->nodes);
  free(parts->mass);
  free(parts->part);
  free(parts->extent);
  *parts = (flesh_rigid_parts){0};
}

/* The rotation by h times the mean angular velocity about the centre, as the velocities' best fit. */
static void turn_on(int count, const int *nodes, const double *mass, const flesh_state *state, const double centre[3],
                    const double mean[3], double h, double turn[9])
{
  double spin[3] = {0}, inertia[9] = {0}, inverse[9], rate[3];
  for (int k = 0; k < count; k++) {
    const int i = nodes[k];
    double d[3], w[3], cross[3];
    for (int c = 0; c < 3; c++) d[c] = state->x[3 * i + c] - centre[c], w[c] = state->v[3 * i + c] - mean[c];
    flesh_vec3_cross(d, w, cross);
    double square = flesh_vec3_dot(d, d);
    for (int r = 0; r < 3; r++) {
      spin[r] += mass[i] * cross[r];
      for (int c = 0; c < 3; c++) inertia[3 * r + c] += mass[i] * ((r == c ? square : 0) - d[r] * d[c]);
    }
  }
  double volume = flesh_mat3_inverse(inertia, inverse), size = flesh_mat3_trace(inertia);
  flesh_mat3_times(inverse, spin, rate);
  if (!(volume > 1e-9 * size * size * size)) rate[0] = rate[1] = rate[2] = 0;
  flesh_keyframe key = {.rotation = {h * rate[0], h * rate[1], h * rate[2]}};
  flesh_motion motion = {1, &key, {0}, 0};
  for (int c = 0; c < 3; c++) {
    double axis[3] = {c == 0, c == 1, c == 2}, turned[3];
    flesh_motion_apply(&motion, 0, axis, turned);
    for (int r = 0; r < 3; r++) turn[3 * r + c] = turned[r];
  }
}

/* The rotation that leads nearest to x + h v (Kabsch 1976): where the inertia of backward Euler draws a rigid body. */
static void turn_nearest(int count, const int *nodes, const double *mass, const flesh_state *state,
                         const double centre[3], const double mean[3], double h, double turn[9])
{
  double fit[9] = {0}, U[9], sigma[3], V[9];
  for (int k = 0; k < count; k++) {
    const int i = nodes[k];
    double d[3], to[3];
    for (int c = 0; c < 3; c++) {
      d[c] = state->x[3 * i + c] - centre[c];
      to[c] = d[c] + h * (state->v[3 * i + c] - mean[c]);
    }
    for (int e = 0; e < 9; e++) fit[e] += mass[i] * to[e / 3] * d[e % 3];
  }
  flesh_svd3(fit, U, sigma, V);
  if (sigma[1] > 1e-9 * sigma[0]) flesh_mat3_multiply_transposed(U, V, turn);
  else flesh_mat3_identity(turn); /* points on a line are to stay on it */
}

/* The factor by which a part shrinks about its centre; 1 where it is not far larger than at rest. */
static double find_shrinkage(const flesh_rigid_parts *parts, int part, const double *x, const double centre[3])
{
  const int *nodes = parts->nodes + parts->first[part], count = parts->first[part + 1] - parts->first[part];
  const double *X = flesh_mesh_positions(parts->mesh);
  double squares = 0, volume = 0;
  if (!(find_extent(count, nodes, x, centre) > far_larger * parts->extent[part])) return 1;
  for (int t = 0; t < flesh_mesh_piece_count(parts->mesh); t++) {
    int node[4];
    flesh_mesh_piece(parts->mesh, t, node);
    const double rest = parts->part[node[0]] == part ? flesh_tet_volume(X, node) : 0, now = flesh_tet_volume(x, node);
    if (!(rest > 0)) continue; /* between the nodes of a curved tet a piece can be flat or inverted at rest */
    squares += now * now / rest;
    volume += rest;
  }
  return squares > pow(far_larger, 6) * volume ? shrunk * pow(squares / volume, -1. / 6) : 1;
}

static void guess_part(const flesh_rigid_parts *parts, int part, const flesh_state *state, double h, int nearest,
                       double *u)
{
  const int *nodes = parts->nodes + parts->first[part], count = parts->first[part + 1] - parts->first[part];
  const double *mass = parts->mass;
  double centre[3], mean[3], turn[9];
  find_centre(count, nodes, mass, state->x, centre);
  find_centre(count, nodes, mass, state->v, mean);
  const double shrinkage = find_shrinkage(parts, part, state->x, centre);
  (nearest ? turn_nearest : turn_on)(count, nodes, mass, state, centre, mean, h, turn);
  for (int e = 0; e < 9; e++) turn[e] *= shrinkage;
  for (int k = 0; k < count; k++) {
    double d[3], to[3];
    for (int c = 0; c < 3; c++) d[c] = state->x[3 * nodes[k] + c] - centre[c];
    flesh_mat3_times(turn, d, to);
    for (int c = 0; c < 3; c++) u[3 * nodes[k] + c] = to[c] - d[c] + h * mean[c];
  }
}

int flesh_rigid_guess(const flesh_rigid_parts *parts, const uint8_t *fixed, const flesh_state *state, double h,
                      int nearest, double *u)
{
  int guessed = 0;
  for (int p = 0; p < parts->count; p++) {
    const int *nodes = parts->nodes + parts->first[p], count = parts->first[p + 1] - parts->first[p];
    int constrained = 0;
    for (int k = 0; fixed && k < count && !constrained; k++)
      constrained = fixed[3 * nodes[k]] || fixed[3 * nodes[k] + 1] || fixed[3 * nodes[k] + 2];
    for (int k = 0; constrained && k < count; k++)
      for (int c = 0; c < 3; c++) u[3 * nodes[k] + c] = 0;
    if (constrained) continue;
    guess_part(parts, p, state, h, nearest, u);
    guessed++;
  }
  return guessed;
}
