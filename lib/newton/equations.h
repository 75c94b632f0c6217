/* equations.h: the equations r(u) = 0 of a stage on plain arrays: residual, potential and Hessian K at u, and which
 * dofs are constrained. No policy: nothing here decides when to evaluate what. */
#ifndef FLESH_NEWTON_EQUATIONS_H
#define FLESH_NEWTON_EQUATIONS_H

#include <stdint.h>

#include "base/archive.h"
#include "base/parallel_vector.h"
#include "flesh/solver.h"
#include "system/evaluation.h"

/* The constrained dofs of a stage. */
typedef struct flesh_constrained {
  uint8_t *is;          /* [n] 1: the dof is */
  int *dofs, count;     /* [n] the numbers of those that are */
  int *rows, row_count; /* [n/3] the rows of K that know of any */
  double *u;            /* [n] their values; 0 elsewhere */
  double displacement;  /* the largest |u| */
  double stiffness;     /* N/m, of their rows */
} flesh_constrained;

typedef struct flesh_equations {
  flesh_evaluation evaluation;
  const flesh_system *system; /* that is evaluated: the evaluation's, or softened (system/softened.h) */
  flesh_threads *threads; /* the evaluation's, as are the next two */
  const flesh_team *team;
  int n;
  const flesh_solver_options *options; /* borrowed, as is the next */
  flesh_solve_stats *stats;            /* where all parts of an iteration count */
  flesh_stage stage;
  flesh_constrained constrained;
  flesh_block_matrix *K;
  int patterns; /* how often K has got another pattern */
  int far_away; /* from the origin, so that the elements take positions less those of a node */
  int refused;  /* status of the stage's last residual that had no value; 0: none */
  int fatal;    /* the first negative status of the stage's evaluations, which ends it; 0: none */
  const double *weights; /* [n] of residuals in their norms, borrowed; NULL: ones */
  double *scratch; /* [4*n] of the functions that say so */
  /* [n] of what tries a step, one after the other: where it leads, and what else is needed there. */
  double *trial, *work[2], *proposal;
  double *relative; /* [n] of a body that is far away, at the point evaluated last */
} flesh_equations;

/* Whether the stage's materials are softened, so that its end is only on the way to that of another stage. */
static inline int flesh_equations_is_softened(const flesh_equations *equations)
{
  return equations->system != equations->evaluation.system;
}

/* Keeps a status that ends the stage, of whatever was evaluated on the way. */
static inline int flesh_equations_keep_fatal(flesh_equations *equations, int status)
{
  if (status < 0 && !equations->fatal) equations->fatal = status;
  return status;
}

/* FLESH_ERR_ARGUMENT with the first option that makes no sense. */
int flesh_solver_options_check(const flesh_solver_options *options);

/* Whether the line search keeps steps between iterates feasible; else a u that cannot be reached from the lagged state has
 * no residual. */
static inline int flesh_equations_are_guarded(const flesh_equations *equations)
{
  return equations->options->line_search == FLESH_LINE_SEARCH_POTENTIAL;
}

/* Makes room for the equations of a finished system; `options`, `threads` and `stats` are borrowed. FLESH_ERR_MEMORY. */
int flesh_equations_init(const flesh_system *system, const flesh_solver_options *options, flesh_threads *threads,
                         flesh_solve_stats *stats, flesh_equations *equations);
/* Finds the stiffness of the constraints' rows, once all ranks have room. */
void flesh_equations_measure(flesh_equations *equations);
void flesh_equations_clear(flesh_equations *equations);

/* Archives the memory that lasts from stage to stage; `matrix`: K as well. FLESH_ERR_MEMORY. */
int flesh_equations_archive(flesh_equations *equations, int matrix, flesh_archive *archive);

/* Takes the stage, whose arrays are borrowed, and forgets what was cached. Whether other dofs are constrained than
 * before. */
