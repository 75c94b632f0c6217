/* rigid_guess.c: the rigid motions that the velocities continue. */
#include "integrator/rigid_guess.h"

#include <stdlib.h>

#include "base/error.h"
#include "effect/motion.h"
#include "math/mat3.h"

static int root_of(int *parent, int i)
{
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

int flesh_rigid_parts_create(const flesh_mesh *mesh, flesh_rigid_parts *parts)
{
  int nodes = flesh_mesh_node_count(mesh), tets = flesh_mesh_tet_count(mesh);
  const uint8_t *used = flesh_mesh_node_used(mesh);
  int *parent = malloc((size_t)nodes * sizeof *parent), *number = malloc((size_t)nodes * sizeof *number);
  *parts = (flesh_rigid_parts){.first = calloc((size_t)nodes + 2, sizeof(int)),
                               .nodes = malloc(((size_t)nodes + 1) * sizeof(int))};
  if (!parent || !number || !parts->first || !parts->nodes) {
    free(parent);
    free(number);
    flesh_rigid_parts_clear(parts);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the parts of %d nodes", nodes);
  }
  for (int i = 0; i < nodes; i++) parent[i] = i;
  for (int e = 0; e < tets; e++) {
    const int *tet = flesh_mesh_tets(mesh) + 4 * (size_t)e;
    for (int a = 1; a < 4; a++) parent[root_of(parent, tet[a])] = root_of(parent, tet[0]);
  }
  for (int i = 0; i < nodes; i++)
    if (used[i] && root_of(parent, i) == i) number[i] = parts->count++;
  for (int i = 0; i < nodes; i++)
    if (used[i]) parts->first[number[root_of(parent, i)] + 2]++;
  for (int k = 0; k < parts->count; k++) parts->first[k + 2] += parts->first[k + 1];
  for (int i = 0; i < nodes; i++)
    if (used[i]) parts->nodes[parts->first[number[root_of(parent, i)] + 1]++] = i;
  free(parent);
  free(number);
  return FLESH_OK;
}

void flesh_rigid_parts_clear(flesh_rigid_parts *parts)
{
  free(parts->first);
  free(parts->nodes);
  *parts = (flesh_rigid_parts){0};
}

static void guess_part(int count, const int *nodes, const flesh_state *state, double h, double *u)
{
  double centre[3] = {0}, mean[3] = {0}, spin[3] = {0}, inertia[9] = {0}, inverse[9], rate[3];
  for (int k = 0; k < count; k++)
    for (int c = 0; c < 3; c++) {
      centre[c] += state->x[3 * nodes[k] + c];
      mean[c] += state->v[3 * nodes[k] + c];
    }
  for (int c = 0; c < 3; c++) centre[c] /= count, mean[c] /= count;
  for (int k = 0; k < count; k++) {
    const int i = nodes[k];
    double d[3], w[3], cross[3];
    for (int c = 0; c < 3; c++) d[c] = state->x[3 * i + c] - centre[c], w[c] = state->v[3 * i + c] - mean[c];
    flesh_vec3_cross(d, w, cross);
    double square = flesh_vec3_dot(d, d);
    for (int r = 0; r < 3; r++) {
      spin[r] += cross[r];
      for (int c = 0; c < 3; c++) inertia[3 * r + c] += (r == c ? square : 0) - d[r] * d[c];
    }
  }
  double volume = flesh_mat3_inverse(inertia, inverse), size = flesh_mat3_trace(inertia);
  flesh_mat3_times(inverse, spin, rate);
  if (!(volume > 1e-9 * size * size * size)) rate[0] = rate[1] = rate[2] = 0;
  flesh_keyframe turn = {.rotation = {h * rate[0], h * rate[1], h * rate[2]},
                         .translation = {h * mean[0], h * mean[1], h * mean[2]}};
  flesh_motion motion = {1, &turn, {centre[0], centre[1], centre[2]}, 0};
  for (int k = 0; k < count; k++) {
    double y[3];
    flesh_motion_apply(&motion, 0, state->x + 3 * nodes[k], y);
    for (int c = 0; c < 3; c++) u[3 * nodes[k] + c] = y[c] - state->x[3 * nodes[k] + c];
  }
}

int flesh_rigid_guess(const flesh_rigid_parts *parts, const uint8_t *fixed, const flesh_state *state, double h,
                      double *u)
{
  int guessed = 0;
  for (int p = 0; p < parts->count; p++) {
    const int *nodes = parts->nodes + parts->first[p], count = parts->first[p + 1] - parts->first[p];
    int held = 0;
    for (int k = 0; fixed && k < count && !held; k++)
      held = fixed[3 * nodes[k]] || fixed[3 * nodes[k] + 1] || fixed[3 * nodes[k] + 2];
    for (int k = 0; held && k < count; k++)
      for (int c = 0; c < 3; c++) u[3 * nodes[k] + c] = 0;
    if (held) continue;
    guess_part(count, nodes, state, h, u);
    guessed++;
  }
  return guessed;
}
