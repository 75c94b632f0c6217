/* surface_contact.h: what an effect of bodies that touch each other holds, and what a run knows of what is near. */
#ifndef FLESH_EFFECT_SURFACE_CONTACT_H
#define FLESH_EFFECT_SURFACE_CONTACT_H

#include "flesh/contact.h"
#include "effect/private.h"
#include "geometry/contact_friction.h"
#include "geometry/contact_patches.h"
#include "geometry/contact_seat.h"
#include "geometry/contact_secant.h"
#include "geometry/contact_set.h"
#include "geometry/near_drift.h"
#include "geometry/near_left_out.h"
#include "geometry/near_pairs.h"

typedef struct flesh_surface_contact {
  const flesh_mesh *mesh; /* borrowed */
  int part_count;
  const flesh_body_part *parts; /* [part_count] borrowed */
  flesh_contact_surface surface;
  flesh_contact_law law;
  double friction, slip_speed; /* m/s */
  double slack;                /* m, how much farther than forces reach is searched */
  int adaptive;                /* 1: the stiffness follows the pressures, from that of the law on */
  uint8_t *may_meet;           /* [bodies][bodies] 1: they may touch */
  flesh_cells places;          /* the surface's nodes, each by itself: those that every rank has */
  int own;                     /* the first nodes of the mesh are this rank's; INT_MAX: all are */
  const int *numbers;          /* of a rank's nodes in the whole, borrowed; NULL: there is one */
  const flesh_near_bonds *bonds; /* what other effects hold together; NULL: nothing */
  int owns_bonds, bonded;        /* bonded: it has been told */
  int separates;               /* what goes through each other at the start does not touch until it is apart */
} flesh_surface_contact;

/* Nodes begin <= i < end of the mesh, of which those on the surface are of one piece. */
typedef struct flesh_surface_run {
  int begin, end, piece;
} flesh_surface_run;

/* Pieces that are told apart, at most. */
enum { FLESH_SURFACE_GROUPS = 64 };

/* Ways of more than so many edges are searched in portions. */
enum { FLESH_SURFACE_LONG = 4 };

/* The most that two nodes have moved relative to each other, m: two of one group, and any two; NaN where a place is not
 * finite. */
typedef struct flesh_surface_drift {
  double within, all;
} flesh_surface_drift;

typedef struct flesh_surface_since {
  int known;
  double *x; /* [3*nodes of the mesh] a place, */
  flesh_surface_drift drift; /* and how far that is from where pairs were found */
} flesh_surface_since;

/* The pieces that touch each other at a place, on a rank by its own pairs: bit b of [a], and bit a of [b]. */
typedef struct flesh_surface_touching {
  int known;
  double *x; /* [3*nodes of the mesh] */
  uint64_t pieces[FLESH_SURFACE_GROUPS];
} flesh_surface_touching;

/* The contact cache of a run, or of one call: the nodes, edges and faces that may touch, found for one place and kept
 * for the places around it; the pairs that do touch, at the place evaluated last; and the pairs with friction, at the
 * lagged place. */
typedef struct flesh_surface_near {
  const flesh_surface_contact *contact; /* borrowed */
  flesh_threads *threads;               /* borrowed, may be NULL */
  flesh_near_finder *finder;
  flesh_near_pairs static_pairs; /* serve while nothing has come nearer by more than the slack, see surface_reach.c */
  int static_known;
  int run_count, pieces;
  flesh_surface_run *runs; /* [run_count] of the surface's nodes */
  unsigned char *piece;    /* [node_count of the surface] of each node; 0 where they are not told apart */
  int group[FLESH_SURFACE_GROUPS]; /* [pieces] groups of pieces that are far from all others, where `static_pairs` were found */
  double apart;       /* m, between the groups there, at least */
  flesh_near_drift drift;
  double *x_static; /* [3*nodes of the mesh], as all places here: where `static_pairs` were found */
  flesh_surface_since since[2]; /* the last places that were compared with it */
  int latest;                   /* of these */
  flesh_surface_drift room;     /* how far nodes may move from where it was asked last whether all is far, m; <= 0: it */
  int room_known;               /* is not; forgotten by a search */
  double *x_shown; /* what is at most `shown` apart there is among static_pairs */
  double shown;    /* m; 0: not known */
  flesh_near_pairs close_pairs; /* those of static_pairs that are near each other at x_close, see surface_reach.c */
  double *x_close;
  int close_known;
  flesh_near_pairs swept_pairs; /* of a step that leads farther */
  flesh_surface_touching touching[2]; /* at both ends of the last step, of which one begins the next */
  flesh_contact_set set;
  int set_known;
  flesh_contact_secant secant;
  double *x_set;
  flesh_contact_friction friction;
  int friction_known;
  double *x_friction;
  double *x_secant;           /* where the solve that the secant is of began */
  double *x_predicted;        /* where its forces are predicted for */
  int secant_known;
  double *moved;
  flesh_cells cells;
  int *cell_nodes, cell_room; /* of cells */
  double *hessians;
  size_t hessian_room;
  struct flesh_surface_guard *guards; /* [node_count of the surface + 1] room of surface_gaps.c; NULL: not yet needed */
  unsigned char *bonded;     /* [bonded points + edges] FLESH_HELD, ... by the internal variables; NULL: there are none */
  int seat_count;            /* of points that are FLESH_SEATED, on a rank its own */
  flesh_contact_seat *seats;
  flesh_contact_patches patches; /* that ignore each other; none but of an effect that separates */
  int begun;                     /* pairs of patches where the run began */
  double t_apart;                /* s, since when nothing is ignored any more; NaN: something is, or nothing ever was */
  int patches_known;
  double *x_patches; /* the last accepted place, at which they are known */
} flesh_surface_near;

