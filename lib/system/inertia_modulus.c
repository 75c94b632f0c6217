/* inertia_modulus.c: mass over volume, and the radius of a ball like the body. */
#include "system/inertia_modulus.h"

#include <math.h>

#include "system/one_effect.h"

/* Mass over rest volume, kg/m^3; 0 without inertia. */
static double density_of(const flesh_system *system, double *a, double *r)
{
  const double *X = flesh_mesh_positions(flesh_system_mesh(system));
  const flesh_point point = {.load = 1, .x = X, .v = a, .a = a};
  double mass = 0;
  for (int d = 0; d < flesh_system_unknowns(system); d++) a[d] = d % 3 == 0;
  if (flesh_system_roles_residual(system, FLESH_ROLE_BIT(FLESH_ROLE_INERTIA), &point, r)) return 0;
  for (int d = 0; d < flesh_system_unknowns(system); d += 3) mass += r[d];
  return mass / flesh_mesh_volume(flesh_system_mesh(system), X);
}

/* The radius of a ball with the body's ratio of volume and surface, m. */
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

double flesh_system_inertia_modulus(const flesh_system *system, double *a, double *r)
{
  const double radius = radius_of(flesh_system_mesh(system));
  return density_of(system, a, r) * radius * radius / (M_PI * M_PI);
}
