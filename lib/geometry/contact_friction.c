/* contact_friction.c: Coulomb friction between pairs of features, with normal forces and geometry of a lagged state. */
#include "geometry/contact_friction.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "math/mat3.h"

void flesh_contact_friction_clear(flesh_contact_friction *friction)
{
  flesh_free(friction->pairs);
  *friction = (flesh_contact_friction){.coefficient = friction->coefficient, .slip_speed = friction->slip_speed};
}

static int make_room(flesh_contact_friction *friction, int pairs)
{
  if (pairs <= friction->capacity) return FLESH_OK;
  const int capacity = pairs + pairs / 2;
  flesh_free(friction->pairs);
  friction->pairs = flesh_malloc((size_t)capacity * sizeof *friction->pairs);
  friction->capacity = friction->pairs ? capacity : 0;
  if (friction->pairs) return FLESH_OK;
  return flesh_fail(FLESH_ERR_MEMORY, "no memory for the friction of %d pairs", pairs);
}

/* Completes the tangents to two directions orthogonal to the normal. */
static void find_directions(const flesh_contact_closest *at, double t[2][3])
{
  memcpy(t, at->tangent, sizeof at->tangent);
  if (at->dimension == 0) flesh_vec3_perpendicular(at->normal, t[0]);
  if (at->dimension < 2) flesh_vec3_cross(at->normal, t[0], t[1]);
}

/* Subtracts the velocities that a rotation of the pair gives the gap along the tangents: d w . (n x t_i). Two of its
 * edges, with lengths l, directions u and velocities of their ends that differ by g, rotate at the rate w for which the
 * sum of |w x u - g/l|^2 is least: M w is the sum of u x g/l, M that of I - u u^T. */
static void subtract_turn(const flesh_contact_pair *pair, const flesh_contact_closest *at, const double *x,
                          double t[2][3], double slip[2][12])
{
  static const int edges[2][2][2] = {{{1, 2}, {1, 3}}, {{0, 1}, {2, 3}}}; /* of a triangle, or the two that are near */
  const int(*ends)[2] = edges[pair->owner < 0];
  double u[2][3], length[2], M[9] = {2, 0, 0, 0, 2, 0, 0, 0, 2}, inverse[9], axis[3], turn[3], arm[3];
  for (int e = 0; e < 2; e++) {
    const double *from = x + 3 * (size_t)pair->nodes[ends[e][0]], *to = x + 3 * (size_t)pair->nodes[ends[e][1]];
    for (int c = 0; c < 3; c++) u[e][c] = to[c] - from[c];
    length[e] = sqrt(flesh_vec3_dot(u[e], u[e]));
    for (int c = 0; c < 3; c++) u[e][c] /= length[e];
    for (int k = 0; k < 9; k++) M[k] -= u[e][k / 3] * u[e][k % 3];
  }
  if (!(flesh_mat3_inverse(M, inverse) > 1e-12)) return; /* parallel edges */
  for (int i = 0; i < 2; i++) {
    flesh_vec3_cross(at->normal, t[i], axis);
    flesh_mat3_times(inverse, axis, turn);
    for (int e = 0; e < 2; e++) {
      flesh_vec3_cross(turn, u[e], arm);
      for (int c = 0; c < 3; c++) {
        slip[i][3 * ends[e][0] + c] += at->distance * arm[c] / length[e];
        slip[i][3 * ends[e][1] + c] -= at->distance * arm[c] / length[e];
      }
    }
  }
}

void flesh_contact_slip_find(const flesh_contact_pair *pair, const flesh_contact_closest *at, const double *x,
                             flesh_friction_pair *found)
{
  double t[2][3];
  find_directions(at, t);
  memcpy(found->nodes, pair->nodes, sizeof found->nodes);
  memset(found->slip, 0, sizeof found->slip);
  for (int i = 0; i < 2; i++)
    for (int a = 0; a < at->count; a++)
      for (int c = 0; c < 3; c++) found->slip[i][3 * at->corner[a] + c] = at->share[a] * t[i][c];
  subtract_turn(pair, at, x, t, found->slip);
}