/* Internal variables of a bonded point: FLESH_HELD, ...; the distance from which its seat pushes, m; the seat's face. */
enum { FLESH_POINT_STATE, FLESH_POINT_LEAST, FLESH_POINT_FACE, FLESH_POINT_VARIABLES };

extern const flesh_effect_operations flesh_surface_contact_operations, flesh_separating_contact_operations;
extern const flesh_effect_barrier flesh_surface_contact_barrier, flesh_separating_contact_barrier;
extern const flesh_effect_private flesh_surface_contact_private, flesh_separating_contact_private;
extern const flesh_effect_ranks flesh_surface_contact_ranks;

/* Whether the effect is of this kind. */
static inline int flesh_is_surface_contact(const flesh_effect *effect)
{
  return effect->operations == &flesh_surface_contact_operations ||
         effect->operations == &flesh_separating_contact_operations;
}

/* Whether the effect keeps these parts (a body's, by number) out of each other; 0 for every other effect. */
int flesh_surface_contact_may_meet(const flesh_effect *effect, int a, int b);

/* The pairs of patches (new) that a run which begins at x [3*n] would ignore; none for effects that separate nothing.
 * FLESH_UNDEFINED, FLESH_ERR_MEMORY. */
int flesh_surface_contact_ignored(const flesh_effect *effect, const double *x, int *count, flesh_patch_pair **pairs);

/* Finds the pairs that the effect leaves out of contact although they could touch, because they are nearer than the
 * thickness at rest; none for an effect of another kind. FLESH_ERR_MEMORY. */
int flesh_surface_contact_left_out(const flesh_effect *effect, flesh_left_out *found);

/* flesh_effect_private.evaluate. */
int flesh_surface_contact_evaluate(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                                   double *r, double *phi, double *magnitude);
/* flesh_effect_partials.couple. */
int flesh_surface_contact_couple(const flesh_effect *effect, const flesh_point *point, flesh_argument argument,
                                 flesh_block_add add, void *to);
/* flesh_effect_barrier.check. */
int flesh_surface_contact_check(const flesh_effect *effect, const double *internal, double t, const double *x);

/* The places that a cache keeps. */
enum { FLESH_SURFACE_PLACES = 13 };
int flesh_surface_near_create(const flesh_surface_contact *contact, flesh_threads *threads, flesh_surface_near **near);
void flesh_surface_near_destroy(void *near);

/* The point's memory, or one for this call (*own), which is to be destroyed, with the stiffness and what is held together by
 * the point's internal variables. FLESH_ERR_MEMORY. */
int flesh_surface_near_of(const flesh_effect *effect, const flesh_point *point, flesh_surface_near **near, int *own);
/* Memory for what is held together, after the finder's. FLESH_ERR_MEMORY. */
int flesh_surface_release_create(flesh_surface_near *near);
/* The stiffness and what is held together become those of the effect's internal variables (NULL: all are 0). */
void flesh_surface_near_take(flesh_surface_near *near, const double *internal);
/* The part of that for what is HELD, SEATED and APART. */
void flesh_surface_near_let_go(flesh_surface_near *near, const double *internal);
/* The energy of the seats at x [3*n], J; adds the residual to r unless it is NULL. */
double flesh_surface_seats_evaluate(const flesh_surface_near *near, const double *x, double *r);
/* The internal variables of the next step, by which bonds hold and how far apart things are at the point; whether any has
 * changed. */
