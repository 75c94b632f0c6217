/* joint.c: ball joints and hinges: ties between points carried by two groups of nodes (carried_point.h). */
#include "element/body.h"
#include "flesh/effects.h"

#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/carried_point.h"
#include "effect/effect.h"
#include "effect/ties.h"
#include "math/mat3.h"

typedef struct joint {
  flesh_ties ties; /* must come first, for the flesh_tied_ functions */
  flesh_carried_groups groups; /* empty on a rank's part */
} joint;

static size_t joint_memory(const flesh_effect *effect)
{
  const joint *self = effect->data;
  return sizeof *self + flesh_ties_memory(&self->ties) + flesh_carried_groups_memory(&self->groups);
}

static void joint_destroy(void *data)
{
  joint *self = data;
  if (self) {
    flesh_ties_clear(&self->ties);
    flesh_free(self->groups.nodes);
  }
  free(self);
}

static int joint_restrict(const flesh_effect *whole, const flesh_rank_part *part, const flesh_body *body,
                          flesh_effect **restricted)
{
  const joint *from = whole->data;
  joint *self = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a joint");
  const int status = flesh_ties_restrict(&from->ties, part, 0, &self->ties);
  return flesh_effect_create_after(status, whole->operations, body->mesh, self, restricted);
}

static const flesh_cells *cells_of_ranks(const flesh_effect *whole, int *everywhere)
{
  (void)everywhere;
  return flesh_tied_cells(whole);
}

static int count_bonds(const flesh_effect *effect) { return ((const joint *)effect->data)->groups.nodes != NULL; }

static void get_bond(const flesh_effect *effect, int k, flesh_bond *bond)
{
  (void)k;
  flesh_carried_groups_bond(&((const joint *)effect->data)->groups, bond);
}

static const flesh_effect_operations joint_operations = {
    .name = "joint",
    FLESH_TIED_OPERATIONS,
    .destroy = joint_destroy,
    .figures = &(const flesh_effect_figures){.memory = joint_memory},
    .library = &(const flesh_effect_private){
        .ranks = &(const flesh_effect_ranks){.restrict_to_part = joint_restrict, .cells = cells_of_ranks},
        .bonds = &(const flesh_effect_bonds){.count = count_bonds, .get = get_bond}},
};

static int check(const double point[3], const double axis[3], double stiffness)
{
  const double length = axis ? sqrt(flesh_vec3_dot(axis, axis)) : 1;
  int status = flesh_carried_check("point", point, stiffness);
  if (!status && !(length > 0 && length < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "axis is (%g, %g, %g) m; it must be finite and not 0", axis[0], axis[1],
                      axis[2]);
  return status;
}

int flesh_effect_joint(const flesh_body *body, flesh_nodes first, flesh_nodes second, const double point[3],
                       const double axis[3], double stiffness, flesh_effect **effect)
{
  FLESH_NEED_BODY({body, "body"}, {first.nodes, "first"}, {second.nodes, "second"}, {point, "point"});
  int status = flesh_carried_check_groups(body, first, second);
  if (!status) status = check(point, axis, stiffness);
  if (status) return status;
  const size_t count = (size_t)first.count + (size_t)second.count;
  joint *self = calloc(1, sizeof *self);
  int *nodes = malloc(count * sizeof *nodes);
  double *weights = malloc(count * sizeof *weights);
  if (!self || !nodes || !weights)
    status = flesh_fail(FLESH_ERR_MEMORY, "no memory for a joint of %d nodes", (int)count);
  for (size_t k = 0; k < count && !status; k++)
    nodes[k] = k < (size_t)first.count ? first.nodes[k] : second.nodes[k - (size_t)first.count];
  for (int end = 0; end < (axis ? 2 : 1) && !status; end++) {
    double p[3];
    for (int i = 0; i < 3; i++) p[i] = point[i] + (axis ? (end - 0.5) * axis[i] : 0);
    status = flesh_carried_weights(body->mesh, first.count, nodes, NULL, p, 1, weights);
    if (!status)
      status = flesh_carried_weights(body->mesh, second.count, nodes + first.count, NULL, p, -1,
                                     weights + first.count);
    if (!status) flesh_ties_add(&self->ties, (int)count, nodes, weights, axis ? stiffness / 2 : stiffness);
  }
  if (!status) status = flesh_ties_finish(&self->ties);
  if (!status) status = flesh_carried_groups_copy(first, second, &self->groups);
  free(nodes);
  free(weights);
  return flesh_effect_create_after(status, &joint_operations, body->mesh, self, effect);
}