int flesh_contact_friction_update(flesh_contact_friction *friction, const flesh_contact_set *set, const double *x)
{
  friction->count = 0;
  int status = make_room(friction, set->count);
  if (status) return status;
  for (int k = 0, next; k < set->count; k = next) {
    const int owner = set->pairs[k].owner, first = friction->count;
    double sum = 0, positive = 0;
    for (next = k; next < set->count && (next == k || (owner >= 0 && set->pairs[next].owner == owner)); next++) {
      flesh_contact_closest at;
      const double force = flesh_contact_pair_force(set->pairs + next, x, &at);
      sum += force;
      if (!(force > 0)) continue;
      positive += force;
      flesh_friction_pair *found = friction->pairs + friction->count++;
      found->force = force;
      found->expected = (flesh_slip_expected){0};
      flesh_contact_slip_find(set->pairs + next, &at, x, found);
    }
    const double part = sum > 0 ? friction->coefficient * (sum / positive) : 0;
    for (int i = first; i < friction->count; i++) friction->pairs[i].force *= part;
    if (part == 0 || !flesh_contact_set_owns(set, set->pairs + k)) friction->count = first;
  }
  return FLESH_OK;
}

/* Applies a pair's slip operator to a field [3*n]. */
static void slip_of(const flesh_friction_pair *pair, const double *field, double u[2])
{
  u[0] = u[1] = 0;
  for (int a = 0; a < 4; a++)
    for (int c = 0; c < 3; c++)
      for (int i = 0; i < 2; i++) u[i] += pair->slip[i][3 * a + c] * field[3 * (size_t)pair->nodes[a] + c];
}

static double potential_of(const flesh_friction_pair *pair, const flesh_contact_motion *at, const double u[2],
                           double speed, double e)
{
  if (at->shift_v != 0) return pair->force * flesh_slip_potential(speed, e) / at->shift_v;
  if (at->shift_x == 0) return 0;
  double from[2], to[2];
  slip_of(pair, at->x_lag, from);
  slip_of(pair, at->x, to);
  return pair->force * flesh_slip_ratio(speed, e) * (u[0] * (to[0] - from[0]) + u[1] * (to[1] - from[1])) / at->shift_x;
}

void flesh_contact_friction_evaluate(const flesh_contact_friction *friction, const flesh_contact_motion *at, double *phi,
                                     double *size, double *r)
{
  const double e = friction->slip_speed;
  for (int k = 0; k < friction->count; k++) {
    const flesh_friction_pair *pair = friction->pairs + k;
    double u[2];
    slip_of(pair, at->v, u);
    const double speed = hypot(u[0], u[1]), ratio = pair->force * flesh_slip_ratio(speed, e);
    if (phi || size) {
      const double share = potential_of(pair, at, u, speed, e);
      if (phi) *phi += share;
      if (size) *size += fabs(share);
    }
    for (int a = 0; r && a < 4; a++)
      for (int c = 0; c < 3; c++)
        r[3 * (size_t)pair->nodes[a] + c] +=
            ratio * (u[0] * pair->slip[0][3 * a + c] + u[1] * pair->slip[1][3 * a + c]);
  }
}

void flesh_contact_friction_hessians(flesh_contact_friction *friction, const double *v, double scale, int matrix,
                                     double *hessians)
{
  const double e = friction->slip_speed;
  for (int k = 0; k < friction->count; k++) {
    flesh_friction_pair *pair = friction->pairs + k;
    double u[3] = {0}, stiffness[9], B[2][2], *H = hessians + 144 * (size_t)k;
    slip_of(pair, v, u);
    flesh_slip_stiffness(&pair->expected, matrix, u, NULL, e, stiffness);
    for (int i = 0; i < 2; i++)
      for (int j = 0; j < 2; j++) B[i][j] = scale * pair->force * stiffness[3 * i + j];
    memset(H, 0, 144 * sizeof *H);
    for (int p = 0; p < 12; p++)
      for (int q = 0; q < 12; q++)
        for (int i = 0; i < 2; i++)
          H[12 * p + q] += pair->slip[i][p] * (B[i][0] * pair->slip[0][q] + B[i][1] * pair->slip[1][q]);
  }
}
