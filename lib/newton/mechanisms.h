/* mechanisms.h: the mechanisms of a solve and of its recovery, one row each: the bit of flesh_technique, its name in a
 * scene, and a description. Each can be switched off (solver.techniques), and `flesh hardcases --ablation` measures what it
 * is worth. All are on by default. */
#ifndef FLESH_NEWTON_MECHANISMS_H
#define FLESH_NEWTON_MECHANISMS_H

#include "flesh/solver.h"

/* Rows in the order of the bits. */
#define FLESH_MECHANISM_ROWS(ROW)                                                                                    \
  ROW(NEGATIVE_CURVATURE, "negative_curvature",                                                                      \
      "directions of negative curvature of the true Hessian are followed downhill after a filtered step "            \
      "that was too short where few nodes carry the residual (pcg, and a filter that is not -always)")               \
  ROW(NONLINEAR_ELIMINATION, "nonlinear_elimination",                                                                \
      "after a step that was not predicted, the few nodes that carry the residual are solved for alone, "            \
      "unless contact acts on them (line_search: potential)")                                                        \
  ROW(WATCHDOG, "watchdog",                                                                                          \
      "a longer step, with Newton steps from there, is tried where straight steps are cut, and taken if the "        \
      "potential ends lower (line_search: potential)")                                                               \
  ROW(UNTANGLE, "untangle",                                                                                          \
      "tets that rest inverted, collapsed or wound around an edge, though no load holds them, are led out "          \
      "through the equilibrium of softer materials if the potential falls")                                          \
  ROW(LONGER_STEPS, "longer_steps",                                                                                  \
      "steps that gain more than predicted are lengthened")                                                          \
  ROW(SOFTENED_STEPS, "softened_steps",                                                                              \
      "a step of a tangled body is solved with softer materials first")                                              \
  ROW(VOLUME_ARCS, "volume_arcs",                                                                                    \
      "steps of nearly incompressible tet10-mean are corrected to second order in volumes")                          \
  ROW(KEPT_MATRICES, "kept_matrices",                                                                                \
      "a matrix is kept within a step while it predicts residuals")                                                  \
  ROW(MATRICES_ACROSS_STEPS, "matrices_across_steps",                                                                \
      "a matrix is kept for the first iteration of the next steps")                                                  \
  ROW(KEPT_PRECONDITIONERS, "kept_preconditioners",                                                                  \
      "a preconditioner is kept until its age has cost as much as a new one")                                        \
  ROW(FORCING_TERMS, "forcing_terms",                                                                                \
      "linear tolerances follow the rate of convergence")                                                            \
  ROW(SINGLE_PRECISION, "single_precision",                                                                          \
      "pcg multiplies with a matrix in single precision where inertia hides its round-off")                          \
  ROW(BALANCED_TARGET, "balanced_target",                                                                            \
      "newton_tolerance is relative to the forces at the solution where the first residual is larger than "          \
      "all of them")                                                                                                 \
  ROW(APPROXIMATE_WOLFE, "approximate_wolfe",                                                                        \
      "slopes judge a step where round-off hides the decrease of the potential")                                     \
  ROW(DIRECT_FALLBACK, "direct_fallback",                                                                            \
      "a sparse factorisation solves where pcg would cost more")                                                     \
  ROW(EXTRAPOLATION, "extrapolation",                                                                                \
      "a step's first iterate continues the steps before it")                                                        \
  ROW(RIGID_GUESS, "rigid_guess",                                                                                    \
      "a free body's first iterate continues its rigid motion")

/* Names in the order of the bits, ended by NULL. */
extern const char *const flesh_mechanism_names[];

/* Whether the options switch the technique on. */
static inline int flesh_uses(const flesh_solver_options *options, flesh_technique technique)
{
  return (options->techniques & (unsigned)technique) != 0;
}

#endif
