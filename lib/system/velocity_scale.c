/* velocity_scale.c: the length of a body, and its velocity by the Rayleigh quotient of a bent shape. */
#include "system/velocity_scale.h"

#include <math.h>
#include <string.h>

#include "linear/block_matrix.h"
#include "parallel/body_figures.h"
#include "system/one_effect.h"
#include "system/ranks.h"

double flesh_system_length_scale(const flesh_system *system)
{
  return flesh_body_longest_side(flesh_system_mesh(system), flesh_system_team(system));
}

/* Returns u.A u, and A u; on a part of a body the part's share. */
static double square(const flesh_system *system, const flesh_block_matrix *A, const double *u, double *Au)
{
  flesh_block_multiply(A, u, Au);
  return flesh_system_product(system, u, Au);
}

/* s is along the longest side of the box and z along the shortest. */
void flesh_bent_shape(const double box[6], const double X[3], double u[3])
{
  double side[3], p[3];
  int s = 0, z = 2;
  for (int c = 0; c < 3; c++) side[c] = box[3 + c] - box[c], p[c] = X[c] - (box[c] + box[3 + c]) / 2;
  for (int c = 0; c < 3; c++)
    if (side[c] > side[s]) s = c;
  for (int c = 0; c < 3; c++)
    if (c != s && (z == s || side[c] < side[z])) z = c;
  const int y = 3 - s - z;
  u[s] = -2 * p[s] * p[z];
  u[y] = p[y] * p[z];
  u[z] = p[s] * p[s] + (p[z] * p[z] - p[y] * p[y]) / 2;
}

double flesh_system_velocity_scale(const flesh_system *system, flesh_block_matrix *K,
                                   double *const room[FLESH_VELOCITY_SCALE_ROOM], double *mass)
{
  const int n = flesh_system_unknowns(system);
  const double L = flesh_system_length_scale(system);
  const uint8_t *used = flesh_mesh_node_used(flesh_system_mesh(system));
  const double *X = flesh_mesh_positions(flesh_system_mesh(system));
  double *u = room[0], *Ku = room[1], *zero = room[2], *M_one = room[3], *one = room[4], stiffness = 0, load = 0, box[6];
  memset(zero, 0, (size_t)n * sizeof *zero);
  const flesh_point rest = flesh_point_at(0, X, zero, zero);
  *mass = 0;
  memset(u, 0, (size_t)n * sizeof *u);
  flesh_body_rest_box(flesh_system_mesh(system), flesh_system_team(system), box);
  for (int i = 0; i < n / 3; i++)
    if (used[i]) flesh_bent_shape(box, X + 3 * i, u + 3 * i);
  if (!flesh_system_jacobian(system, &rest, &(flesh_shift){.x = 1, .filter = 1}, K)) stiffness = square(system, K, u, Ku);
  if (flesh_system_jacobian(system, &rest, &(flesh_shift){.a = 1}, K)) return L;
  double bent = square(system, K, u, Ku), total = 0;
  for (int c = 0; c < 3; c++) { /* without the mean, which would be a rigid motion */
    for (int d = 0; d < n; d++) one[d] = d % 3 == c;
    *mass = total = square(system, K, one, M_one);
    const double along = flesh_system_product(system, u, M_one);
    if (total > 0) bent -= along * along / total;
  }
  if (stiffness > 0 && bent > 0 && stiffness / bent < INFINITY) return L * sqrt(stiffness / bent) / 6.283185307179586;
  const int is_loaded = !flesh_system_load(system, &rest, Ku);
  for (int c = 0; c < 3 && is_loaded; c++) {
    for (int d = 0; d < n; d++) one[d] = d % 3 == c;
    const double along = flesh_system_product(system, one, Ku);
    load += along * along;
  }
  return load > 0 && total > 0 ? sqrt(L * sqrt(load) / total) : L;
}
