/* error_control.h: steps whose length a local error chooses: how large it is, whether a step is accepted, how long the next
 * one is, and how exactly its stages are solved. Decides; solves no stage. */
#ifndef FLESH_TIME_ERROR_CONTROL_H
#define FLESH_TIME_ERROR_CONTROL_H

#include "base/archive.h"
#include "flesh/integrator.h"
#include "sundials/kinsol.h"
#include "time/part_weights.h"

/* Why a step was not accepted. */
typedef enum flesh_refusal {
  FLESH_REFUSED_BY_NOTHING,
  FLESH_REFUSED_BY_ERROR,
  FLESH_REFUSED_BY_ENERGY,
  FLESH_REFUSED_BY_SOLVE
} flesh_refusal;

typedef struct flesh_error_control {
  int on;                         /* else nothing below is allocated or used */
  flesh_adaptive_options options;
  const flesh_system *system;     /* borrowed, as is the solver */
  flesh_nonlinear *nonlinear;
  int n;
  double *e, *force, *filtered;   /* [n] the error; room */
  uint8_t *touching;              /* [n/3] nodes that contact has pushed in a stage of the step */
  int touches;                    /* some do */
  double length, period, mass;    /* m, s over 2 pi of bending, kg */
  flesh_part_weights weights;     /* how often errors of each of its parts count */
  double largest;                 /* of the weights of a step */
  double nodes;                   /* of the body */
  double rest, stiffness;         /* J, its elastic energy at rest; lambda/mu of its stiffest material, at least 1 */
  double falls;                   /* the power of h with which the estimate falls */
  double local;                   /* the error of positions that a step may make, over the length */
  double impulses;                /* and that of velocities, which contact makes, times the period */
  flesh_refusal refusal;          /* of the last attempt */
  double error;                   /* of that, over what it may be; NaN: not known */
  int swings;                     /* it would be far larger, were it not for what steps do not resolve */
  /* The memory between steps. */
  double h;                       /* s, of the step to come; 0: not known */
  double before;                  /* the error of the last step accepted, or 1 */
  double times;                   /* that an error of the last step that was judged counts, as it adds up: at least 1 */
  int first;                      /* no step has been accepted since a start */
  double refused_h, refused_error; /* of the attempt before, where its error was too large; else refused_h is 0 */
  int rejected, failed;           /* attempts since the last step that was accepted */
  int stands_in;                  /* the method's stand-in takes all steps until the next start */
  int gains;                      /* 8 for each step that was refused for its energy, less 1 for each that was not */
} flesh_error_control;

/* Takes the options, without the other ranks. FLESH_ERR_MEMORY. */
int flesh_error_control_set(const flesh_adaptive_options *options, const flesh_system *system,
                            const flesh_rigid_parts *parts, flesh_nonlinear *nonlinear, flesh_error_control *control);
/* Measures the body where the options want control, once all ranks have taken them. Collective. */
void flesh_error_control_measure(flesh_error_control *control);
void flesh_error_control_clear(flesh_error_control *control);
void flesh_error_control_archive(flesh_error_control *control, flesh_archive *archive);

/* The energy of a vibration of the body as large as the error that the next step may make, J; of stiff parts that fly, where the
 * step's method has a stand-in (`swings`), that of a motion which goes as far meanwhile. */
double flesh_error_control_least_energy(const flesh_error_control *control, int swings);

/* A motion starts, or goes on otherwise than before, at the state with the acceleration a [n] (NULL: not known). Collective,
 * as all that follow. */
void flesh_error_control_start(flesh_error_control *control, const flesh_state *state, const double *a);
/* A length of time, s, of at most h: where errors choose steps, at most the cube root of the tolerance of the body's period
 * over 2 pi, so that it falls with the tolerance. */
double flesh_error_control_brief(const flesh_error_control *control, double h);
/* How long the next step is, of `left` s that are to be gone: all of them, or less than half of them, or what is wanted. */
double flesh_error_control_propose(const flesh_error_control *control, double left);
/* A step of h comes from the state, whose error is to add up to the tolerance, by a method of that order. */
void flesh_error_control_aim(flesh_error_control *control, int order, const flesh_state *state, double h);
/* Stages to come, with this shift, may leave such residuals as make a part of the error allowed. */
void flesh_error_control_set_target(flesh_error_control *control, const flesh_shift *shift);
/* So many times that residual friction at a stage may be off by: it changes momenta, as impacts do. 1 where a stiff part flies
 * on with what it changes. */
double flesh_error_control_slip(const flesh_error_control *control);
/* Whether steps are refused for their energy time and again: shorter ones do not help. */
int flesh_error_control_keeps_gaining(const flesh_error_control *control);
/* Whether a method that remembers accelerations should leave the steps to come to its stand-in. */
int flesh_error_control_misleads(const flesh_error_control *control);
/* The change of volume that incompressible tets may be left with at a stage of that shift; `swings`: of the method. */
double flesh_error_control_gap(const flesh_error_control *control, const flesh_shift *shift, int swings);
/* A step begins: nothing touches in it so far. */
void flesh_error_control_clear_contact(flesh_error_control *control);
/* Forces of contact [n], N, of a stage of the step. */
void flesh_error_control_touch(flesh_error_control *control, const double *forces);
/* Judges the error in control->e [n] of a step of h whose last stage, with this shift, was solved last:
 * FLESH_REFUSED_BY_ERROR or _BY_NOTHING. `fixed` [n]: constrained dofs, whose error shows whether steps resolve their
 * motion. Adds to *stats what the filter's solve took. */
flesh_refusal flesh_error_control_judge(flesh_error_control *control, const uint8_t *fixed, double h,
                                        const flesh_shift *shift, flesh_solve_stats *stats);
/* Judges the step once more, whose end `point` changes internal variables to `next`: forces that are others from there on
 * may have been so for all of the step. FLESH_REFUSED_BY_ERROR or _BY_NOTHING. Overwrites control->e. */
flesh_refusal flesh_error_control_judge_change(flesh_error_control *control, const uint8_t *fixed, const flesh_point *point,
                                               const double *next, double h, const flesh_shift *shift,
                                               flesh_solve_stats *stats);
/* The elastic energy of the body at x [n], J, less that at rest; NaN where it has none. */
double flesh_error_control_elastic(const flesh_error_control *control, const double *x);
/* The energy, J, that one iteration from the point, of which forces do not balance with its accelerations, would take, by the
 * matrix of the last stage; NaN where that is not known. Overwrites control->force and ->filtered. */
double flesh_error_control_imbalance(flesh_error_control *control, const uint8_t *fixed, const flesh_point *point,
                                     flesh_solve_stats *stats);
/* The steps to come are those of a method with longer steps for the same error, or with shorter ones. */
void flesh_error_control_change(flesh_error_control *control, int longer);
/* A step of h has ended as control->refusal says. Finds the next one's length. */
void flesh_error_control_learn(flesh_error_control *control, double h);

#endif
