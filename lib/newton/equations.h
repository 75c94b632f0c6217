/* equations.h: the equations r(u) = 0 of a stage on plain arrays: residual, potential and Hessian K at u, and the
 * constrained dofs. It only evaluates; its callers decide when and what. */
#ifndef FLESH_NEWTON_EQUATIONS_H
#define FLESH_NEWTON_EQUATIONS_H

#include <stdint.h>

#include "base/archive.h"
#include "base/parallel_vector.h"
#include "flesh/solver.h"
#include "system/evaluation.h"

/* The constrained dofs of a stage. */
typedef struct flesh_constrained {
  uint8_t *is;          /* [n] 1: the dof is constrained */
  int *dofs, count;     /* [n] numbers of the constrained dofs */
  int *rows, row_count; /* [n/3] rows of K with a block of a constrained dof */
  double *u;            /* [n] values of the constrained dofs; 0 elsewhere */
  double displacement;  /* the largest |u| */
  double stiffness;     /* N/m, stiffness of the constrained rows */
} flesh_constrained;

typedef struct flesh_equations {
  flesh_evaluation evaluation;
  const flesh_system *system; /* the system to evaluate: that of `evaluation`, or a softened one (system/softened.h) */
  flesh_threads *threads; /* those of `evaluation`, like the next two */
  const flesh_team *team;
  int n;
  const flesh_solver_options *options; /* borrowed, like the next */
  flesh_solve_stats *stats;            /* counts of all parts of an iteration */
  flesh_stage stage;
  flesh_constrained constrained;
  flesh_block_matrix *K;
  int patterns; /* number of patterns that K has had */
  int far_away; /* the body is so far from the origin that elements take positions relative to a node */
  int refused;  /* status of the stage's last residual without a value; 0: none */
  int fatal;    /* first negative status of the stage's evaluations, which ends it; 0: none */
  const double *weights; /* [n] weights of residuals in their norms, borrowed; NULL: ones */
  double *scratch; /* [4*n] overwritten by functions whose comments say so */
  /* Vectors [n] for trying one step at a time: the trial iterate, and work space. */
  double *trial, *work[2], *proposal;
  double *relative; /* [n] relative positions of a body that is far away, at the last point evaluated */
} flesh_equations;

/* Whether the stage's materials are softened, so that its solution is only a start for another stage. */
static inline int flesh_equations_is_softened(const flesh_equations *equations)
{
  return equations->system != equations->evaluation.system;
}

/* Keeps the first negative status of any evaluation, which ends the stage, and returns it. */
static inline int flesh_equations_keep_fatal(flesh_equations *equations, int status)
{
  if (status < 0 && !equations->fatal) equations->fatal = status;
  return status;
}

/* Checks the options. FLESH_ERR_ARGUMENT, naming the first invalid one. */
int flesh_solver_options_check(const flesh_solver_options *options);

/* Whether the line search keeps steps between iterates feasible; if not, a u that cannot be reached from the lagged state
 * has no residual. */
static inline int flesh_equations_are_guarded(const flesh_equations *equations)
{
  return equations->options->line_search == FLESH_LINE_SEARCH_POTENTIAL;
}

/* Makes room for the equations of a finalized system; borrows `options`, `threads` and `stats`. FLESH_ERR_MEMORY. */
int flesh_equations_init(const flesh_system *system, const flesh_solver_options *options, flesh_threads *threads,
                         flesh_solve_stats *stats, flesh_equations *equations);
/* Finds the stiffness of the constrained rows, once all ranks have room. */
void flesh_equations_measure(flesh_equations *equations);
void flesh_equations_clear(flesh_equations *equations);

/* Archives the memory that lasts from stage to stage; `matrix`: K as well. FLESH_ERR_MEMORY. */
int flesh_equations_archive(flesh_equations *equations, int matrix, flesh_archive *archive);

/* Sets the stage, whose arrays are borrowed, and drops cached results. Returns whether other dofs are constrained than
 * before. */
