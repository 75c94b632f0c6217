/* contact.h: the data of a contact effect with an obstacle, and its operations. */
#ifndef FLESH_EFFECT_CONTACT_H
#define FLESH_EFFECT_CONTACT_H

#include "flesh/contact.h"
#include "effect/private.h"
#include "flesh/effect.h"
#include "flesh/ranks.h"
#include "geometry/contact_core.h"
#include "geometry/slip.h"

/* Measures of the surface, from which the default thickness and stiffness and the core's weight are computed. On a part
 * of a body they are this rank's sums. */
typedef struct flesh_contact_measures {
  double edges, areas; /* m, m^2: an edge, twice the area, summed over `triangles` surface triangles; whole body: means, and 1 */
  double triangles;
  double stiffness; /* Pa, three times the largest shear modulus of the body */
} flesh_contact_measures;

typedef struct flesh_contact {
  flesh_obstacle *obstacle;
  int borrows_obstacle; /* the obstacle belongs to the effect on the whole body */
  double stiffness, thickness, friction, slip_speed;
  int default_stiffness, default_thickness; /* whether the option was not given */
  flesh_contact_measures measures;
  const flesh_mesh *mesh; /* mesh of the whole body, borrowed */
  int count;      /* number of nodes of tets */
  int *nodes;     /* [count] ascending */
  double *area;   /* [count] m^2; times the stiffness it is a node's weight, N */
  int *names;     /* [count] on a rank's part, the nodes' numbers in the whole mesh; NULL: `nodes` are */
  flesh_contact_core core;
} flesh_contact;

/* Least gap at the start, over the thickness; at this gap the barrier's pressure is 1e8 times its stiffness. */
static const double flesh_contact_least_gap = 1e-4;

/* Returns the weight of the k-th node, N. */
static inline double flesh_contact_weight(const flesh_contact *contact, int k)
{
  return contact->area[k] * contact->stiffness;
}

extern const flesh_effect_operations flesh_contact_operations;
extern const flesh_effect_barrier flesh_contact_barrier;

/* Returns three times the body's largest shear modulus mu, Pa; 0 without elasticity. */
double flesh_contact_body_stiffness(const flesh_body *body);
/* Checks the options. FLESH_ERR_ARGUMENT for the first invalid one; NaN is invalid. */
int flesh_contact_options_check(const flesh_contact_options *options);

/* Number of consecutive nodes of a part that share a bounding box. */
enum { FLESH_CONTACT_NODES_OF_BOX = 64 };

static inline int flesh_contact_end_of_box(int k, int end)
{
  return end - k < FLESH_CONTACT_NODES_OF_BOX ? end : k + FLESH_CONTACT_NODES_OF_BOX;
}

/* Computes the barrier at the position x [3] of a node; FLESH_UNDEFINED inside the obstacle. */
int flesh_contact_barrier_at(const flesh_contact *contact, const flesh_frame *frame, const double *x,
                             flesh_barrier *barrier);

/* Implement flesh_effect_private.predict and .predictions. */
void flesh_contact_predict(const flesh_effect *effect, const flesh_point *point);
size_t flesh_contact_predictions(const flesh_effect *effect);
/* Returns the factor for the Hessian of the barrier `at` the k-th node: the secant to the predicted force divided by
 * the tangent; 1 without a prediction. */
double flesh_contact_softness(const flesh_contact *contact, const void *predicted, int k, const flesh_barrier *at);

/* Returns what matrices expect of the friction of the k-th node, and the number of the last one; NULL: there is no
 * prediction yet. */
flesh_slip_expected *flesh_contact_slip(const flesh_contact *contact, void *predicted, int k, int *matrix);

double flesh_contact_clearance(const flesh_effect *effect, double t, const double *x);
double flesh_contact_approach(const flesh_effect *effect, double t_from, double t_to, const double low[3],
                              const double high[3]);
int flesh_contact_restrict(const flesh_effect *whole, const flesh_rank_part *part, const flesh_body *body,
                           flesh_effect **restricted);
/* Operations of flesh_effect_ranks: they provide the means over the whole body to the ranks' parts. */
void flesh_contact_count(const flesh_effect *restricted, flesh_rank_numbers *numbers);
void flesh_contact_take(flesh_effect *restricted, const flesh_rank_numbers *numbers);
size_t flesh_contact_memory(const flesh_effect *effect);
void flesh_contact_destroy(void *data);

/* Returns the obstacle of a contact effect, borrowed; NULL for every other effect. */
const flesh_obstacle *flesh_effect_obstacle(const flesh_effect *effect);

#endif
