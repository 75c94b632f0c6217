/* constraint.c: constrained dofs and their prescribed motion. */
#include <string.h>

#include "geometry/motion.h"
#include "system/parts.h"
#include "system/system.h"

int flesh_system_fixed(const flesh_system *system, double t, uint8_t *fixed)
{
  const uint8_t *used = flesh_mesh_node_used(system->mesh);
  int count = 0;
  for (int i = 0; i < system->nodes; i++)
    for (int c = 0; c < 3; c++) fixed[3 * i + c] = !used[i];
  for (int k = 0; k < system->constraint_count; k++) {
    const flesh_constraint *constraint = &system->constraints[k];
    if (t < constraint->from || t >= constraint->until) continue;
    for (int j = 0; j < constraint->count; j++)
      for (int c = 0; c < 3; c++)
        if (constraint->axes >> c & 1) fixed[3 * constraint->nodes[j] + c] = 1;
  }
  for (int d = 0; d < 3 * system->nodes; d++) count += fixed[d];
  return count;
}

void flesh_system_holders(const flesh_system *system, double t, int *holder)
{
  for (int d = 0; d < 3 * system->nodes; d++) holder[d] = 0;
  for (int k = 0; k < system->constraint_count; k++) {
    const flesh_constraint *held = &system->constraints[k];
    if (t < held->from || t >= held->until) continue;
    for (int j = 0; j < held->count; j++)
      for (int c = 0; c < 3; c++)
        if (held->axes >> c & 1) holder[3 * held->nodes[j] + c] = k + 1;
  }
}

int flesh_system_holds(const flesh_system *system, double t)
{
  int axes = 0;
  for (int k = 0; k < system->constraint_count; k++)
    if (t >= system->constraints[k].from && t < system->constraints[k].until) axes |= (int)system->constraints[k].axes;
  return axes;
}

static int motions_are_same(const flesh_motion *own, const flesh_motion *its)
{
  return own->count == its->count && own->smooth == its->smooth && !memcmp(own->centre, its->centre, sizeof own->centre) &&
         (!own->count || !memcmp(own->keyframes, its->keyframes, (size_t)own->count * sizeof *own->keyframes));
}

int flesh_system_prescribes_alike(const flesh_system *system, const flesh_system *other)
{
  const double *X = flesh_mesh_positions(system->mesh), *its_X = flesh_mesh_positions(other->mesh);
  int alike = system->constraint_count == other->constraint_count;
  for (int k = 0; k < system->constraint_count && alike; k++) {
    const flesh_constraint *own = &system->constraints[k], *its = &other->constraints[k];
    alike = own->count == its->count && own->axes == its->axes && own->from == its->from && own->until == its->until &&
            motions_are_same(&own->motion, &its->motion);
    for (int j = 0; j < own->count && alike; j++)
      alike = own->nodes[j] == its->nodes[j] && !memcmp(X + 3 * own->nodes[j], its_X + 3 * its->nodes[j], 3 * sizeof *X);
  }
  return alike;
}

/* Prescribes positions, or (x NULL) velocities and accelerations. */
static void prescribe(const flesh_system *system, double t, double *x, double *v, double *a)
{
  const double *X = flesh_mesh_positions(system->mesh);
  for (int k = 0; k < system->constraint_count; k++) {
    const flesh_constraint *constraint = &system->constraints[k];
    if (t < constraint->from || t >= constraint->until) continue;
    for (int j = 0; j < constraint->count; j++) {
      const size_t first = 3 * (size_t)constraint->nodes[j];
      double y[3] = {X[first], X[first + 1], X[first + 2]}, velocity[3] = {0}, acceleration[3] = {0};
      if (constraint->motion.count && x) flesh_motion_apply(&constraint->motion, t, X + first, y);
      else if (constraint->motion.count) flesh_motion_rates(&constraint->motion, t, X + first, velocity, acceleration);
      for (size_t c = 0; c < 3; c++) {
        if (!(constraint->axes >> c & 1)) continue;
        if (x) x[first + c] = y[c];
        else v[first + c] = velocity[c], a[first + c] = acceleration[c];
      }
    }
  }
}

void flesh_system_prescribe(const flesh_system *system, double t, double *x) { prescribe(system, t, x, NULL, NULL); }

void flesh_system_prescribe_velocity(const flesh_system *system, double t, double *v, double *a)
{
  prescribe(system, t, NULL, v, a);
}