int flesh_equations_set_stage(flesh_equations *equations, const flesh_stage *stage);
/* Finds the dofs constrained at t and adds those `held` [n] (NULL: none). Returns whether this rank's differ from before. */
int flesh_equations_find_constrained(flesh_equations *equations, double t, const uint8_t *held);
/* Sets u to 0 on free dofs and to the prescribed values on constrained ones. */
void flesh_equations_start(const flesh_equations *equations, double *u);
/* Returns the point x, v and a of u. Constrained dofs are at their prescribed places whatever u says: the free rows then do
 * not depend on the constrained entries of u, so that K without their columns is the exact Jacobian from any start. */
flesh_point flesh_equations_point(flesh_equations *equations, const double *u);

/* Sets the frozen state to the point of u and drops the caches; does nothing if no effect freezes or the stage does not
 * freeze at its solution. Returns whether it froze. */
int flesh_equations_freeze(flesh_equations *equations, const double *u);

/* Computes r(u) [n], constrained rows included; status > 0 where it has no value. */
int flesh_equations_residual(flesh_equations *equations, const double *u, double *r);
/* Computes the potential at u and the sum of its terms' absolute values. */
int flesh_equations_potential(flesh_equations *equations, const double *u, double *phi, double *magnitude);
/* Computes the potential, and caches the residual too, in one pass, if neither is known at u. */
int flesh_equations_evaluate(flesh_equations *equations, const double *u, double *phi, double *magnitude);
/* Assembles K at u with constraints applied; `filter` treats negative eigenvalues of elements. K may get a new pattern,
 * counted in `patterns`, where nodes have come near each other. */
int flesh_equations_assemble(flesh_equations *equations, const double *u, flesh_eigenvalue_filter filter);
/* Assembles M at x and v, without constraints, into K; drops the caches. */
int flesh_equations_assemble_mass(flesh_equations *equations, double t, const double *x, const double *v);
/* Turns the constrained rows and columns of K into those of the identity, scaled. */
void flesh_equations_constrain_matrix(flesh_equations *equations);

/* Saves what is known of the potential at u, where the stage ends. */
void flesh_equations_save_end(flesh_equations *equations, const double *u);
/* Whether everything that could limit steps is so far from the lagged state and from u that it has no influence. */
int flesh_equations_is_clear(flesh_equations *equations, const double *u);
/* Sets the free dofs of u to those of x [n]. */
void flesh_equations_take_free(const flesh_equations *equations, const double *x, double *u);
/* Whether no effect limits the straight step from the lagged state to u, nor its extension by the fraction `beyond`.
 * Overwrites `scratch`. */
int flesh_equations_is_feasible(flesh_equations *equations, const double *u, double beyond);
/* Corrects the free dofs of a guess u so that touching bodies keep their gaps. Overwrites `scratch`. */
void flesh_equations_keep_gaps(flesh_equations *equations, double *u);
/* Returns the feasible fraction of the step from one u, which has been evaluated in this stage, to another. Overwrites
 * `scratch`. */
double flesh_equations_max_feasible_step(flesh_equations *equations, const double *from, const double *to);

/* 2-norm of r [n] with the weights of residuals, as in the norms below. Overwrites `scratch`. */
double flesh_equations_norm(flesh_equations *equations, const double *r);
/* 2-norm of the applied load over the free dofs at u. Overwrites `scratch`. */
int flesh_equations_load_norm(flesh_equations *equations, const double *u, double *norm);
/* 2-norm of the change of the residual by round-off in x, v and a. Overwrites `scratch`. */
double flesh_equations_residual_round_off(flesh_equations *equations, const double *u);
/* Multiple of the measured round-off up to which a residual may be round-off; forces that bend soft parts may be only a few
 * times as large. */
#define FLESH_ROUND_OFF_LEAVES 4
/* Whether a residual of this norm at u, the point last evaluated, is at round-off. */
int flesh_equations_at_round_off(flesh_equations *equations, const double *u, double norm);
/* Change of the potential by the same round-off. */
double flesh_equations_potential_round_off(flesh_equations *equations, const double *u);
/* Finds whether the body at rest is so far from the origin that x lacks digits of its shape, alike on all ranks.
 * Collective. */
void flesh_equations_find_far_away(flesh_equations *equations);
/* Fills `relative` at u with positions relative to a node to full precision: u is added to exact differences. */
const double *flesh_equations_relative(flesh_equations *equations, const double *u);

#endif
