/* contact_seat.c: one-sided springs between a node and the plane of a face. */
#include "geometry/contact_seat.h"

#include <math.h>
#include <string.h>

#include "math/mat3.h"

/* A node relative to the plane of a face. */
typedef struct plane {
  double opening, n[3], l[3], g[3][3]; /* signed distance, normal, barycentric coordinates of the node and their gradients */
} plane;

static plane plane_at(const int nodes[4], const double *x)
{
  plane at;
  double e[2][3], to[3], N[3];
  const double *p = x + 3 * (size_t)nodes[0], *a = x + 3 * (size_t)nodes[1], *b = x + 3 * (size_t)nodes[2],
               *c = x + 3 * (size_t)nodes[3];
  for (int i = 0; i < 3; i++) e[0][i] = b[i] - a[i], e[1][i] = c[i] - a[i], to[i] = p[i] - a[i];
  flesh_vec3_cross(e[0], e[1], N);
  const double square = flesh_vec3_dot(N, N), length = sqrt(square);
  for (int i = 0; i < 3; i++) at.n[i] = N[i] / length;
  flesh_vec3_cross(e[1], N, at.g[1]);
  flesh_vec3_cross(N, e[0], at.g[2]);
  for (int i = 0; i < 3; i++) {
    at.g[1][i] /= square;
    at.g[2][i] /= square;
    at.g[0][i] = -at.g[1][i] - at.g[2][i];
  }
  at.opening = flesh_vec3_dot(at.n, to);
  at.l[1] = flesh_vec3_dot(at.g[1], to);
  at.l[2] = flesh_vec3_dot(at.g[2], to);
  at.l[0] = 1 - at.l[1] - at.l[2];
  return at;
}

double flesh_contact_seat_opening(const int nodes[4], const double *x) { return plane_at(nodes, x).opening; }

/* Returns how far [m] the node is below the seat's `least`; 0 if it is above. */
static double depth_of(const flesh_contact_seat *seat, const plane *at)
{
  return at->opening < seat->least ? seat->least - at->opening : 0;
}

/* Computes the gradient of the opening. */
static void slope_of(const plane *at, double slope[12])
{
  for (int a = 0; a < 4; a++)
    for (int i = 0; i < 3; i++) slope[3 * a + i] = (a ? -at->l[a - 1] : 1) * at->n[i];
}

double flesh_contact_seat_gradient(const flesh_contact_seat *seat, const double *x, double *gradient)
{
  const plane at = plane_at(seat->nodes, x);
  const double depth = depth_of(seat, &at);
  if (gradient) {
    slope_of(&at, gradient);
    for (int k = 0; k < 12; k++) gradient[k] *= -seat->stiffness * depth;
  }
  return seat->stiffness / 2 * depth * depth;
}

void flesh_contact_seat_hessian(const flesh_contact_seat *seat, const double *x, flesh_eigenvalue_filter filter,
                                double *H)
{
  const plane at = plane_at(seat->nodes, x);
  const double depth = depth_of(seat, &at), bend = filter == FLESH_FILTER_NONE ? seat->stiffness * depth : 0;
  double slope[12];
  memset(H, 0, 144 * sizeof *H);
  if (!(depth > 0)) return;
  slope_of(&at, slope);
  for (int k = 0; k < 144; k++) H[k] = seat->stiffness * slope[k / 12] * slope[k % 12];
  for (int a = 1; a < 4; a++)
    for (int b = 0; b < 4; b++) {
      const double share = b ? -at.l[b - 1] : 1, o = b ? at.opening * flesh_vec3_dot(at.g[a - 1], at.g[b - 1]) : 0;
      for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) { /* d2V = ... - stiffness depth d2o */
          const double across = bend * share * at.n[i] * at.g[a - 1][j];
          H[12 * (3 * a + i) + 3 * b + j] += across + bend * o * at.n[i] * at.n[j];
          H[12 * (3 * b + j) + 3 * a + i] += across;
        }
    }
}
