/* surface_contact.h: the data of a contact effect between bodies, and a run's cache of what is near. */
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
  double friction, slip_speed; /* slip_speed in m/s */
  double slack;                /* m, distance beyond the reach of forces within which pairs are searched for */
  int adaptive;                /* 1: the stiffness adapts to the pressures, starting from that of `law` */
  uint8_t *may_meet;           /* [bodies][bodies] 1: they may touch */
  flesh_cells places;          /* one cell for each surface node: the nodes that every rank has */
  int own;                     /* number of the mesh's first nodes that this rank owns; INT_MAX: all */
  const int *numbers;          /* numbers, in the whole mesh, of a rank's nodes, borrowed; NULL: there is one rank */
  const flesh_near_bonds *bonds; /* features that other effects hold together; NULL: none */
  int owns_bonds, bonded;        /* bonded: whether it has been told the bonds */
  int separates;               /* whether surfaces that intersect at the start ignore each other until they are apart */
} flesh_surface_contact;

/* Mesh nodes begin <= i < end, of which those on the surface belong to one piece. */
typedef struct flesh_surface_run {
  int begin, end, piece;
} flesh_surface_run;

/* Largest number of pieces that are distinguished. */
enum { FLESH_SURFACE_GROUPS = 64 };

/* Paths longer than this many edges are searched in portions. */
enum { FLESH_SURFACE_LONG = 4 };

/* Largest relative displacement of two nodes, m: of one group, and of any two; NaN if a position is not finite. */
typedef struct flesh_surface_drift {
  double within, all;
} flesh_surface_drift;

typedef struct flesh_surface_since {
  int known;
  double *x; /* [3*nodes of the mesh] positions */
  flesh_surface_drift drift; /* their drift from x_static */
} flesh_surface_since;

/* The pieces that touch each other at x, on a rank those of its own pairs: bit b of pieces[a], and bit a of
 * pieces[b]. */
typedef struct flesh_surface_touching {
  int known;
  double *x; /* [3*nodes of the mesh] */
  uint64_t pieces[FLESH_SURFACE_GROUPS];
} flesh_surface_touching;

/* The contact cache of a run, or of one call: nodes, edges and faces that may touch, found at one position and valid
 * around it; the pairs that do touch at the position evaluated last; and the pairs with friction at the lagged
 * position. */
typedef struct flesh_surface_near {
  const flesh_surface_contact *contact; /* borrowed */
  flesh_threads *threads;               /* borrowed, may be NULL */
  flesh_near_finder *finder;
  flesh_near_pairs static_pairs; /* valid until features have come nearer by more than the slack, see surface_reach.c */
  int static_known;
  int run_count, pieces;
  flesh_surface_run *runs; /* [run_count] runs of the surface's nodes */
  unsigned char *piece;    /* [node_count of the surface] number of each node's piece; 0 if pieces are not distinguished */
  int group[FLESH_SURFACE_GROUPS]; /* [pieces] group of each piece; groups were far from each other at x_static */
  double apart;       /* m, least distance of two groups at x_static */
  flesh_near_drift drift;
  double *x_static; /* [3*nodes of the mesh], as all positions here: where static_pairs were found */
  flesh_surface_since since[2]; /* drifts of the last two positions asked for */
  int latest;                   /* index of the later one in `since` */
  flesh_surface_drift room;     /* m, drift from the last x0 of is_far within which all pieces stay far from each other;
                                 * <= 0: they may be near */
  int room_known;               /* reset by a search */
  double *x_shown; /* position at which static_pairs were shown to have all pairs at most `shown` apart */
  double shown;    /* m; 0: unknown */
  flesh_near_pairs close_pairs; /* those of static_pairs that are near each other at x_close, see surface_reach.c */
  double *x_close;
  int close_known;
  flesh_near_pairs swept_pairs; /* pairs of a step too long for static_pairs */
  flesh_surface_touching touching[2]; /* touching pieces at both ends of the last step; the next one may start at either */
  flesh_contact_set set;
  int set_known;
  flesh_contact_secant secant;
  double *x_set;
  flesh_contact_friction friction;
  int friction_known;
  double *x_friction;
  double *x_secant;           /* where the solve began for which `secant` predicts */
  double *x_predicted;        /* where the secant's forces were predicted */
  int secant_known;
  double *moved;
  flesh_cells cells;
  int *cell_nodes, cell_room; /* nodes of `cells`, and its room in cells */
  double *hessians;
  size_t hessian_room;
  struct flesh_surface_guard *guards; /* [node_count of the surface + 1] scratch of surface_gaps.c; NULL: not needed yet */
  unsigned char *bonded;     /* [bonded points + edges] FLESH_HELD, ... from the internal variables; NULL: no bonds */
  int seat_count;            /* number of SEATED points; on a rank, of those that it owns */
  flesh_contact_seat *seats;
  flesh_contact_patches patches; /* patches that ignore each other; only for an effect that separates */
  int begun;                     /* number of pairs of patches when the run began */
  double t_apart;                /* s, time since which nothing is ignored; NaN: something is, or nothing ever was */
  int patches_known;
  double *x_patches; /* last accepted position, for which the patches are known */
} flesh_surface_near;

