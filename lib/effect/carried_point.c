/* carried_point.c: points that move with groups of nodes. */
#include "effect/carried_point.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "flesh/effects.h"
#include "math/eig3.h"
#include "math/mat3.h"

/* Eigenvalues of S below this fraction of its trace count as 0: the nodes lie in a plane or on a line, which can only
 * carry its own points. */
static const double least_spread = 1e-13;
static const double carried = 1e-6; /* largest error of a carried point, relative to the group's size */

static double share_of(const double *shares, int a) { return shares ? shares[a] : 1; }

int flesh_carried_weights(const flesh_mesh *mesh, int count, const int *nodes, const double *shares, const double p[3],
                          double sign, double *weights)
{
  const double *X = flesh_mesh_positions(mesh), *o = X + 3 * (size_t)nodes[0]; /* sums are relative to a node, to limit
                                                                                * rounding */
  double c[3] = {0}, S[9] = {0}, spread[3], axes[9], slope[3] = {0}, off[3] = {-p[0], -p[1], -p[2]};
  const double whole = shares ? 1 : count;
  for (int a = 0; a < count; a++)
    for (int i = 0; i < 3; i++) c[i] += share_of(shares, a) * (X[3 * (size_t)nodes[a] + (size_t)i] - o[i]) / whole;
  for (int a = 0; a < count; a++)
    for (int k = 0; k < 9; k++) {
      const double *x = X + 3 * (size_t)nodes[a];
      S[k] += share_of(shares, a) * (x[k / 3] - o[k / 3] - c[k / 3]) * (x[k % 3] - o[k % 3] - c[k % 3]) / whole;
    }
  const double size = sqrt(flesh_mat3_trace(S));
  flesh_eigh3(S, spread, axes);
  for (int refined = 0; refined < 3; refined++) { /* iterative refinement: the small eigenvalue of a flat group has few
                                                   * correct digits */
    double there[3], left[3];
    flesh_mat3_times(S, slope, there);
    for (int i = 0; i < 3; i++) left[i] = p[i] - o[i] - c[i] - there[i];
    for (int k = 0; k < 3; k++)
      for (int i = 0; i < 3 && spread[k] > least_spread * size * size; i++)
        slope[i] += axes[3 * i + k] * (axes[k] * left[0] + axes[3 + k] * left[1] + axes[6 + k] * left[2]) / spread[k];
  }
  for (int a = 0; a < count; a++) {
    const double *x = X + 3 * (size_t)nodes[a];
    double along = 0;
    for (int i = 0; i < 3; i++) along += slope[i] * (x[i] - o[i] - c[i]);
    const double w = share_of(shares, a) * (1 + along) / whole;
    for (int i = 0; i < 3; i++) off[i] += w * x[i];
    weights[a] = sign * w;
  }
  const double worst = fmax(fabs(off[0]), fmax(fabs(off[1]), fabs(off[2])));
  if (worst <= carried * size || worst == 0) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT,
                    "%d nodes cannot carry the point (%g, %g, %g): they lie in a plane or on a line %.3g m away from it; "
                    "choose nodes around it",
                    count, p[0], p[1], p[2], worst);
}

int flesh_carried_check_groups(const flesh_body *body, flesh_nodes first, flesh_nodes second)
{
  const int nodes = flesh_mesh_node_count(body->mesh);
  if (first.count < 1 || second.count < 1 || first.count > FLESH_JOINT_NODES - second.count)
    return flesh_fail(FLESH_ERR_ARGUMENT, "a joint is given %d and %d nodes; each must have some, and both at most %d",
                      first.count, second.count, FLESH_JOINT_NODES);
  for (int k = 0; k < first.count + second.count; k++) {
    const int node = k < first.count ? first.nodes[k] : second.nodes[k - first.count];
    if (node < 0 || node >= nodes)
      return flesh_fail(FLESH_ERR_ARGUMENT, "a joint is given node %d; the mesh has the nodes 0 to %d", node, nodes - 1);
  }
  return FLESH_OK;
}

int flesh_carried_check(const char *name, const double point[3], double stiffness)
{
  if (!(fabs(point[0]) + fabs(point[1]) + fabs(point[2]) < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "%s is (%g, %g, %g); it must be finite", name, point[0], point[1], point[2]);
  if (!(stiffness > 0 && stiffness < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "stiffness is %g N/m; it must be positive", stiffness);
  return FLESH_OK;
}

int flesh_carried_groups_copy(flesh_nodes first, flesh_nodes second, flesh_carried_groups *groups)
{
  const size_t count = (size_t)first.count + (size_t)second.count;
  *groups = (flesh_carried_groups){{first.count, second.count}, flesh_malloc((count + 1) * sizeof *groups->nodes)};
  if (!groups->nodes) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a joint of %d nodes", (int)count);
  memcpy(groups->nodes, first.nodes, (size_t)first.count * sizeof *first.nodes);
  memcpy(groups->nodes + first.count, second.nodes, (size_t)second.count * sizeof *second.nodes);
  return FLESH_OK;
}

size_t flesh_carried_groups_memory(const flesh_carried_groups *groups)
{
  return groups->nodes ? ((size_t)groups->count[0] + (size_t)groups->count[1]) * sizeof *groups->nodes : 0;
}

void flesh_carried_groups_bond(const flesh_carried_groups *groups, flesh_bond *bond)
{
  *bond = (flesh_bond){{groups->count[0], groups->count[1]}, {groups->nodes, groups->nodes + groups->count[0]}, 0, -1};
}