int flesh_equations_set_stage(flesh_equations *equations, const flesh_stage *stage);
/* Works out the constrained dofs at t, with those `held` [n] (NULL: none); whether this rank's are others than before. */
int flesh_equations_find_constrained(flesh_equations *equations, double t, const uint8_t *held);
/* u = 0 but for the constrained dofs, which take their prescribed values. */
void flesh_equations_start(const flesh_equations *equations, double *u);
/* x, v and a of u, with the constrained dofs at their prescribed places whatever u says of them: the free rows then do
 * not depend on those of u, so that K without their columns is the exact Jacobian from any start. */
flesh_point flesh_equations_point(flesh_equations *equations, const double *u);

/* The frozen state becomes the point of u; nothing where no effect or stage freezes at its solution. The caches are
 * lost. Whether it has. */
int flesh_equations_freeze(flesh_equations *equations, const double *u);

/* r(u) [n], constraint rows included; status > 0 where it has no value. */
int flesh_equations_residual(flesh_equations *equations, const double *u, double *r);
/* The potential at u and the sum of its terms' absolute values. */
int flesh_equations_potential(flesh_equations *equations, const double *u, double *phi, double *magnitude);
/* The potential; if neither it nor the residual at u is known, both become so in one pass. */
int flesh_equations_evaluate(flesh_equations *equations, const double *u, double *phi, double *magnitude);
/* K at u with the constraints applied; negative eigenvalues of elements as `filter` says. Where nodes have come near
 * each other K may get another pattern: `patterns` counts that. */
int flesh_equations_assemble(flesh_equations *equations, const double *u, flesh_eigenvalue_filter filter);
/* M at x and v, without constraints, into K; the caches are lost. */
int flesh_equations_assemble_mass(flesh_equations *equations, double t, const double *x, const double *v);
/* Turns the constrained rows and columns of K into those of the identity, scaled. */
void flesh_equations_constrain_matrix(flesh_equations *equations);

/* Remembers what is known of the potential at u, where the stage ends. */
void flesh_equations_save_end(flesh_equations *equations, const double *u);
/* Whether all that could limit steps is so far from the lagged state and from u that it limits none and is not felt. */
int flesh_equations_is_clear(flesh_equations *equations, const double *u);
/* The free dofs of u become those of x [n]. */
void flesh_equations_take_free(const flesh_equations *equations, const double *x, double *u);
/* Whether no effect limits the straight step from the lagged state to u, and the share `beyond` of it farther. Overwrites
 * `scratch`. */
int flesh_equations_is_feasible(flesh_equations *equations, const double *u, double beyond);
/* Corrects the free dofs of u, a guess, so that bodies that touch keep their gaps. Overwrites `scratch`. */
void flesh_equations_keep_gaps(flesh_equations *equations, double *u);
/* The feasible fraction of the step from one u, which has been evaluated in this stage, to another. Overwrites
 * `scratch`. */
double flesh_equations_max_feasible_step(flesh_equations *equations, const double *from, const double *to);

/* 2-norm of r [n] by the weights of residuals, as are those below. Overwrites `scratch`. */
double flesh_equations_norm(flesh_equations *equations, const double *r);
/* 2-norm of the applied load over the free dofs at u. Overwrites `scratch`. */
int flesh_equations_load_norm(flesh_equations *equations, const double *u, double *norm);
/* 2-norm of how far round-off in x, v and a moves the residual. Overwrites `scratch`. */
double flesh_equations_residual_round_off(flesh_equations *equations, const double *u);
/* A residual of at most so many times that may be round-off: forces that bend soft parts may be few times as large. */
#define FLESH_ROUND_OFF_LEAVES 4
/* Whether a residual of this norm at u, the point last evaluated, is no more than round-off leaves. */
int flesh_equations_at_round_off(flesh_equations *equations, const double *u, double norm);
/* How far it moves the potential. */
double flesh_equations_potential_round_off(flesh_equations *equations, const double *u);
/* Finds whether the body at rest is so far from the origin that x lacks digits of its shape, on all ranks alike. Collective. */
void flesh_equations_find_far_away(flesh_equations *equations);
/* Fills `relative` at u, to full precision, as u is added to what is exact: differences of nearby places. */
const double *flesh_equations_relative(flesh_equations *equations, const double *u);

#endif