int flesh_surface_contact_release(const flesh_surface_contact *contact, const flesh_point *point, double *internal);
/* flesh_effect_private.take_bonds. */
int flesh_surface_contact_take_bonds(flesh_effect *effect, int count, const flesh_bond *bonds);
/* Corrects x [3*n], where near->static_pairs has all that is within so many m at x_from: nodes and faces that touch there keep
 * their gaps. Others go where the guess has them: elsewhere an impact has other solutions. Returns whether x has changed.
 * Collective where `team` is not NULL: the same x on all ranks, as it was where one comes with a `status`. */
int flesh_surface_near_keep_gaps(flesh_surface_near *near, const struct flesh_team *team, int status, double within,
                                 const double *x_from, double *x);
/* Once other features may touch, nothing that is known of the near ones serves. */
void flesh_surface_near_forget(flesh_surface_near *near);
/* near->set becomes that at x [3*n]. FLESH_UNDEFINED where surfaces meet. */
int flesh_surface_near_update_pairs(flesh_surface_near *near, const double *x);
/* places [3*n] = x. */
void flesh_surface_near_keep(const flesh_surface_near *near, const double *x, double *places);
/* x [3*n] without the mean displacement of the surface from x_from, near->moved, of which only the surface's nodes are set:
 * distances do not depend on a motion that all share, and what is thrown needs no search. */
const double *flesh_surface_near_without_mean(flesh_surface_near *near, const double *x_from, const double *x);
/* The runs of the surface's nodes. FLESH_ERR_MEMORY. */
int flesh_surface_near_runs_create(flesh_surface_near *near);
/* The groups of what is far from each other where near->static_pairs were found. */
void flesh_surface_near_group(flesh_surface_near *near);
/* The feasible fraction of the straight step from x_from to x_to [3*n]. */
double flesh_surface_near_feasible_step(flesh_surface_near *near, const double *x_from, const double *x_to);
/* flesh_effect_private.tunnelled. */
int flesh_surface_near_tunnelled(void *near, const struct flesh_team *team, const double *internal, const double *x_from,
                                 const double *x_to);
/* Whether nothing can limit a step from x_from to x_to [3*n] because all is far apart, by what is known without a search. */
int flesh_surface_near_is_free(flesh_surface_near *near, const double *x_from, const double *x_to);
/* flesh_effect_private.is_far. */
int flesh_surface_near_is_far(void *near, const double *x0, double shift, const double *u);
/* Pairs among which are all at most so far apart at x [3*n]: nodes and faces, two edges, m; NULL: it takes a search. Those
 * within the thicknesses are chosen from what is known, for the next places, too. */
const flesh_near_pairs *flesh_surface_near_pairs_at(flesh_surface_near *near, const double *x, double points, double edges);
/* Whether all pairs at most `within` [m] apart at x, are among near->static_pairs. */
int flesh_surface_near_is_valid(flesh_surface_near *near, const double *x, double within);
/* How far apart at x_from, at most, what limits a step from there to x_to is, m; NaN or more where it is not known. */
double flesh_surface_near_limiting_distance(flesh_surface_near *near, const double *x_from, const double *x_to);
/* near->friction becomes that of x_lag, and near->set that at x, where there is friction. */
int flesh_surface_near_update_friction(flesh_surface_near *near, const flesh_point *point);
/* Hessians of near->set, that at x, become those of secants to the predicted forces where x is the place that they are
 * predicted for, and tangents elsewhere, or everywhere. */
void flesh_surface_near_expect(flesh_surface_near *near, const double *x, int tangents);
/* The run is at x [3*n] at time t, of an effect that separates. Where a step has led there, what is apart touches from now
 * on; else (`accepted` 0), if it was not there before, it begins there. *changed: whether the energy at x is another than
 * before. FLESH_UNDEFINED where a place is not finite; FLESH_ERR_MEMORY. */
int flesh_surface_near_follow(flesh_surface_near *near, int accepted, double t, const double *x, int *changed);
/* Archives the patches that flesh_surface_near_follow keeps. FLESH_ERR_MEMORY. */
int flesh_surface_near_archive(flesh_surface_near *near, flesh_archive *archive);
/* Adds the pairs that began crossed, those that still are ignored, and when the last ones came apart. */
void flesh_surface_near_separation(const flesh_surface_near *near, flesh_separation *separation);
/* Whether x has the bits of these places [3*n]. */
int flesh_surface_near_is_at(const flesh_surface_near *near, const double *x, const double *places);
/* The stiffness of near->set becomes that by the effect's internal variable (NULL: 0). */
void flesh_surface_near_harden(flesh_surface_near *near, const double *internal);
/* The internal variable of the next step, by the pressures of near->set, that at x; returns whether it changed. */
int flesh_surface_near_adapt(const flesh_surface_near *near, const double *x, double *internal);
/* Room for Hessians of 12 x 12. FLESH_ERR_MEMORY. */
int flesh_surface_near_reserve(flesh_surface_near *near, int hessians);

#endif
