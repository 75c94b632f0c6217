/* rigid_guess.c: the rigid motions that the velocities continue, of parts not far larger than at rest. */
#include "time/rigid_guess.h"

#include <math.h>

#include "geometry/motion.h"
#include "math/mat3.h"
#include "math/svd3.h"
#include "mesh/pieces.h"

/* A part this many times as large as at rest, across and by its volume, shrinks. Its potential goes with the sixth power
 * of its size, of which a Newton step takes off no more than a fifth; meanwhile tets become threads, whose stiffness
 * hides all other forces below round-off. Small, it is spread again by its inertia. */
static const double far_larger = 10;
static const double shrunk = 0.1; /* of the size at which the root mean square of J is 1 */

/* The nodes of a part that count in sums: this rank's own, which come first. Returns how many. */
static int own_nodes(const flesh_rigid_parts *parts, int part, const int **nodes)
{
  int count = parts->first[part + 1] - parts->first[part];
  *nodes = parts->nodes + parts->first[part];
  while (count > 0 && (*nodes)[count - 1] >= parts->own) count--;
  return count;
}

static void find_centre(const flesh_rigid_parts *parts, int part, const double *x, double centre[3])
{
  const int *nodes, count = own_nodes(parts, part, &nodes);
  double sums[4] = {0}; /* of places by mass, of masses */
  for (int k = 0; k < count; k++) {
    sums[3] += parts->mass[nodes[k]];
    for (int c = 0; c < 3; c++) sums[c] += parts->mass[nodes[k]] * x[3 * nodes[k] + c];
  }
  flesh_team_sum(parts->team, 4, sums);
  for (int c = 0; c < 3; c++) centre[c] = sums[c] / sums[3];
}

double flesh_rigid_parts_extent(const flesh_rigid_parts *parts, int part, const double *x, double centre[3])
{
  const int *nodes, count = own_nodes(parts, part, &nodes);
  double sums[2] = {0, count};
  find_centre(parts, part, x, centre);
  for (int k = 0; k < count; k++) {
    double d[3];
    for (int c = 0; c < 3; c++) d[c] = x[3 * nodes[k] + c] - centre[c];
    sums[0] += sqrt(flesh_vec3_dot(d, d));
  }
  flesh_team_sum(parts->team, 2, sums);
  return sums[0] / sums[1];
}

/* The rotation by h times the mean angular velocity about the centre, as the velocities' best fit. */
static void turn_on(const flesh_rigid_parts *parts, int part, const flesh_state *state, const double centre[3],
                    const double mean[3], double h, double turn[9])
{
  const double *mass = parts->mass;
  const int *nodes, count = own_nodes(parts, part, &nodes);
  double sums[12] = {0}, *spin = sums, *inertia = sums + 3, inverse[9], rate[3];
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
  flesh_team_sum(parts->team, 12, sums);
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
static void turn_nearest(const flesh_rigid_parts *parts, int part, const flesh_state *state, const double centre[3],
                         const double mean[3], double h, double turn[9])
{
  const double *mass = parts->mass;
  const int *nodes, count = own_nodes(parts, part, &nodes);
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
  flesh_team_sum(parts->team, 9, fit);
  flesh_svd3(fit, U, sigma, V);
  if (sigma[1] > 1e-9 * sigma[0]) flesh_mat3_multiply_transposed(U, V, turn);
  else flesh_mat3_identity(turn); /* points on a line are to stay on it */
}

/* The factor by which a part of this extent shrinks about its centre; 1 where it is not far larger than at rest. */
static double find_shrinkage(const flesh_rigid_parts *parts, int part, const double *x, double extent)
{
  const double *X = flesh_mesh_positions(parts->mesh);
  double sums[2] = {0}; /* of squares of J, and volumes at rest */
  if (!(extent > far_larger * parts->extent[part])) return 1;
  for (int t = 0; t < flesh_mesh_piece_count(parts->mesh); t++) {
    int node[4];
    flesh_mesh_piece(parts->mesh, t, node);
    const double rest = parts->part[node[0]] == part ? flesh_tet_volume(X, node) : 0, now = flesh_tet_volume(x, node);
    if (!(rest > 0)) continue; /* between the nodes of a curved tet a piece can be flat or inverted at rest */
    sums[0] += now * now / rest;
    sums[1] += rest;
  }
  flesh_team_sum(parts->team, 2, sums);
  return sums[0] > pow(far_larger, 6) * sums[1] ? shrunk * pow(sums[0] / sums[1], -1. / 6) : 1;
}

static void guess_part(const flesh_rigid_parts *parts, int part, const flesh_state *state, double h, int nearest,
                       double *u)
{
  const int *nodes = parts->nodes + parts->first[part], count = parts->first[part + 1] - parts->first[part];
  double centre[3], mean[3], turn[9];
  const double extent = flesh_rigid_parts_extent(parts, part, state->x, centre);
  find_centre(parts, part, state->v, mean);
  const double shrinkage = find_shrinkage(parts, part, state->x, extent);
  (nearest ? turn_nearest : turn_on)(parts, part, state, centre, mean, h, turn);
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
    constrained = flesh_team_any(parts->team, constrained);
    for (int k = 0; constrained && k < count; k++)
      for (int c = 0; c < 3; c++) u[3 * nodes[k] + c] = 0;
    if (constrained) continue;
    guess_part(parts, p, state, h, nearest, u);
    guessed++;
  }
  return guessed;
}
