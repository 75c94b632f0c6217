/* barrier.h: the barrier that grows without bound towards an obstacle, and its derivatives. */
#ifndef FLESH_GEOMETRY_BARRIER_H
#define FLESH_GEOMETRY_BARRIER_H

/* Sum of the barriers w B(d/w) of all parts of the obstacle nearer than w, with its derivatives by the position. */
typedef struct flesh_barrier {
  double value;       /* m */
  double gradient[3]; /* dimensionless; points into the obstacle */
  double hessian[9];  /* 1/m */
  double distance;    /* m, to the nearest part; INFINITY beyond w */
} flesh_barrier;

/* Evaluates B(s) = (1-s)^3/s and its derivatives for 0 < s < 1. */
static inline void flesh_barrier_law(double s, double *value, double *first, double *second)
{
  const double rest = 1 - s, part = rest / s;
  *value = rest * rest * part;
  *first = -part * rest * (3 + part);
  *second = part * (6 + 6 * part + 2 * part * part);
}

/* Returns the secant (B'(t) - B'(s))/(t - s), by which Newton's method goes from s to t; B''(s) if t equals s. Needs s,
 * t > 0; B is 0 beyond 1. */
double flesh_barrier_secant(double s, double t);

/* Position of a point relative to the core of an obstacle. The obstacle's surface is `radius` away from its core. */
typedef struct flesh_barrier_core {
  double distance, radius; /* m, distance to the core and radius of the obstacle around it */
  double direction[3];     /* unit vector from the core to the point */
  int flat;                /* dimension of the core near the point: 0 a point, 1 a line along `axis`, 2 a plane */
  double axis[3];          /* unit vector, set if `flat` is 1 */
} flesh_barrier_core;

/* Adds `weight` times the barrier at the distance to the obstacle's surface, core->distance - core->radius. */
void flesh_barrier_add(flesh_barrier *barrier, double w, double weight, const flesh_barrier_core *core);

#endif
