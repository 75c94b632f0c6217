/* rigid_guess.c: continues the velocities of free parts as rigid motions; parts that are far too large shrink. */
#include "time/rigid_guess.h"

#include <float.h>
#include <math.h>

#include "geometry/motion.h"
#include "math/mat3.h"
#include "math/svd3.h"
#include "mesh/pieces.h"

/* A part this many times as large as at rest, across and by its volume, is shrunk. Its potential goes with the sixth
 * power of its size, of which a Newton step takes off no more than a fifth; meanwhile tets become threads, whose
 * stiffness hides all other forces below round-off. Once small, its inertia spreads it again. */
static const double far_larger = 10;
static const double shrunk = 0.1; /* over the size at which the root mean square of J is 1 */

/* Finds the nodes of a part that count in sums: this rank's own, which come first. Returns their number. */
static int own_nodes(const flesh_rigid_parts *parts, int part, const int **nodes)
{
  int count = parts->first[part + 1] - parts->first[part];
  *nodes = parts->nodes + parts->first[part];
  while (count > 0 && (*nodes)[count - 1] >= parts->own) count--;
  return count;
}

/* Finds the centre of mass at x, and the mean velocity of velocities v (NULL: not asked for). *constrained: whether a
 * dof is constrained on any rank. */
static void find_means(const flesh_rigid_parts *parts, int part, const double *x, const double *v, int *constrained,
                       double centre[3], double mean[3])
{
  const int *nodes, count = own_nodes(parts, part, &nodes);
  double sums[8] = {[7] = *constrained}; /* sums of positions and velocities by mass; sum of masses */
  for (int k = 0; k < count; k++) {
    const double mass = parts->mass[nodes[k]];
    sums[6] += mass;
    for (int c = 0; c < 3; c++) sums[c] += mass * x[3 * nodes[k] + c];
    for (int c = 0; v && c < 3; c++) sums[3 + c] += mass * v[3 * nodes[k] + c];
  }
  flesh_team_sum(parts->team, 8, sums);
  for (int c = 0; c < 3; c++) centre[c] = sums[c] / sums[6];
  for (int c = 0; v && c < 3; c++) mean[c] = sums[3 + c] / sums[6];
  *constrained = sums[7] > 0;
}

/* Adds up the distances from the centre, and counts them. */
static void add_distances(const flesh_rigid_parts *parts, int part, const double *x, const double centre[3],
                          double sums[2])
{
  const int *nodes, count = own_nodes(parts, part, &nodes);
  sums[0] = 0;
  sums[1] = count;
  for (int k = 0; k < count; k++) {
    double d[3];
    for (int c = 0; c < 3; c++) d[c] = x[3 * nodes[k] + c] - centre[c];
    sums[0] += sqrt(flesh_vec3_dot(d, d));
  }
}

double flesh_rigid_parts_extent(const flesh_rigid_parts *parts, int part, const double *x, double centre[3])
{
  int constrained = 0;
  double sums[2];
  find_means(parts, part, x, NULL, &constrained, centre, NULL);
  add_distances(parts, part, x, centre, sums);
  flesh_team_sum(parts->team, 2, sums);
  return sums[0] / sums[1];
}

enum { MOMENTS = 12 };

/* Sums over a part that give its rotation over h. */
typedef struct motion {
  const flesh_state *state;
  double h, centre[3], mean[3]; /* position and velocity of the part's mean */
  double sums[MOMENTS + 2];     /* moments; distances from the centre */
} motion;

/* Finds the position and velocity of a node, relative to the part's mean. */
static void find_relative(const motion *m, int node, double d[3], double w[3])
{
  for (int c = 0; c < 3; c++) {
    d[c] = m->state->x[3 * node + c] - m->centre[c];
    w[c] = m->state->v[3 * node + c] - m->mean[c];
  }
}

/* Adds up the angular momentum and the inertia. */
static void add_spin(const flesh_rigid_parts *parts, int part, motion *m)
{
  const int *nodes, count = own_nodes(parts, part, &nodes);
  double *spin = m->sums, *inertia = m->sums + 3;
  for (int k = 0; k < count; k++) {
    const double mass = parts->mass[nodes[k]];
    double d[3], w[3], cross[3];
    find_relative(m, nodes[k], d, w);
    flesh_vec3_cross(d, w, cross);
    double square = flesh_vec3_dot(d, d);
    for (int r = 0; r < 3; r++) {
      spin[r] += mass * cross[r];
      for (int c = 0; c < 3; c++) inertia[3 * r + c] += mass * ((r == c ? square : 0) - d[r] * d[c]);
    }
  }
}

void flesh_rigid_rate(const double inertia[9], const double momentum[3], double rate[3])
{
  const double size = flesh_mat3_trace(inertia);
  double inverse[9];
  if (flesh_mat3_inverse(inertia, inverse) > 1e-9 * size * size * size) flesh_mat3_times(inverse, momentum, rate);
  else rate[0] = rate[1] = rate[2] = 0;
}