/* Internal variables of a bonded point: state FLESH_HELD, ...; m, opening below which its seat pushes; its seat's
 * face. */
enum { FLESH_POINT_STATE, FLESH_POINT_LEAST, FLESH_POINT_FACE, FLESH_POINT_VARIABLES };

extern const flesh_effect_operations flesh_surface_contact_operations, flesh_separating_contact_operations;
extern const flesh_effect_barrier flesh_surface_contact_barrier, flesh_separating_contact_barrier;
extern const flesh_effect_private flesh_surface_contact_private, flesh_separating_contact_private;
extern const flesh_effect_ranks flesh_surface_contact_ranks;

/* Whether the effect is a contact between bodies. */
static inline int flesh_is_surface_contact(const flesh_effect *effect)
{
  return effect->operations == &flesh_surface_contact_operations ||
         effect->operations == &flesh_separating_contact_operations;
}

/* Whether the effect keeps these two parts of the body (by number) apart; 0 for every other effect. */
int flesh_surface_contact_may_meet(const flesh_effect *effect, int a, int b);

/* Finds the pairs of patches (new) that a run starting at x [3*n] would ignore; none for effects that do not separate.
 * FLESH_UNDEFINED, FLESH_ERR_MEMORY. */
int flesh_surface_contact_ignored(const flesh_effect *effect, const double *x, int *count, flesh_patch_pair **pairs);

/* Finds the pairs that the effect excludes from contact although they could touch, because they are nearer than the
 * thickness at rest; none for other effects. FLESH_ERR_MEMORY. */
int flesh_surface_contact_left_out(const flesh_effect *effect, flesh_left_out *found);

/* Implements flesh_effect_private.evaluate. */
int flesh_surface_contact_evaluate(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                                   double *r, double *phi, double *magnitude);
/* Implements flesh_effect_partials.couple. */
int flesh_surface_contact_couple(const flesh_effect *effect, const flesh_point *point, flesh_argument argument,
                                 flesh_block_add add, void *to);
/* Implements flesh_effect_barrier.check. */
int flesh_surface_contact_check(const flesh_effect *effect, const double *internal, double t, const double *x);

/* Number of position arrays that a cache keeps. */
enum { FLESH_SURFACE_PLACES = 13 };
int flesh_surface_near_create(const flesh_surface_contact *contact, flesh_threads *threads, flesh_surface_near **near);
void flesh_surface_near_destroy(void *near);

/* Finds the point's cache, or a new one for this call (*own), which the caller destroys. Sets its stiffness and bonds
 * from the point's internal variables. FLESH_ERR_MEMORY. */
int flesh_surface_near_of(const flesh_effect *effect, const flesh_point *point, flesh_surface_near **near, int *own);
/* Allocates the memory for bonds, once the finder exists. FLESH_ERR_MEMORY. */
int flesh_surface_release_create(flesh_surface_near *near);
/* Sets stiffness and bonds from the effect's internal variables (NULL: all are 0). */
void flesh_surface_near_take(flesh_surface_near *near, const double *internal);
/* Sets the states HELD, SEATED and APART of the bonds, for flesh_surface_near_take. */
void flesh_surface_near_let_go(flesh_surface_near *near, const double *internal);
/* Returns the energy of the seats at x [3*n], J; adds their residual to r unless it is NULL. */
double flesh_surface_seats_evaluate(const flesh_surface_near *near, const double *x, double *r);
/* Updates the bonds' internal variables for the next step, from the bonds that hold and the distances at the point.
 * Returns whether any has changed. */
int flesh_surface_contact_release(const flesh_surface_contact *contact, const flesh_point *point, double *internal);
/* Implements flesh_effect_private.take_bonds. */
int flesh_surface_contact_take_bonds(flesh_effect *effect, int count, const flesh_bond *bonds);
/* Corrects x [3*n] so that nodes and faces that touch at x_from keep their gaps; near->static_pairs must have all pairs
 * at most `within` [m] apart there. Other nodes stay where the guess has them, because moving them would select another
 * solution of an impact. Returns whether x has changed. Collective unless `team` is NULL: x is the same on all ranks,
 * and unchanged if one of them passes an error in `status`. */
