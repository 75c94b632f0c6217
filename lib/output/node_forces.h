/* node_forces.h: forces of constraints and of contact on every node, for an accepted step. */
#ifndef FLESH_OUTPUT_NODE_FORCES_H
#define FLESH_OUTPUT_NODE_FORCES_H

#include <stdint.h>

#include "effect/environment.h"
#include "flesh/observer.h"

typedef struct flesh_node_forces {
  double *reaction; /* [3*n] N on the body, 0 on free dofs; NULL: not wanted */
  double *contact;  /* [3*n] N on the body; NULL: not wanted */
  int *holder;      /* [3*n] with reaction: the constraint that exerts it (flesh_system_holders) */
  /* The other members are private to node_forces.c. */
  const flesh_body *body;
  const flesh_system *system;
  const struct flesh_team *team; /* the system's; NULL: a single rank */
  int is_static;
  flesh_environment environment;          /* of the current record */
  uint8_t *constrained;                   /* [3*n] */
  double *v, *a, *zeros;                  /* [3*n] */
  double *one_contact;                    /* [3*n] with contact */
  double *diagonal;                       /* [n] of the consistent mass, kg; NULL: lumped mass, or statics */
  double *direction, *product, *residual; /* [3*n], with diagonal only */
} flesh_node_forces;

/* Prepares the forces. Borrows body and system; for a part of a body (flesh/ranks.h) every rank calls these functions
 * and gets the body's forces on the part's nodes. If no forces are wanted, forces->system is NULL. `status` is the
 * caller's own so far: if it is not FLESH_OK on some rank, all ranks fail. FLESH_ERR_MEMORY. After an error *forces is
 * cleared. */
int flesh_node_forces_open(int status, const flesh_body *body, const flesh_system *system, int is_static,
                           int wants_reaction, int wants_contact, flesh_node_forces *forces);
void flesh_node_forces_clear(flesh_node_forces *forces);

/* Computes the wanted forces: reactions at the record's state, contact at its stage; NaN where forces have no value. */
void flesh_node_forces_find(flesh_node_forces *forces, const flesh_step_record *record);

/* Returns the contact forces of the system's effect number `effect` alone [3*n], valid until the next call; needs
 * contact. */
const double *flesh_node_forces_of_contact(flesh_node_forces *forces, const flesh_step_record *record, int effect);

#endif
