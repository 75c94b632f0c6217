/* momenta.c: keeps the momenta of free parts in steps that errors choose.
 *
 * An error of momentum leads a free part astray for as long as it moves. But momenta are known: in a step of h they
 * change by h sum_i b_i F_i, b_i being the weights of the method's stages, and F_i the forces of all but elasticity there,
 * or their moments about the centre of mass; in free flight that is gravity's force and no moment. A rigid motion is added
 * to the velocities at the step's end which gives the part these momenta. It keeps the method's order (projection: Hairer,
 * Lubich & Wanner 2006, IV.4), and vibrations do not feel it.
 *
 * Parts that welds or joints tie to each other count as one. Those with a constrained dof or in contact are left alone,
 * and so are steps that a tape differentiates. */
#include "time/momenta.h"

#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "math/mat3.h"
#include "system/one_effect.h"

/* Places of a part's sums: of masses; of positions by mass, then the centre; of forces or momenta, and of their moments
 * about the centre; of x x by mass (11, 12, 13, 22, 23, 33); of the sizes of forces; of those of contact in the step's stages. */
enum { MASS, CENTRE, FORCE = CENTRE + 3, MOMENT = FORCE + 3, SQUARES = MOMENT + 3, SIZES = SQUARES + 6, PUSHES, SUMS };
enum { KEPT = 7 }; /* numbers of a part in at_end */

int flesh_momenta_create(const flesh_part_weights *weights, const flesh_system *system, double *room, flesh_momenta *momenta)
{
  const size_t count = (size_t)weights->count;
  *momenta = (flesh_momenta){.weights = weights, .system = system, .room = room,
                             .sums = malloc(count * SUMS * sizeof *momenta->sums),
                             .at_end = malloc(KEPT * count * sizeof *momenta->at_end)};
  if (momenta->sums && momenta->at_end) return FLESH_OK;
  return flesh_fail(FLESH_ERR_MEMORY, "no memory for the momenta of %zu parts of a body", count);
}

void flesh_momenta_clear(flesh_momenta *momenta)
{
  free(momenta->sums);
  free(momenta->at_end);
  *momenta = (flesh_momenta){0};
}

/* Returns whether the part is free, and the first of those that are tied to each other. */
static int is_free(const flesh_momenta *momenta, int part)
{
  return momenta->weights->tied[part] == part && momenta->weights->of[part].loose > 0;
}

static int any_is_free(const flesh_momenta *momenta)
{
  int any = 0;
  for (int p = 0; p < momenta->weights->count; p++) any |= is_free(momenta, p);
  return any;
}

/* Returns the first of the parts that a node's part is tied to, mostly that part; -1: the node has none. */
static int first_part_of(const flesh_momenta *momenta, int node)
{
  const int part = flesh_part_of(momenta->weights, node);
  return part < 0 ? part : momenta->weights->tied[part];
}

/* Finds the sums of each part at x [3*nodes] for the forces, or momenta, in `room`. */
static void find_sums(flesh_momenta *momenta, const double *x)
{
  const double *f = momenta->room;
  const flesh_part_weights *weights = momenta->weights;
  const flesh_rigid_parts *parts = weights->parts;
  for (int k = 0; k < SUMS * weights->count; k++) momenta->sums[k] = 0;
  for (int p = 0; p < weights->count; p++) momenta->sums[SUMS * weights->tied[p] + PUSHES] += weights->of[p].push[3];
  for (int i = 0; i < parts->own; i++) {
    const int part = first_part_of(momenta, i);
    if (part < 0) continue;
    double *sums = momenta->sums + SUMS * part, moment[3];
    flesh_vec3_cross(x + 3 * i, f + 3 * i, moment);
    sums[MASS] += parts->mass[i];
    sums[SIZES] += sqrt(flesh_vec3_dot(f + 3 * i, f + 3 * i));
    for (int c = 0, k = SQUARES; c < 3; c++) {
      sums[CENTRE + c] += parts->mass[i] * x[3 * i + c];
      sums[FORCE + c] += f[3 * i + c];
      sums[MOMENT + c] += moment[c];
      for (int b = c; b < 3; b++) sums[k++] += parts->mass[i] * x[3 * i + c] * x[3 * i + b];
    }
  }
  flesh_team_sum(parts->team, SUMS * weights->count, momenta->sums);
  for (int p = 0; p < weights->count; p++) {
    double *sums = momenta->sums + SUMS * p, moment[3];
    for (int c = 0; c < 3; c++) sums[CENTRE + c] /= sums[MASS];
    flesh_vec3_cross(sums + CENTRE, sums + FORCE, moment);
    for (int c = 0; c < 3; c++) sums[MOMENT + c] -= moment[c];
  }
}

