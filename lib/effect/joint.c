/* joint.c: balls and hinges: ties of points that two groups of nodes carry along.
 *
 * A group carries a point p of the rest shape by the weights of least squares, w_a = (1 + (p - c).S^-1 (X_a - c))/n with
 * the mean c and the second moment S of its nodes: sum of w_a = 1 and sum of w_a X_a = p, so that every affine motion of
 * the nodes moves p with them. In small motions p is where the group's best affine fit takes it. */
#include "flesh/effects.h"

#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "effect/ties.h"
#include "math/mat3.h"

/* Added to S, in parts of its trace, so that a plane or a line of nodes carries the points that it spans. */
static const double least_spread = 1e-13;
static const double carried = 1e-6; /* how well a point must be, in parts of the group's size */

typedef struct joint {
  flesh_ties ties; /* first: flesh_tied_ */
} joint;

static size_t joint_memory(const flesh_effect *effect)
{
  const joint *self = effect->data;
  return sizeof *self + flesh_ties_memory(&self->ties);
}

static void joint_destroy(void *data)
{
  joint *self = data;
  if (self) flesh_ties_clear(&self->ties);
  free(self);
}

static const flesh_effect_operations joint_operations = {
    .name = "joint",
    .traits = FLESH_IS_PASSIVE,
    .cells = flesh_tied_cells,
    .residual = flesh_tied_residual,
    .jacobian = flesh_tied_jacobian,
    .potential = flesh_tied_potential,
    .energy = flesh_tied_energy,
    .destroy = joint_destroy,
    .figures = &(const flesh_effect_figures){.memory = joint_memory},
};

/* The weights by which nodes carry p, times `sign`. */
static int carry(const double *X, int count, const int *nodes, const double p[3], double sign, double *weights)
{
  double c[3] = {0}, S[9] = {0}, inverse[9], d[3], slope[3], off[3] = {-p[0], -p[1], -p[2]};
  for (int a = 0; a < count; a++)
    for (int i = 0; i < 3; i++) c[i] += X[3 * (size_t)nodes[a] + (size_t)i] / count;
  for (int a = 0; a < count; a++)
    for (int k = 0; k < 9; k++) {
      const double *x = X + 3 * (size_t)nodes[a];
      S[k] += (x[k / 3] - c[k / 3]) * (x[k % 3] - c[k % 3]) / count;
    }
  const double size = sqrt(flesh_mat3_trace(S));
  for (int i = 0; i < 3; i++) S[4 * i] += size > 0 ? least_spread * size * size : 1;
  flesh_mat3_inverse(S, inverse);
  for (int i = 0; i < 3; i++) d[i] = p[i] - c[i];
  flesh_mat3_times(inverse, d, slope);
  for (int a = 0; a < count; a++) {
    const double *x = X + 3 * (size_t)nodes[a];
    double along = 0;
    for (int i = 0; i < 3; i++) along += slope[i] * (x[i] - c[i]);
    const double w = (1 + along) / count;
    for (int i = 0; i < 3; i++) off[i] += w * x[i];
    weights[a] = sign * w;
  }
  const double worst = fmax(fabs(off[0]), fmax(fabs(off[1]), fabs(off[2])));
  if (worst <= carried * size || worst == 0) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT,
                    "%d nodes of a joint do not carry (%g, %g, %g): they lie in a plane or a line that is %.3g m off",
                    count, p[0], p[1], p[2], worst);
}

static int check(const flesh_body *body, int first_count, const int *first, int second_count, const int *second,
                 const double point[3], const double axis[3], double stiffness)
{
  const int nodes = flesh_mesh_node_count(body->mesh);
  const double size = fabs(point[0]) + fabs(point[1]) + fabs(point[2]);
  if (first_count < 1 || second_count < 1 || first_count > FLESH_JOINT_NODES - second_count)
    return flesh_fail(FLESH_ERR_ARGUMENT, "a joint is given %d and %d nodes; each must have some, and both at most %d",
                      first_count, second_count, FLESH_JOINT_NODES);
  for (int k = 0; k < first_count + second_count; k++) {
    const int node = k < first_count ? first[k] : second[k - first_count];
    if (node < 0 || node >= nodes)
      return flesh_fail(FLESH_ERR_ARGUMENT, "a joint is given node %d; the mesh has the nodes 0 to %d", node, nodes - 1);
  }
  if (!(size < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "point is (%g, %g, %g); it must be finite", point[0], point[1], point[2]);
  const double length = axis ? sqrt(flesh_vec3_dot(axis, axis)) : 1;
  if (!(length > 0 && length < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "axis is (%g, %g, %g) m; it must be finite and not 0", axis[0], axis[1],
                      axis[2]);
  if (!(stiffness > 0 && stiffness < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "stiffness is %g N/m; it must be positive", stiffness);
  return FLESH_OK;
}

int flesh_effect_joint(const flesh_body *body, int first_count, const int *first, int second_count, const int *second,
                       const double point[3], const double axis[3], double stiffness, flesh_effect **effect)
{
  FLESH_NEED({effect, "effect"});
  *effect = NULL;
  FLESH_NEED({body, "body"}, {first, "first"}, {second, "second"}, {point, "point"});
  int status = check(body, first_count, first, second_count, second, point, axis, stiffness);
  if (status) return status;
  const size_t count = (size_t)first_count + (size_t)second_count;
  joint *self = calloc(1, sizeof *self);
  int *nodes = malloc(count * sizeof *nodes);
  double *weights = malloc(count * sizeof *weights);
  if (!self || !nodes || !weights)
    status = flesh_fail(FLESH_ERR_MEMORY, "no memory for a joint of %d nodes", (int)count);
  for (size_t k = 0; k < count && !status; k++)
    nodes[k] = k < (size_t)first_count ? first[k] : second[k - (size_t)first_count];
  for (int end = 0; end < (axis ? 2 : 1) && !status; end++) {
    double p[3];
    for (int i = 0; i < 3; i++) p[i] = point[i] + (axis ? (end - 0.5) * axis[i] : 0);
    status = carry(flesh_mesh_positions(body->mesh), first_count, nodes, p, 1, weights);
    if (!status)
      status = carry(flesh_mesh_positions(body->mesh), second_count, nodes + first_count, p, -1, weights + first_count);
    if (!status) flesh_ties_add(&self->ties, (int)count, nodes, weights, axis ? stiffness / 2 : stiffness);
  }
  if (!status) status = flesh_ties_finish(&self->ties);
  free(nodes);
  free(weights);
  if (status) {
    joint_destroy(self);
    return status;
  }
  return flesh_effect_create(&joint_operations, self, effect);
}
