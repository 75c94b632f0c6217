/* problem.h: a stage of an integrator as equations r(u) = 0 on plain arrays; what the SUNDIALS callbacks,
 * the linear solver and the integrators share. */
#ifndef FLESH_SUNDIALS_PROBLEM_H
#define FLESH_SUNDIALS_PROBLEM_H

#include <stdint.h>

#include "base/parts.h"
#include "flesh/kinsol.h"
#include "sparse/direct.h"
#include "sparse/linear.h"
#include "sparse/scalar_view.h"
#include "system/placed.h"

struct flesh_problem {
  flesh_problem *self; /* first, see vector.h */
  const flesh_system *system;
  flesh_solver_options options;
  int n; /* unknowns */
  flesh_stage stage;
  uint8_t *fixed;      /* [n] */
  int *held, held_count; /* [n] the numbers of those that are */
  int *fixed_rows, fixed_row_count; /* [n/3] the rows of K that know of any */
  double *u_fixed;     /* [n] values of the fixed unknowns; 0 elsewhere */
  double fixed_scale;  /* typical stiffness, of the constrained rows */
  float *inertia;      /* [n] diagonal of the mass matrix; NULL: it is not asked for */
  double *x, *v, *a;   /* [n] the point last evaluated */
  flesh_block_matrix *K;
  const flesh_linear *linear;
  flesh_preconditioner_data *preconditioner;
  flesh_pcg_space *pcg;
  flesh_direct *direct;
  flesh_direct *rescue;   /* of linear solves that PCG cannot end; NULL: none was needed, or it would be too dear */
  int stalled;            /* PCG could not end one of the stage; -1: of any, and a factorisation is too dear */
  flesh_threads *threads;
  flesh_scalar_view view; /* made when a sparse SUNMatrix is first filled */
  double *work;           /* [4*n] of the linear solver */
  double *step;           /* [n] trial of the line search */
  double *gradient;       /* [n] residual at the linear solve */
  /* Caches, valid where `known`; compared by value, because KINSOL forms its iterates itself. */
  struct {
    int known;
    double *u, *r; /* [n] */
  } residual;
  struct {
    int known;
    int with_residual; /* at the residual's u, not at this one */
    double *u;         /* [n] */
    double value, magnitude;
    flesh_placed placed; /* its part of positions alone */
  } potential;
  /* That part where a stage with shift.x = 1 has ended, and mostly the next one starts. */
  struct {
    flesh_placed there;
    double *x; /* [n] */
  } reached;
  double *u_matrix;      /* [n] where K was assembled, or is used as if */
  double *rest;          /* [n] zeros: the lagged velocities where the stage has none */
  int projected;         /* whether K is */
  int kept;              /* K is that of an earlier iterate of the stage: its factor serves, too */
  int solved;            /* K is that of the last solve by PCG */
  int filtered;          /* how its elements' negative eigenvalues are treated, a flesh_projected */
  /* A change w [n] of u that lowers the potential where few nodes carry the residual r at u; else no FLESH_OK. NULL:
   * none is asked for. */
  int (*patch)(flesh_problem *problem, const double *u, const double *r, double *w);
  /* PCG's iterations per tenfold reduction with the preconditioner when it was new, of solves by few tenfolds and by
   * many (0: not known), and how many more than that the solves since then have taken in all. */
  double paces[2], lost;
  flesh_shift factored; /* what the preconditioner was made for */
  int single;           /* then K was one that PCG may round to single precision */
  /* Of matrices kept: the last departure from what a new K foretold, over the square of the residual before (0: not
   * known); how many times as large as foretold departures from a kept one may be; what the next was foretold to be. */
  double bend, softness, next_departure;
  /* In how many stages before this one K was last assembled (-1: it is none of theirs), and how far residuals departed
   * from what it foretold for each of these, over the residual before (0: not known). */
  int age;
  double drift;
  int goes_on;          /* the next stage goes on smoothly from this one: the preconditioner may serve there, too */
  int zeroed;            /* SUNDIALS wants the SUNMatrix to be 0 until the next assembly; K itself is left alone */
  int beyond;            /* PCG's last step went downhill along negative curvature */
  int follow;            /* negative curvature is to be followed, not projected away */
  int (*stop)(void *data); /* NULL: not asked */
  void *stop_data;
  int stopped;           /* what it answered; FLESH_OK: go on */
  int shortened;         /* the last guarded step of the stage was not its first try */
  int creeping;          /* how many of the last guarded steps in a row were filtered, whole and too short */
  double cut;            /* the last guarded step's share of its first try; 1: it was not cut */
  /* Of steps beyond what cuts them: cuts of the stage, cuts to let pass before the next try and after the next that
   * fails, and how long a step beyond may be (2-norm; 0: not known). */
  int cuts, pause, next_pause;
  double stride;
  double model_ratio;    /* actual over foretold decrease of the last guarded step; NaN: not known */
  double target;         /* of the nonlinear solve, N; 0: not known */
  double previous_norm;  /* of the residual at the linear solve before this one of the same stage; 0 at first */
  double smallest_norm;  /* of the residuals at the linear solves of the stage; 0 at first */
  double first_potential; /* of the stage's first guarded iterate; NaN before */
  int refused;           /* status of the last residual that had no value in this stage; 0: none */
  int at_rounding;       /* the last solve stopped because its residual is at rounding */
  flesh_solve_stats stats;
  flesh_costs *costs;    /* borrowed; NULL: nobody counts */
};

