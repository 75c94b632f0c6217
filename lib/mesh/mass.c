/* mass.c: lumped and consistent mass of linear tets. */
#include "mesh/mesh.h"

#include <string.h>

void flesh_mesh_lumped_mass(const flesh_mesh *mesh, const double *density, double *mass)
{
  memset(mass, 0, (size_t)mesh->nodes * sizeof *mass);
  for (int t = 0; t < mesh->tets; t++)
    for (int i = 0; i < 4; i++)
      mass[mesh->tet_nodes[4 * (size_t)t + i]] += density[t] * mesh->volumes[t] / 4;
}

void flesh_mesh_consistent_mass_times(const flesh_mesh *mesh, const double *density,
                                      const double *x, double *y)
{
  memset(y, 0, 3 * (size_t)mesh->nodes * sizeof *y);
  for (int t = 0; t < mesh->tets; t++) {
    const int *n = mesh->tet_nodes + 4 * (size_t)t;
    double m = density[t] * mesh->volumes[t] / 20;
    for (int d = 0; d < 3; d++) {
      double sum = 0;
      for (int i = 0; i < 4; i++) sum += x[3 * (size_t)n[i] + d];
      for (int i = 0; i < 4; i++) y[3 * (size_t)n[i] + d] += m * (sum + x[3 * (size_t)n[i] + d]);
    }
  }
}
