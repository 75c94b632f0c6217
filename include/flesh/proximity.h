/* proximity.h: tables of effects (flesh/effect.h) that couple nodes which come near each other, and of those that hold
 * surfaces together. */
#ifndef FLESH_PROXIMITY_H
#define FLESH_PROXIMITY_H

#include <stddef.h>

#include "flesh/block_matrix.h"
#include "flesh/body.h"
#include "flesh/threads.h"

#ifdef __cplusplus
extern "C" {
#endif

struct flesh_archive;
struct flesh_separation;
struct flesh_effect;
struct flesh_point;

/* Two groups of nodes that an effect holds together. */
typedef struct flesh_bond {
  int count[2];        /* nodes of either group */
  const int *nodes[2]; /* [count] each, of the mesh; borrowed from the effect */
  double gap;          /* m, between the surfaces of the groups at rest */
  int variable;        /* the effect's internal variable that is not 0 once the bond is broken; -1: it never breaks */
} flesh_bond;

/* For effects that hold surfaces together (welds, joints): features that a bond holds do not touch each other until it
 * is broken and they have come apart. */
typedef struct flesh_effect_bonds {
  int (*count)(const struct flesh_effect *effect);
  void (*get)(const struct flesh_effect *effect, int k, flesh_bond *bond); /* 0 <= k < count */
} flesh_effect_bonds;

/* For effects that couple nodes which come near each other: contact of surfaces. Which nodes these are changes as the
 * body moves, and the pattern of the Jacobian with it. An effect is const, so what it finds out about nearness
 * belongs to a run: a memory that all its operations get as point->near, which one thread uses at a time and which may
 * grow there. It only saves searching: results do not depend on it, and where it is NULL each operation searches; but
 * for what `follow` and `predict` tell it. */
typedef struct flesh_effect_proximity {
  /* An empty memory. Returns new. Errors: FLESH_ERR_MEMORY. */
  int (*create)(const struct flesh_effect *effect, flesh_threads *threads, void **near);
  void (*destroy)(void *near); /* NULL-safe */
  /* Whether K's pattern has all pairs that the Jacobian at `point` couples. */
  int (*covers)(const struct flesh_effect *effect, const struct flesh_point *point, const flesh_block_matrix *K);
  /* Cells of all of these and of some that may come soon, beside those of `cells`; borrowed until the next call with
   * this memory. Errors: FLESH_ERR_MEMORY. */
  int (*coupled)(const struct flesh_effect *effect, const struct flesh_point *point, const flesh_cells **cells);
  /* A solve is about to make its matrix at `point`, with memory: the effect predicts its forces there, by those at
   * lagged.x or by what it predicted last in the solve that begins there. Until the next prediction `jacobian` at this
   * place may have secants to these forces for derivatives; it has derivatives where they are the forces at x, at all
   * other places, and without memory. Where it fails it predicts nothing, and `jacobian` says why. NULL: it always has
   * derivatives. */
  void (*predict)(const struct flesh_effect *effect, const struct flesh_point *point);
  /* Like flesh_effect_barrier.max_feasible_step; `near` and the effect's internal variables may be NULL. */
  double (*max_feasible_step)(const struct flesh_effect *effect, void *near, const double *internal,
                              const double *x_from, const double *x_to);
  /* Like flesh_effect_barrier.check, with the effect's internal variables (NULL: all 0). NULL: any place is allowed. */
  int (*check)(const struct flesh_effect *effect, const double *internal, const double *x);
  size_t (*memory)(const void *near); /* bytes */
  /* The run is at x [3*n] at time t: a step that was accepted has led there or, where `accepted` is 0, another begins,
   * mostly at the last one's end. *changed: whether the effect's energy at x is another from now on. NULL: results do
   * not depend on all that. FLESH_UNDEFINED where a place is not finite; FLESH_ERR_MEMORY. */
  int (*follow)(void *near, int accepted, double t, const double *x, int *changed);
  /* Saves or loads what `follow` has told (flesh_integrator_save). NULL: nothing, as outside of the library. */
  int (*archive)(void *near, struct flesh_archive *archive);
  /* Adds what the memory knows of surfaces that begin crossed and are let apart. NULL: none are. */
  void (*separation)(const void *near, struct flesh_separation *separation);
  /* Tells a new effect which bonds [count] the other effects of its system have, once, before its internal variables are
   * counted; each `variable` is an index into flesh_environment.all_internal. On ranks the effect of the whole body is
   * told. NULL: bonds make no difference. Errors: FLESH_ERR_MEMORY. */
  int (*take_bonds)(struct flesh_effect *effect, int count, const flesh_bond *bonds);
} flesh_effect_proximity;

#ifdef __cplusplus
}
#endif
#endif