int flesh_surface_near_keep_gaps(flesh_surface_near *near, const struct flesh_team *team, int status, double within,
                                 const double *x_from, double *x);
/* Invalidates all that is known of near features, because other features may touch now. */
void flesh_surface_near_forget(flesh_surface_near *near);
/* Updates near->set to x [3*n]. FLESH_UNDEFINED if surfaces meet. */
int flesh_surface_near_update_pairs(flesh_surface_near *near, const double *x);
/* Copies x to places [3*n]. */
void flesh_surface_near_keep(const flesh_surface_near *near, const double *x, double *places);
/* Returns x [3*n] minus the surface's mean displacement from x_from, in near->moved, of which only surface nodes are
 * set. Distances do not depend on a common motion, so a thrown body needs no new search. */
const double *flesh_surface_near_without_mean(flesh_surface_near *near, const double *x_from, const double *x);
/* Finds the runs of the surface's nodes. FLESH_ERR_MEMORY. */
int flesh_surface_near_runs_create(flesh_surface_near *near);
/* Finds the groups of pieces that are far from each other at near->x_static. */
void flesh_surface_near_group(flesh_surface_near *near);
/* Returns the feasible fraction of the straight step from x_from to x_to [3*n]. */
double flesh_surface_near_feasible_step(flesh_surface_near *near, const double *x_from, const double *x_to);
/* Implements flesh_effect_private.tunnelled. */
int flesh_surface_near_tunnelled(void *near, const struct flesh_team *team, const double *internal, const double *x_from,
                                 const double *x_to);
/* Whether a step from x_from to x_to [3*n] is known, without a search, to be unlimited because everything is far
 * apart. */
int flesh_surface_near_is_free(flesh_surface_near *near, const double *x_from, const double *x_to);
/* Implements flesh_effect_private.is_far. */
int flesh_surface_near_is_far(void *near, const double *x0, double shift, const double *u);
/* Returns pairs that include all those at most points [m] (node and face) or edges [m] (two edges) apart at x [3*n];
 * NULL: a search is needed. For distances within the thicknesses they are selected from the known pairs, and kept for
 * the next positions. */
const flesh_near_pairs *flesh_surface_near_pairs_at(flesh_surface_near *near, const double *x, double points, double edges);
/* Whether near->static_pairs has all pairs at most `within` [m] apart at x. */
int flesh_surface_near_is_valid(flesh_surface_near *near, const double *x, double within);
/* Returns the largest distance [m], at x_from, of pairs that can limit a step from there to x_to; NaN or too large a
 * value if it is not known. */
double flesh_surface_near_limiting_distance(flesh_surface_near *near, const double *x_from, const double *x_to);
/* Updates near->friction to the lagged positions, if there is friction. May leave near->set at those. */
int flesh_surface_near_update_friction(flesh_surface_near *near, const flesh_point *point);
/* Makes the Hessians of near->set, which is that at x, those of secants to the predicted forces if they were predicted
 * for the point, and returns the number of that prediction. Else, and if the point asks for tangents, returns 0. */
int flesh_surface_near_expect(flesh_surface_near *near, const flesh_point *point);
/* Follows a run of an effect that separates to x [3*n] at time t. If a step led there (`accepted`), features that have
 * come apart touch from now on; otherwise the run begins there, unless it was there before. *changed: whether this
 * changes the energy at x. FLESH_UNDEFINED if a position is not finite; FLESH_ERR_MEMORY. */
int flesh_surface_near_follow(flesh_surface_near *near, int accepted, double t, const double *x, int *changed);
/* Saves or loads the patches that flesh_surface_near_follow keeps. FLESH_ERR_MEMORY. */
int flesh_surface_near_archive(flesh_surface_near *near, flesh_archive *archive);
/* Adds the number of pairs ignored at the start and now, and the time when the last ones came apart. */
void flesh_surface_near_separation(const flesh_surface_near *near, flesh_separation *separation);
/* Whether x has the same bits as places [3*n]. */
int flesh_surface_near_is_at(const flesh_surface_near *near, const double *x, const double *places);
/* Sets the stiffness of near->set from the effect's internal variable (NULL: 0). */
void flesh_surface_near_harden(flesh_surface_near *near, const double *internal);
/* Updates the internal variable of the stiffness for the next step, from the pressures of near->set, which is that at
 * x. Returns whether it has changed. */
int flesh_surface_near_adapt(const flesh_surface_near *near, const double *x, double *internal);
/* Makes room for this many Hessians of 12 x 12. FLESH_ERR_MEMORY. */
int flesh_surface_near_reserve(flesh_surface_near *near, int hessians);

#endif