/* Finds the rotation by h times the mean angular velocity about the centre, the best fit of the velocities. */
static void turn_on(const motion *m, double turn[9])
{
  double rate[3];
  flesh_rigid_rate(m->sums + 3, m->sums, rate);
  flesh_keyframe key = {.rotation = {m->h * rate[0], m->h * rate[1], m->h * rate[2]}};
  flesh_motion rotation = {1, &key, {0}, 0};
  for (int c = 0; c < 3; c++) {
    double axis[3] = {c == 0, c == 1, c == 2}, turned[3];
    flesh_motion_apply(&rotation, 0, axis, turned);
    for (int r = 0; r < 3; r++) turn[3 * r + c] = turned[r];
  }
}

/* Adds up the moments of x + h v with x. */
static void add_fit(const flesh_rigid_parts *parts, int part, motion *m)
{
  const int *nodes, count = own_nodes(parts, part, &nodes);
  for (int k = 0; k < count; k++) {
    double d[3], w[3], to[3];
    find_relative(m, nodes[k], d, w);
    for (int c = 0; c < 3; c++) to[c] = d[c] + m->h * w[c];
    for (int e = 0; e < 9; e++) m->sums[e] += parts->mass[nodes[k]] * to[e / 3] * d[e % 3];
  }
}

/* Returns whether the moments of x + h v with x are symmetric but for rounding, as without rotation. */
static int is_symmetric(const double S[9])
{
  const double least = 16 * DBL_EPSILON * flesh_mat3_trace(S);
  return fabs(S[1] - S[3]) <= least && fabs(S[2] - S[6]) <= least && fabs(S[5] - S[7]) <= least;
}

/* Finds the rotation that leads nearest to x + h v (Kabsch 1976), to which the inertia of backward Euler draws a rigid
 * body. */
static void turn_nearest(const motion *m, double turn[9])
{
  double U[9], sigma[3], V[9];
  flesh_mat3_identity(turn);
  if (is_symmetric(m->sums)) return; /* rounding of U V^T would strain the body, step by step */
  flesh_svd3(m->sums, U, sigma, V);
  if (sigma[1] > 1e-9 * sigma[0]) flesh_mat3_multiply_transposed(U, V, turn); /* else points on a line stay on it */
}

/* Returns the factor by which a part of this extent shrinks about its centre; 1 if it is not far larger than at rest. */
static double find_shrinkage(const flesh_rigid_parts *parts, int part, const double *x, double extent)
{
  const double *X = flesh_mesh_positions(parts->mesh);
  double sums[2] = {0}; /* sums of squares of J, and of volumes at rest */
  if (!(extent > far_larger * parts->extent[part])) return 1;
  for (int t = 0; t < flesh_mesh_piece_count(parts->mesh); t++) {
    int node[4];
    flesh_mesh_piece(parts->mesh, t, node);
    const double rest = parts->part[node[0]] == part ? flesh_tet_volume(X, node) : 0, now = flesh_tet_volume(x, node);
    if (!(rest > 0)) continue; /* a piece between the nodes of a curved tet can be flat or inverted at rest */
    sums[0] += now * now / rest;
    sums[1] += rest;
  }
  flesh_team_sum(parts->team, 2, sums);
  return sums[0] > pow(far_larger, 6) * sums[1] ? shrunk * pow(sums[0] / sums[1], -1. / 6) : 1;
}

/* Predicts the motion of a part whose means are known. */
static void guess_part(const flesh_rigid_parts *parts, int part, motion *m, int nearest, double *u)
{
  const double *x = m->state->x;
  const int *nodes = parts->nodes + parts->first[part], count = parts->first[part + 1] - parts->first[part];
  double turn[9];
  (nearest ? add_fit : add_spin)(parts, part, m);
  add_distances(parts, part, x, m->centre, m->sums + MOMENTS);
  flesh_team_sum(parts->team, MOMENTS + 2, m->sums);
  const double shrinkage = find_shrinkage(parts, part, x, m->sums[MOMENTS] / m->sums[MOMENTS + 1]);
  (nearest ? turn_nearest : turn_on)(m, turn);
  for (int e = 0; e < 9; e++) turn[e] *= shrinkage;
  for (int k = 0; k < count; k++) {
    double d[3], to[3];
    for (int c = 0; c < 3; c++) d[c] = x[3 * nodes[k] + c] - m->centre[c];
    flesh_mat3_times(turn, d, to);
    for (int c = 0; c < 3; c++) u[3 * nodes[k] + c] = to[c] - d[c] + m->h * m->mean[c];
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
    motion m = {.state = state, .h = h};
    find_means(parts, p, state->x, state->v, &constrained, m.centre, m.mean);
    for (int k = 0; constrained && k < count; k++)
      for (int c = 0; c < 3; c++) u[3 * nodes[k] + c] = 0;
    if (constrained) continue;
    guess_part(parts, p, &m, nearest, u);
    guessed++;
  }
  return guessed;
}
