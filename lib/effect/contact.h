/* contact.h: what a contact effect holds, and its operations. */
#ifndef FLESH_EFFECT_CONTACT_H
#define FLESH_EFFECT_CONTACT_H

#include "flesh/contact.h"
#include "geometry/contact_core.h"

typedef struct flesh_contact {
  flesh_obstacle *obstacle;
  double thickness, friction, slip_speed;
  int count;      /* nodes of tets */
  int *nodes;     /* [count] ascending */
  double *weight; /* [count] stiffness times the node's area, N */
  flesh_contact_core core;
} flesh_contact;

extern const flesh_effect_operations flesh_contact_operations;

double flesh_contact_clearance(const flesh_effect *effect, double t, const double *x);
double flesh_contact_approach(const flesh_effect *effect, double t_from, double t_to, const double low[3],
                              const double high[3]);
size_t flesh_contact_memory(const flesh_effect *effect);
void flesh_contact_destroy(void *data);

#endif