/* Finds the sums for the momenta at the point's velocities. */
static int find_momenta(flesh_momenta *momenta, const flesh_point *point)
{
  flesh_point moving = *point;
  moving.a = point->v;
  const int status =
      flesh_system_roles_residual(momenta->system, FLESH_ROLE_BIT(FLESH_ROLE_INERTIA), &moving, momenta->room);
  if (!status) find_sums(momenta, point->x);
  return status;
}

/* Finds the sums for the forces of some roles at the point. Residuals are forces with the other sign. */
static int find_forces(flesh_momenta *momenta, unsigned roles, const flesh_point *point)
{
  const int status = flesh_system_roles_residual(momenta->system, roles, point, momenta->room);
  if (!status) find_sums(momenta, point->x);
  return status;
}

/* Lets the forces at the point, but for those of contact, act for the time `weight`, s. */
static int add_forces(flesh_momenta *momenta, const flesh_point *point, double weight)
{
  static const unsigned others = FLESH_ROLE_BIT(FLESH_ROLE_INERTIA) | FLESH_ROLE_BIT(FLESH_ROLE_ELASTICITY) |
                                 FLESH_ROLE_BIT(FLESH_ROLE_CONTACT);
  const int status = find_forces(momenta, ~others, point);
  for (int p = 0; p < momenta->weights->count && !status; p++)
    for (int c = 0; c < 6; c++) momenta->at_end[KEPT * p + c] -= weight * momenta->sums[SUMS * p + FORCE + c];
  return status;
}

/* Finds the momenta at the step's start, and whether something touches there. */
static int begin(flesh_momenta *momenta, const flesh_point *start)
{
  int status = find_momenta(momenta, start);
  for (int p = 0; p < momenta->weights->count && !status; p++)
    for (int c = 0; c < 6; c++) momenta->at_end[KEPT * p + c] = momenta->sums[SUMS * p + FORCE + c];
  if (!status) status = find_forces(momenta, FLESH_ROLE_BIT(FLESH_ROLE_CONTACT), start);
  for (int p = 0; p < momenta->weights->count && !status; p++)
    momenta->at_end[KEPT * p + 6] = momenta->sums[SUMS * p + SIZES];
  return status;
}

/* Finds the angular velocity of a part with that angular momentum. */
static void find_rate(const double *sums, const double momentum[3], double rate[3])
{
  const double *q = sums + SQUARES, *c = sums + CENTRE, m = sums[MASS];
  const double xx = q[0] - m * c[0] * c[0], xy = q[1] - m * c[0] * c[1], xz = q[2] - m * c[0] * c[2];
  const double yy = q[3] - m * c[1] * c[1], yz = q[4] - m * c[1] * c[2], zz = q[5] - m * c[2] * c[2];
  flesh_rigid_rate((double[]){yy + zz, -xy, -xz, -xy, xx + zz, -yz, -xz, -yz, xx + yy}, momentum, rate);
}

/* Adds the velocities that free parts lack at the point to v [3*nodes]. */
static int add_velocities(flesh_momenta *momenta, const flesh_point *point, double *v)
{
  const int status = find_momenta(momenta, point);
  if (status) return status;
  for (int p = 0; p < momenta->weights->count; p++) {
    double *sums = momenta->sums + SUMS * p, *lacks = momenta->at_end + KEPT * p;
    const int kept = is_free(momenta, p) && !(sums[PUSHES] + lacks[6] > 0);
    for (int c = 0; c < 6; c++) lacks[c] = kept ? lacks[c] - sums[FORCE + c] : 0;
    for (int c = 0; c < 3; c++) sums[FORCE + c] = lacks[c] / sums[MASS];
    find_rate(sums, lacks + 3, sums + MOMENT);
  }
  for (int i = 0; i < flesh_system_unknowns(momenta->system) / 3; i++) {
    const int part = first_part_of(momenta, i);
    if (part < 0) continue;
    const double *sums = momenta->sums + SUMS * part;
    double d[3], turned[3];
    for (int c = 0; c < 3; c++) d[c] = point->x[3 * i + c] - sums[CENTRE + c];
    flesh_vec3_cross(sums + MOMENT, d, turned);
    for (int c = 0; c < 3; c++) v[3 * i + c] += sums[FORCE + c] + turned[c];
  }
  return FLESH_OK;
}

int flesh_momenta_keep(flesh_momenta *momenta, const flesh_method_row *row, const flesh_method_memory *memory,
                       const flesh_point *start, const flesh_point *stage, double h)
{
  int status = FLESH_OK;
  if (!any_is_free(momenta)) return FLESH_OK;
  if (memory->at == 0) status = begin(momenta, start);
  if (!status && memory->at == 0) status = add_forces(momenta, start, h * row->weight(memory, 0));
  if (!status) status = add_forces(momenta, stage, h * row->weight(memory, memory->at + 1));
  return status || memory->at + 1 < row->stages(memory) ? status : add_velocities(momenta, stage, memory->v0);
}
