/* inertia_modulus.c: mass over volume, and the radius of a ball like the body. */
#include "system/inertia_modulus.h"

#include <math.h>
#include <string.h>

#include "math/area.h"
#include "math/mat3.h"
#include "parallel/body_figures.h"
#include "system/one_effect.h"
#include "system/ranks.h"

/* Returns mass over rest volume, kg/m^3; 0 without inertia. */
static double density_of(const flesh_system *system, double *a, double *r)
{
  const double *X = flesh_mesh_positions(flesh_system_mesh(system));
  const flesh_point point = flesh_point_at(0, X, a, a);
  for (int d = 0; d < flesh_system_unknowns(system); d++) a[d] = d % 3 == 0;
  if (flesh_system_roles_residual(system, FLESH_ROLE_BIT(FLESH_ROLE_INERTIA), &point, r)) return 0;
  return flesh_system_product(system, a, r) / flesh_body_volume(flesh_system_mesh(system), flesh_system_team(system), X);
}

/* Returns the radius of a ball with the body's ratio of volume to surface, m. */
static double radius_of(const flesh_mesh *mesh)
{
  int count;
  const int *triangle = flesh_mesh_surface(mesh, &count);
  const double *X = flesh_mesh_positions(mesh);
  double area = 0;
  for (int k = 0; k < count; k++) {
    const double *corner[3];
    double n[3], *edge[2] = {(double[3]){0}, (double[3]){0}};
    for (int a = 0; a < 3; a++) corner[a] = X + 3 * (size_t)triangle[3 * k + a];
    for (int c = 0; c < 3; c++)
      for (int e = 0; e < 2; e++) edge[e][c] = corner[e + 1][c] - corner[0][c];
    for (int c = 0; c < 3; c++)
      n[c] = edge[0][(c + 1) % 3] * edge[1][(c + 2) % 3] - edge[0][(c + 2) % 3] * edge[1][(c + 1) % 3];
    area += sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) / 2;
  }
  return 3 * flesh_mesh_volume(mesh, X) / area;
}

/* Returns this radius for a body that ranks share: faces between ranks cancel in the area vectors of the nodes. */
static double radius_of_team(const flesh_team *team, const flesh_mesh *mesh, double *a)
{
  int count;
  const int *triangle = flesh_mesh_surface(mesh, &count);
  const double *X = flesh_mesh_positions(mesh);
  double area = 0;
  memset(a, 0, 3 * (size_t)flesh_mesh_node_count(mesh) * sizeof *a);
  for (int k = 0; k < count; k++) {
    double n[3];
    flesh_area_vector_at(X, triangle + 3 * (size_t)k, n);
    for (int d = 0; d < 9; d++) a[3 * (size_t)triangle[3 * k + d / 3] + (size_t)(d % 3)] += n[d % 3] / 6;
  }
  flesh_team_add_ghosts(team, a);
  for (size_t d = 0; d < 3 * (size_t)team->own; d += 3) area += sqrt(flesh_vec3_dot(a + d, a + d));
  return 3 * flesh_body_volume(mesh, team, X) / flesh_team_total(team, area);
}

double flesh_system_inertia_modulus(const flesh_system *system, double *a, double *r)
{
  const flesh_team *team = flesh_system_team(system);
  const flesh_mesh *mesh = flesh_system_mesh(system);
  const double radius = team ? radius_of_team(team, mesh, a) : radius_of(mesh);
  return density_of(system, a, r) * radius * radius / (M_PI * M_PI);
}
