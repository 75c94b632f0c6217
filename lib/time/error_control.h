/* error_control.h: chooses the length of steps by their local error: how large it is, whether a step is accepted, how
 * long the next one is, and how exactly its stages are solved. Decides; solves no stage. */
#ifndef FLESH_TIME_ERROR_CONTROL_H
#define FLESH_TIME_ERROR_CONTROL_H

#include "base/archive.h"
#include "flesh/integrator.h"
#include "sundials/kinsol.h"
#include "time/momenta.h"
#include "time/part_weights.h"

/* Reason why a step was not accepted. */
typedef enum flesh_refusal {
  FLESH_REFUSED_BY_NOTHING,
  FLESH_REFUSED_BY_ERROR,
  FLESH_REFUSED_BY_ENERGY,
  FLESH_REFUSED_BY_SOLVE
} flesh_refusal;

enum { FLESH_GAINS_OF_REFUSAL = 8 }; /* gains by a step that is refused for its energy */

typedef struct flesh_error_control {
  int on;                         /* 0: nothing below is allocated or used */
  flesh_adaptive_options options;
  const flesh_system *system;     /* borrowed, as is the solver */
  flesh_nonlinear *nonlinear;
  int n;
  double *e, *force, *filtered;   /* [n] the error; room */
  uint8_t *touching;              /* [n/3] nodes that contact has pushed in a stage of the step */
  int touches;                    /* some do */
  double length, period, mass;    /* m; s, period of bending over 2 pi; kg */
  flesh_part_weights weights;     /* weights of errors for each part of the body */
  flesh_momenta momenta;          /* of free parts */
  double largest;                 /* largest weight in a step */
  double nodes;                   /* of the body */
  double rest, stiffness;         /* J, elastic energy at rest; lambda/mu of the stiffest material, at least 1 */
  double falls;                   /* power of h with which the estimate falls */
  double local;                   /* error of positions that a step may make, over the length */
  double impulses;                /* error of velocities by contact that a step may make, times the period over the length */
  flesh_refusal refusal;          /* result of the last attempt */
  double error;                   /* error of the last attempt, over the error allowed; NaN: not known */
  int swings;                     /* 1: the error would be far larger with what steps do not resolve */
  /* The memory between steps. */
  double h;                       /* s, length of the step to come; 0: not known */
  double before;                  /* error of the last step accepted, or 1 */
  double times;                   /* factor of an error as it adds up, in the last step judged: at least 1 */
  int first;                      /* no step has been accepted since a start */
  double refused_h, refused_error; /* of the attempt before, if its error was too large; else refused_h is 0 */
  int rejected, failed;           /* numbers of attempts since the last step that was accepted */
  int stands_in;                  /* the method's stand-in takes all steps until the next start */
  int gains;                      /* FLESH_GAINS_OF_REFUSAL for each step so refused, less 1 for each that was not */
} flesh_error_control;

/* Sets the options, without the other ranks. FLESH_ERR_MEMORY. */
int flesh_error_control_set(const flesh_adaptive_options *options, const flesh_system *system,
                            const flesh_rigid_parts *parts, flesh_nonlinear *nonlinear, flesh_error_control *control);
/* Measures the body if the options want control, once all ranks have set them. Collective. */
void flesh_error_control_measure(flesh_error_control *control);
void flesh_error_control_clear(flesh_error_control *control);
void flesh_error_control_archive(flesh_error_control *control, flesh_archive *archive);

/* Returns the energy of a vibration of the body as large as the error that the next step may make, J; of stiff parts
 * that fly, if the step's method has a stand-in (`swings`), that of a motion that goes as far meanwhile. */
double flesh_error_control_least_energy(const flesh_error_control *control, int swings);

/* Takes in that a motion starts, or continues otherwise than before, at the state with the acceleration a [n] (NULL:
 * not known). Collective, as all that follow. */
void flesh_error_control_start(flesh_error_control *control, const flesh_state *state, const double *a);
/* Returns a length of time, s, of at most h: if errors choose steps, at most the cube root of the tolerance times the
 * body's period over 2 pi, so that it falls with the tolerance. */
double flesh_error_control_brief(const flesh_error_control *control, double h);
/* Returns the length of the next step, of `left` s that remain: all of them, or less than half of them, or the wanted
 * length. */
double flesh_error_control_propose(const flesh_error_control *control, double left);
/* Takes in that a step of h begins at the state, by a method of that order, whose error must add up to the tolerance. */
void flesh_error_control_aim(flesh_error_control *control, int order, const flesh_state *state, double h);
/* Sets the residuals that stages to come, with this shift, may leave: those that make a part of the error allowed. */
void flesh_error_control_set_target(flesh_error_control *control, const flesh_shift *shift);
/* Returns whether stiff parts fly, touched by nothing. */
int flesh_error_control_flies(const flesh_error_control *control);
/* Returns the multiple of that residual by which friction at a stage may be off: it changes momenta, as impacts do. 1
 * if a stiff part flies on with the change. */
double flesh_error_control_slip(const flesh_error_control *control);
/* Returns whether steps are refused for their energy time and again, so that shorter ones do not help. */
int flesh_error_control_keeps_gaining(const flesh_error_control *control);
/* Returns whether a method that remembers accelerations should leave the steps to come to its stand-in. */
int flesh_error_control_misleads(const flesh_error_control *control);
/* Returns the change of volume that incompressible tets may be left with at a stage of that shift; `swings`: the
 * method's. */
double flesh_error_control_gap(const flesh_error_control *control, const flesh_shift *shift, int swings);
/* Takes in that a step begins: nothing touches in it so far. */
void flesh_error_control_clear_contact(flesh_error_control *control);
/* Takes in the forces of contact [n], N, of a stage of the step. */
void flesh_error_control_touch(flesh_error_control *control, const double *forces);
/* Judges the error in control->e [n] of a step of h whose last stage, with this shift, was the last one solved:
 * FLESH_REFUSED_BY_ERROR or _BY_NOTHING. `fixed` [n]: constrained dofs, whose error shows whether steps resolve their
 * motion. `momentum` [n]: h times the error of velocities; NULL: e is like that. Adds what the filter's solve took to
 * *stats. */
flesh_refusal flesh_error_control_judge(flesh_error_control *control, const uint8_t *fixed, const double *momentum,
                                        double h, const flesh_shift *shift, flesh_solve_stats *stats);
/* Judges the step once more, whose end `point` changes internal variables to `next`: the forces that this changes may
 * have been wrong for all of the step. FLESH_REFUSED_BY_ERROR or _BY_NOTHING. Overwrites control->e. */
flesh_refusal flesh_error_control_judge_change(flesh_error_control *control, const uint8_t *fixed, const flesh_point *point,
                                               const double *next, double h, const flesh_shift *shift,
                                               flesh_solve_stats *stats);
/* Returns the elastic energy of the body at x [n], J, less that at rest; NaN if it has none. */
double flesh_error_control_elastic(const flesh_error_control *control, const double *x);
/* Returns the energy, J, that one iteration with the matrix of the last stage would remove from the point, whose forces
 * do not balance its accelerations; NaN if not known. Overwrites control->force and ->filtered. */
double flesh_error_control_imbalance(flesh_error_control *control, const uint8_t *fixed, const flesh_point *point,
                                     flesh_solve_stats *stats);
/* Takes in that the steps to come are those of a method with longer steps for the same error, or with shorter ones. */
void flesh_error_control_change(flesh_error_control *control, int longer);
/* Takes in that a step of h has ended as control->refusal says, and finds the length of the next one. */
void flesh_error_control_learn(flesh_error_control *control, double h);

#endif
