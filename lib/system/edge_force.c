/* edge_force.c: elastic forces on nodes that are displaced at random. */
#include "system/edge_force.h"

#include <math.h>
#include <string.h>

#include "mesh/inspect.h"
#include "system/one_effect.h"
#include "system/ranks.h"

/* Nodes are displaced by this part of an edge. */
static const double part = 1e-6;

/* Knuth's random numbers, for their sign, so many of them later: each is m times the one before, and c. Twice as many at a
 * time take m^2 and (m + 1) c (Brown 1994, "Random number generation with arbitrary strides"). */
static unsigned long long skip(unsigned long long random, unsigned long long numbers)
{
  unsigned long long m = 6364136223846793005ULL, c = 1442695040888963407ULL;
  for (; numbers; numbers /= 2) {
    if (numbers % 2) random = random * m + c;
    c *= m + 1;
    m *= m;
  }
  return random;
}

/* Every node `distance` away from X, in one of eight directions, that go by its number in the body. */
static void displace(const flesh_team *team, int own, const double *X, double distance, double *x)
{
  unsigned long long random = 1;
  for (int i = 0, next = 0; i < own; i++) {
    const int number = team ? team->numbers[i] : i;
    random = skip(random, 3 * (unsigned long long)(number - next));
    next = number + 1;
    for (int d = 3 * i; d < 3 * i + 3; d++) {
      random = skip(random, 1);
      x[d] = X[d] + distance * (random >> 63 ? 1 : -1);
    }
  }
  flesh_team_share(team, x);
}

flesh_edge_force flesh_system_edge_force(const flesh_system *system, double *work)
{
  const flesh_team *team = flesh_system_team(system);
  const flesh_mesh *mesh = flesh_system_mesh(system);
  const int n = flesh_system_unknowns(system), own = flesh_team_own(team, n / 3);
  const double *X = flesh_mesh_positions(mesh);
  double *x = work, *after = x + n, *before = after + n, *zeros = before + n, sums[3] = {0}, most = 0;
  flesh_edge_force force = {.edge = flesh_mesh_mean_edge(mesh, team), .stressed = 1};
  memset(zeros, 0, (size_t)n * sizeof *zeros);
  const unsigned elastic = FLESH_ROLE_BIT(FLESH_ROLE_ELASTICITY);
  flesh_point point = flesh_point_at(0, X, zeros, zeros);
  if (flesh_system_roles_residual(system, elastic, &point, before)) return force;
  displace(team, own, X, part * force.edge, x);
  point.x = x;
  if (flesh_system_roles_residual(system, elastic, &point, after)) return force;
  for (int i = 0; i < 3 * own; i += 3) {
    double square = 0;
    for (int d = i; d < i + 3; d++) {
      sums[0] += fabs(after[d] - before[d]);
      square += (after[d] - before[d]) * (after[d] - before[d]);
      most = fmax(most, fabs(before[d]));
    }
    if (square > 0) sums[1] += 1 / sqrt(square), sums[2]++;
  }
  flesh_team_sum(team, 3, sums);
  flesh_team_largest(team, 1, &most);
  force.mean = sums[0] / (3 * flesh_team_all(team, n / 3)) / part;
  force.softest = sums[2] > 0 ? sums[2] / sums[1] / part : 0;
  force.stressed = most > 1e-6 * force.mean;
  return force;
}