/* r(u) [n], constraint rows included; status > 0 when it has no value. */
int flesh_problem_residual(flesh_problem *problem, const double *u, double *r);
/* Potential at u and the sum of its terms' absolute values. */
int flesh_problem_potential(flesh_problem *problem, const double *u, double *phi, double *magnitude);
/* The same; where neither potential nor residual at u is known, both become so in one pass. */
int flesh_problem_evaluate(flesh_problem *problem, const double *u, double *phi, double *magnitude);
/* Works out the fixed dofs at t; whether they are others than before. */
int flesh_problem_find_fixed(flesh_problem *problem, double t);
/* Turns the rows and columns of the fixed dofs of K into those of the identity, scaled. */
void flesh_problem_fix_matrix(flesh_problem *problem);
/* Remembers what is known at u, where the stage ends: of the potential, and of how an older K has served. */
void flesh_problem_reach(flesh_problem *problem, const double *u);
/* Whether nothing bars the straight way from the lagged state to u. */
int flesh_problem_reaches(flesh_problem *problem, const double *u);
/* Changes the free dofs of u so that nothing does; FLESH_UNDEFINED where the others are in the way. */
int flesh_problem_clear(flesh_problem *problem, double *u);
/* The share of the way from one u to another that nothing bars. Overwrites `work`. */
double flesh_problem_way(flesh_problem *problem, const double *from, const double *to);
/* Assembles K at u with constraints applied; `project` where the elements must be positive semi-definite, by the
 * filter that the options and the last step's success call for. */
int flesh_problem_assemble(flesh_problem *problem, const double *u, int project);
/* Whether K, assembled at an earlier iterate of this stage or of one that it goes on from, serves at u, too, where the
 * residual is as given: as little as residuals differ from what K foretells, steps with it end at the target as soon as
 * with a new one, or by one more. Then it counts as assembled there. */
int flesh_problem_keep_matrix(flesh_problem *problem, const double *u, const double *residual);
/* Prepares the linear solver for K. */
int flesh_problem_factor(flesh_problem *problem);
/* The acceleration a [3*n] with r(t, x, v, a) = 0 over the free dofs; those constrained at t keep the a they come with.
 * Overwrites K and the caches. Status > 0 when there is none. */
int flesh_problem_acceleration(flesh_problem *problem, double t, const double *x, const double *v,
                               double *a);
/* The constrained dofs of x and v [3*n] take their prescribed values (read there only); a jump du_c moves the free ones
 * by M_ff du_f = -M_fc du_c, the limit of a short step: nothing with lumped mass. Overwrites K and the caches. */
int flesh_problem_take_up(flesh_problem *problem, double t, const double *x_prescribed,
                          const double *v_prescribed, double *x, double *v);
/* Whether J is the view of the problem's K, of flesh_sunmatrix_create. */
int flesh_problem_owns_matrix(const flesh_problem *problem, SUNMatrix J);
/* 2-norm of the applied load over the free dofs at u. */
int flesh_problem_load_norm(flesh_problem *problem, const double *u, double *norm);
/* 2-norm of how far rounding of x, v and a moves the residual. */
double flesh_problem_rounding(flesh_problem *problem, const double *u);
/* How far it moves the potential. */
double flesh_problem_potential_rounding(flesh_problem *problem, const double *u);
size_t flesh_problem_memory(const flesh_problem *problem);

/* Scales the Newton step p [n] at u, where the residual is r, so that the potential falls (Armijo). FLESH_OK;
 * FLESH_NOT_POSITIVE when p is no descent direction; FLESH_NOT_CONVERGED when no scale serves. */
int flesh_guard_step(flesh_problem *problem, const double *u, const double *r, double *p);

#endif
