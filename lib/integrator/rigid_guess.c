/* rigid_guess.c: the rigid motion that the velocities continue. */
#include "integrator/rigid_guess.h"

#include "effect/motion.h"
#include "math/mat3.h"

void flesh_rigid_guess(const flesh_mesh *mesh, const flesh_state *state, double h, double *u)
{
  const uint8_t *used = flesh_mesh_node_used(mesh);
  double centre[3] = {0}, mean[3] = {0}, spin[3] = {0}, inertia[9] = {0}, inverse[9], rate[3];
  int nodes = flesh_mesh_node_count(mesh), count = 0;
  for (int i = 0; i < nodes; i++) {
    if (!used[i]) continue;
    count++;
    for (int c = 0; c < 3; c++) centre[c] += state->x[3 * i + c], mean[c] += state->v[3 * i + c];
  }
  for (int c = 0; c < 3; c++) centre[c] /= count, mean[c] /= count;
  for (int i = 0; i < nodes; i++) {
    double d[3], w[3], cross[3];
    if (!used[i]) continue;
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
  for (int i = 0; i < nodes; i++) {
    double y[3];
    flesh_motion_apply(&motion, 0, state->x + 3 * i, y);
    for (int c = 0; c < 3; c++) u[3 * i + c] = y[c] - state->x[3 * i + c];
  }
}
