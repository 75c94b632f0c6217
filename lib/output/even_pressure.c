/* even_pressure.c: pressures of tet10-mean as a continuous field, without the checkerboards of one number per tet.
 *
 * Steps of Landweber (1951) towards the least squares of (p - mean of q at the corners)^2 over the body, with q
 * continuous and linear, beginning with means over the tets around a node. They recover slopes up to the surface and
 * leave out most of a checkerboard, as such fields contain almost none of it. */
#include "output/even_pressure.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/team.h"
#include "mesh/mesh.h"

enum { STEPS = 9 };

static int material_of(const flesh_tet_stress *stress, int tet)
{
  const int m = stress->body->tet_material ? stress->body->tet_material[tet] : 0;
  return stress->shares && flesh_mesh_is_quadratic(stress->body->mesh, tet) && stress->shares[m].share > 0 ? m : -1;
}

/* Leaves out nodes whose tets, on any rank, differ: their number times the sum of squares is above the square of the
 * sum. */
static int leave_out(const flesh_tet_stress *stress, flesh_even_pressure *even)
{
  const flesh_mesh *mesh = even->body->mesh;
  const int nodes = flesh_mesh_node_count(mesh);
  double *sums = calloc(3 * (size_t)nodes + 1, sizeof *sums);
  for (int e = 0; sums && e < flesh_mesh_tet_count(mesh); e++)
    for (int a = 0, m = material_of(stress, e); a < 4; a++) {
      double *s = sums + 3 * (size_t)flesh_mesh_tets(mesh)[4 * (size_t)e + (size_t)a];
      s[0] += 1, s[1] += m, s[2] += (double)m * m;
    }
  const int status = flesh_team_agree(even->team, sums ? FLESH_OK : FLESH_ERR_MEMORY);
  if (!status) flesh_team_sum_nodes(even->team, 3, sums);
  if (!status) flesh_team_sum_nodes(even->team, 1, even->volume);
  for (int i = 0; i < nodes && !status; i++) {
    const double *s = sums + 3 * (size_t)i;
    if (s[0] * s[2] != s[1] * s[1] || s[1] < 0) even->volume[i] = 0;
  }
  free(sums);
  return status;
}

int flesh_even_pressure_open(const flesh_tet_stress *stress, const struct flesh_team *team, flesh_even_pressure *even)
{
  const flesh_mesh *mesh = stress->body->mesh;
  const size_t nodes = (size_t)flesh_mesh_node_count(mesh), tets = (size_t)flesh_mesh_tet_count(mesh);
  *even = (flesh_even_pressure){.body = stress->body, .team = team, .p = calloc(tets + 3 * nodes + 1, sizeof *even->p)};
  int status = even->p ? FLESH_OK : FLESH_ERR_MEMORY;
  if (!status) even->q = even->p + tets, even->volume = even->q + nodes, even->change = even->volume + nodes;
  for (size_t k = 0; k < 4 * tets && !status; k++)
    even->volume[flesh_mesh_tets(mesh)[k]] += flesh_mesh_tet_volumes(mesh)[k / 4];
  status = flesh_team_agree(team, status);
  if (!status) status = leave_out(stress, even);
  return status ? flesh_fail(FLESH_ERR_MEMORY, "no memory for pressures of %zu nodes", nodes) : FLESH_OK;
}

void flesh_even_pressure_clear(flesh_even_pressure *even)
{
  free(even->p);
  *even = (flesh_even_pressure){0};
}

/* Returns the mean of the field over a tet; a node that is left out has the tet's own value. */
static double mean_of(const flesh_even_pressure *even, int tet)
{
  double sum = 0;
  for (int a = 0; a < 4; a++) {
    const int node = flesh_mesh_tets(even->body->mesh)[4 * (size_t)tet + (size_t)a];
    sum += even->volume[node] > 0 ? even->q[node] : even->p[tet];
  }
  return sum / 4;
}

void flesh_even_pressure_find(flesh_even_pressure *even)
{
  const flesh_mesh *mesh = even->body->mesh;
  const int nodes = flesh_mesh_node_count(mesh), tets = flesh_mesh_tet_count(mesh);
  memset(even->q, 0, (size_t)nodes * sizeof *even->q);
  for (int step = 0; step < STEPS; step++) {
    memset(even->change, 0, (size_t)nodes * sizeof *even->change);
    for (int e = 0; e < tets; e++) {
      const double lacks = flesh_mesh_tet_volumes(mesh)[e] * (even->p[e] - (step ? mean_of(even, e) : 0));
      for (int a = 0; a < 4 && isfinite(lacks); a++)
        even->change[flesh_mesh_tets(mesh)[4 * (size_t)e + (size_t)a]] += lacks;
    }
    flesh_team_sum_nodes(even->team, 1, even->change);
    for (int i = 0; i < nodes; i++) even->q[i] = even->volume[i] > 0 ? even->q[i] + even->change[i] / even->volume[i] : NAN;
  }
  for (int e = 0; e < tets; e++)
    if (isfinite(even->p[e])) even->p[e] = mean_of(even, e);
}
