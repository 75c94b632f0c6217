/* body_figures.c: edges, box and shape of a body, computed from the ranks' parts. */
#include "parallel/body_figures.h"

#include <math.h>

#include "mesh/inspect.h"

double flesh_body_mean_edge(const flesh_mesh *mesh, const flesh_team *team)
{
  const double mean = flesh_mesh_mean_edge(mesh), tets = flesh_mesh_tet_count(mesh);
  double sums[2] = {tets * mean, tets};
  if (!team) return mean;
  flesh_team_sum(team, 2, sums);
  return sums[0] / sums[1];
}

void flesh_body_rest_box(const flesh_mesh *mesh, const flesh_team *team, double box[6])
{
  const double *X = flesh_mesh_positions(mesh);
  const uint8_t *used = flesh_mesh_node_used(mesh);
  for (int c = 0; c < 3; c++) box[c] = INFINITY, box[3 + c] = -INFINITY;
  for (int i = 0; i < flesh_mesh_node_count(mesh); i++)
    for (int c = 0; c < 3 && used[i]; c++) {
      box[c] = fmin(box[c], X[3 * (size_t)i + (size_t)c]);
      box[3 + c] = fmax(box[3 + c], X[3 * (size_t)i + (size_t)c]);
    }
  flesh_team_unite_boxes(team, box, box + 3);
}

double flesh_body_longest_side(const flesh_mesh *mesh, const flesh_team *team)
{
  double box[6], longest = 0;
  flesh_body_rest_box(mesh, team, box);
  for (int c = 0; c < 3; c++) longest = fmax(longest, box[3 + c] - box[c]);
  return longest;
}

double flesh_body_volume(const flesh_mesh *mesh, const flesh_team *team, const double *x)
{
  return flesh_team_total(team, flesh_mesh_volume(mesh, x));
}

double flesh_body_inverted(const flesh_mesh *mesh, const flesh_team *team, const double *x)
{
  int inverted;
  flesh_mesh_jacobian_bounds(mesh, x, NULL, NULL, &inverted);
  double counts[] = {inverted, flesh_mesh_tet_count(mesh)};
  flesh_team_sum(team, 2, counts);
  return counts[0] / counts[1];
}

void flesh_body_measure(const flesh_mesh *mesh, const flesh_team *team, const double *x, double *mean,
                        double *least, flesh_mesh_measures *measures)
{
  flesh_mesh_measure(mesh, x, 1, mean, least, measures);
  if (!team) return;
  double sums[2] = {measures->volume, measures->inverted}, most = -measures->J_min;
  flesh_team_sum(team, 2, sums);
  measures->volume = sums[0];
  measures->inverted = (int)sums[1];
  measures->J_min_tet = (int)-flesh_team_argmax(team, &most, -team->tets[measures->J_min_tet]);
  measures->J_min = -most;
  measures->J_bound = flesh_team_least(team, measures->J_bound);
}

int flesh_body_worst_tet(const flesh_mesh *mesh, const flesh_team *team, const double *x, double *J, double middle[3])
{
  int worst;
  *J = flesh_mesh_jacobians(mesh, x, NULL, &worst, NULL);
  flesh_mesh_centre(mesh, x, worst, middle);
  if (!team) return worst;
  double most = -*J;
  const int own = team->tets[worst], first = (int)-flesh_team_argmax(team, &most, -own);
  *J = -most;
  for (int c = 0; c < 3 && own != first; c++) middle[c] = 0;
  flesh_team_sum(team, 3, middle);
  return first;
}
