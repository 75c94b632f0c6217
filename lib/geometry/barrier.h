/* barrier.h: the barrier that grows without bound towards an obstacle, and its derivatives. */
#ifndef FLESH_GEOMETRY_BARRIER_H
#define FLESH_GEOMETRY_BARRIER_H

/* w B(d/w), summed over what of the obstacle is nearer than w. */
typedef struct flesh_barrier {
  double value;       /* m */
  double gradient[3]; /* 1; it points into the obstacle */
  double hessian[9];  /* 1/m */
  double distance;    /* m, of the nearest; INFINITY beyond w */
} flesh_barrier;

/* B(s) = (1-s)^3/s for 0 < s < 1, and its derivatives. */
static inline void flesh_barrier_law(double s, double *value, double *first, double *second)
{
  const double rest = 1 - s, part = rest / s;
  *value = rest * rest * part;
  *first = -part * rest * (3 + part);
  *second = part * (6 + 6 * part + 2 * part * part);
}

/* (B'(t) - B'(s))/(t - s): the stiffness that takes s to t; B''(s) where t is s. 0 < s, t; B is 0 beyond 1. */
double flesh_barrier_secant(double s, double t);

/* How a point lies to the core of an obstacle, which reaches `radius` beyond its core. */
typedef struct flesh_barrier_core {
  double distance, radius; /* m, to the core; of the obstacle around it */
  double direction[3];     /* from the core to the point */
  int flat;                /* dimension of the core there: 0 a point, 1 a line along `axis`, 2 a plane */
  double axis[3];          /* a unit vector where `flat` is 1 */
} flesh_barrier_core;

/* Adds `weight` times the barrier at the distance to the core, less the radius. */
void flesh_barrier_add(flesh_barrier *barrier, double w, double weight, const flesh_barrier_core *core);

#endif
