/* inspect.c: counts, sizes and quality of a mesh. */
#include "mesh/inspect.h"
#include "base/sort.h"
#include "math/mat3.h"
#include "mesh/bernstein.h"

#include <math.h>
#include <stdlib.h>

/* Radius ratio with inradius r = 3V/(sum of areas) and circumradius R = |a^2 (b x c) + b^2 (c x a) + c^2 (a x b)|/(12
 * V) for edges a, b, c from one node. */
double flesh_radius_ratio(const double *x, const int n[4])
{
  double e[3][3], bc[3], ca[3], ab[3], fourth[3], centre[3];
  for (int i = 0; i < 3; i++)
    for (int d = 0; d < 3; d++)
      e[i][d] = x[3 * (size_t)n[i + 1] + d] - x[3 * (size_t)n[0] + d];
  flesh_vec3_cross(e[1], e[2], bc);
  flesh_vec3_cross(e[2], e[0], ca);
  flesh_vec3_cross(e[0], e[1], ab);
  double aa = flesh_vec3_dot(e[0], e[0]), bb = flesh_vec3_dot(e[1], e[1]), cc = flesh_vec3_dot(e[2], e[2]);
  for (int d = 0; d < 3; d++) {
    fourth[d] = bc[d] + ca[d] + ab[d];
    centre[d] = aa * bc[d] + bb * ca[d] + cc * ab[d];
  }
  double areas = (sqrt(flesh_vec3_dot(bc, bc)) + sqrt(flesh_vec3_dot(ca, ca)) + sqrt(flesh_vec3_dot(ab, ab)) +
                  sqrt(flesh_vec3_dot(fourth, fourth))) /
                 2;
  const double volume = flesh_tet_volume(x, n);
  return 108 * volume * (fabs(volume) / areas) / sqrt(flesh_vec3_dot(centre, centre));
}

double flesh_mesh_radius_ratio(const flesh_mesh *mesh, int tet)
{
  return flesh_radius_ratio(mesh->positions, mesh->tet_nodes + 4 * (size_t)tet);
}

/* Returns the smallest over the largest Jacobian of a tet's map, to 1e-4; 1 for straight edges. */
static double scaled_jacobian(const flesh_mesh *mesh, int tet)
{
  double one[FLESH_CUBIC], minus[FLESH_CUBIC];
  if (!mesh->curved[tet]) return 1;
  const double *C = mesh->jacobians + FLESH_CUBIC * (size_t)tet;
  for (int a = 0; a < FLESH_CUBIC; a++) one[a] = 1, minus[a] = -C[a];
  return flesh_cubic_least(C, one, 1e-4).low / -flesh_cubic_least(minus, one, 1e-4).low;
}

int flesh_mesh_region_list(const flesh_mesh *mesh, int **list)
{
  int *tags = malloc((size_t)mesh->tets * sizeof *tags), count = 0;
  *list = tags;
  if (!tags) return 0;
  /* Most meshes have long runs of one tag: dropping repeats first makes the sort short. */
  for (int t = 0; t < mesh->tets; t++)
    if (!count || mesh->regions[t] != tags[count - 1]) tags[count++] = mesh->regions[t];
  qsort(tags, (size_t)count, sizeof *tags, flesh_compare_int);
  int distinct = 0;
  for (int i = 0; i < count; i++)
    if (!distinct || tags[i] != tags[distinct - 1]) tags[distinct++] = tags[i];
  return distinct;
}

/* Returns the number of distinct region tags: from the list, or without memory for it by searching for each tag in
 * turn. */
static int region_count(const flesh_mesh *mesh)
{
  int *tags, count = flesh_mesh_region_list(mesh, &tags), listed = tags != NULL, last = 0;
  free(tags);
  if (listed) return count;
  for (;; count++) {
    int found = 0, next = 0;
    for (int t = 0; t < mesh->tets; t++)
      if ((!count || mesh->regions[t] > last) && (!found || mesh->regions[t] < next))
        found = 1, next = mesh->regions[t];
    if (!found) return count;
    last = next;
  }
}

static double edge_length(const flesh_mesh *mesh, int node, int other)
{
  const double *from = mesh->positions + 3 * (size_t)node;
  const double *to = mesh->positions + 3 * (size_t)other;
  const double along[3] = {from[0] - to[0], from[1] - to[1], from[2] - to[2]};
  return sqrt(flesh_vec3_dot(along, along));
}

void flesh_mesh_centre(const flesh_mesh *mesh, const double *x, int tet, double centre[3])
{
  for (int c = 0; c < 3; c++) {
    centre[c] = 0;
    for (int a = 0; a < 4; a++) centre[c] += x[3 * (size_t)mesh->tet_nodes[4 * (size_t)tet + (size_t)a] + (size_t)c] / 4;
  }
}

double flesh_mesh_mean_edge(const flesh_mesh *mesh)
{
  double edges = 0;
  for (int t = 0; t < mesh->tets; t++) {
    const int *n = mesh->tet_nodes + 4 * (size_t)t;
    for (int i = 0; i < 4; i++)
      for (int j = i + 1; j < 4; j++) edges += edge_length(mesh, n[i], n[j]);
  }
  return edges / (6.0 * mesh->tets);
}

void flesh_mesh_inspect(const flesh_mesh *mesh, flesh_mesh_info *info)
{
  *info = (flesh_mesh_info){.nodes = mesh->nodes,
                            .tets = mesh->tets,
                            .triangles = mesh->triangles,
                            .flipped = mesh->flipped,
                            .unused_nodes = mesh->unused_nodes,
                            .edge_min = INFINITY,
                            .radius_ratio_min = INFINITY,
                            .order = flesh_mesh_order(mesh),
                            .quadratic = mesh->edge_nodes ? mesh->tets - mesh->linear : 0,
                            .scaled_jacobian_min = 1};
  info->regions = region_count(mesh);
  info->volume = flesh_mesh_volume(mesh, mesh->positions);
  for (int d = 0; d < 3; d++) info->low[d] = INFINITY, info->high[d] = -INFINITY;
  for (int n = 0; n < mesh->nodes; n++)
    for (int d = 0; d < 3 && mesh->node_used[n]; d++) {
      info->low[d] = fmin(info->low[d], mesh->positions[3 * (size_t)n + d]);
      info->high[d] = fmax(info->high[d], mesh->positions[3 * (size_t)n + d]);
    }
  double ratios = 0;
  for (int t = 0; t < mesh->tets; t++) {
    const int *n = mesh->tet_nodes + 4 * (size_t)t;
    for (int i = 0; i < 4; i++)
      for (int j = i + 1; j < 4; j++) {
        double edge = edge_length(mesh, n[i], n[j]);
        info->edge_min = fmin(info->edge_min, edge);
        info->edge_max = fmax(info->edge_max, edge);
      }
    double ratio = flesh_mesh_radius_ratio(mesh, t);
    ratios += ratio;
    if (ratio < info->radius_ratio_min) info->radius_ratio_min = ratio, info->worst_tet = t;
    double scaled = scaled_jacobian(mesh, t);
    if (scaled < info->scaled_jacobian_min) info->scaled_jacobian_min = scaled, info->most_bent_tet = t;
    info->curved += mesh->curved[t];
  }
  info->edge_mean = flesh_mesh_mean_edge(mesh);
  info->radius_ratio_mean = ratios / mesh->tets;
}
