/* result.h: the figures of a run and result.json. */
#ifndef FLESH_RUN_RESULT_H
#define FLESH_RUN_RESULT_H

#include <jansson.h>

#include "flesh/skin.h"
#include "run/run_trace.h"
#include "system/system.h"

/* COUNT(member, what one step counts it as, key in result.json): sums over all steps, one that ended the run included.
 * `solves_at_rounding` and `solves_unconverged` ended above the tolerance but were accepted; `impact_steps` and
 * `damped_steps` are those of the internal ones that backward Euler or Runge-Kutta took in the method's stead. */
#define FLESH_FIGURES_COUNT_LIST(COUNT) \
  COUNT(internal_steps, steps, "internal_steps") \
  COUNT(rejected, rejected, "rejected_steps") \
  COUNT(convergence_failures, convergence_failures, "convergence_failures") \
  COUNT(impact_steps, impact_steps, "impact_steps") \
  COUNT(damped_steps, damped_steps, "damped_steps") \
  COUNT(residuals, residuals, "residuals") \
  COUNT(solves, solves, "solves") \
  COUNT(at_rounding, at_rounding, "solves_at_rounding") \
  COUNT(unconverged, unconverged, "solves_unconverged") \
  COUNT(multiplier_updates, multiplier_updates, "multiplier_updates") \
  COUNT(untanglings, untanglings, "untanglings") \
  COUNT(untangled_nodes, untangled_nodes, "untangled_nodes") \
  COUNT(newton, newton, "newton") \
  COUNT(linear, linear, "linear") \
  COUNT(linear_single, linear_single, "linear_single") \
  COUNT(direct, direct, "direct") \
  COUNT(assemblies, assemblies, "assemblies") \
  COUNT(projections, projections, "projections") \
  COUNT(backtracks, backtracks, "backtracks") \
  COUNT(subdomains, subdomains, "subdomains") \
  COUNT(subdomain_newton, subdomain_newton, "subdomain_newton") \
  COUNT(watchdog_steps, watchdog_steps, "watchdog_steps")
#define FLESH_FIGURES_MEMBER(member, of_step, key) long member;

/* Gathered by observing; zero-initialise, then open. NaN where nothing was observed. */
typedef struct flesh_figures {
  int steps;
  double t;
  double max_volume_drift;   /* max over time of |V/V_rest - 1| */
  double final_volume_drift; /* V/V_rest - 1 at the end, signed */
  double J_min;              /* over the run, at points of quadrature */
  double J_min_t;            /* when */
  double J_bound;            /* over the run, of J anywhere in a tet */
  int max_inverted, final_inverted; /* tets with J <= 0 at a point of quadrature: at a time at most, at the end */
  double first_inverted_t; /* first time with such a tet; NaN: never */
  FLESH_FIGURES_COUNT_LIST(FLESH_FIGURES_MEMBER)
  long unfinished_newton, unfinished_linear; /* of these, those of a step that ended the run */
  flesh_energy_balance balance; /* flesh_integrator_energy_balance */
  double residual, residual_target; /* of the last step */
  int effects;
  double stressed_rest; /* strain energy, J, at rest in a stressed state that no load holds; 0: not so */
  flesh_longest_step longest_step;
  flesh_separation separation; /* of bodies that overlapped at the start */
  double start_contact; /* energy of contacts at the start, J */
  double *energies; /* [effects] at the end, J, elasticity relative to rest */
  int probe_columns;
  double *probes; /* [FLESH_PROBE_FIGURES*probe_columns], as of flesh_probes_note; behind `energies` */
  double wall_s, cpu_s;
  long peak_memory_kB;
} flesh_figures;

int flesh_figures_open(flesh_figures *figures, const flesh_system *system, const flesh_scene *scene);
void flesh_figures_close(flesh_figures *figures); /* NULL-safe members */
int flesh_figures_observe(void *figures, const flesh_step_record *record);
/* Adds what a step that was not finished has taken. */
void flesh_figures_add_unfinished(flesh_figures *figures, const flesh_solve_stats *stats);

/* How a run ended. */
typedef struct flesh_outcome {
  int status, exit_code;
  char message[1200]; /* empty when fine */
  int has_failure;    /* a step failed: see `failure` and `advice` */
  flesh_failure failure;
  const char *advice;
  char warning[800]; /* what is to be known although nothing failed; empty: nothing */
  char notes[800];   /* what effects say of the run: what has broken; empty: nothing */
} flesh_outcome;

/* "complete", "failed", "interrupted", "out of budget". */
const char *flesh_outcome_word(const flesh_outcome *outcome);

/* Advice after a step failed in a motion with these figures. */
const char *flesh_failure_advice(const flesh_failure *failure, const flesh_scene *scene, const flesh_figures *figures);

/* The failure in a few lines on `stream`; the scene names bodies. */
void flesh_failure_print(FILE *stream, const flesh_outcome *outcome, const flesh_scene *scene);

/* Prints the surface that a skin has, and how it is bound, in a line or two. */
void flesh_skin_print(FILE *stream, const char *surface, const flesh_skin_info *info);

/* Whether stiff volume terms are taken out of the system's solves in the scene's steps, of the length that it asks for.
 * Collective where the system is of a rank. */
int flesh_takes_volumes_out(const flesh_scene *scene, const flesh_system *system);
/* Name of the kind that a scene's solves use, with the volume projection or not; NULL: a direct solver. */
const char *flesh_preconditioner_used(const flesh_scene *scene, int takes_volumes_out);

/* Constants of every material in force, as text or as a new array. */
void flesh_time_print(FILE *stream, const flesh_scene *scene);
void flesh_materials_print(FILE *stream, const flesh_scene *scene);
json_t *flesh_materials_json(const flesh_scene *scene);

/* The figures as a new object; `system` names the energies, and `scene` the probes. */
json_t *flesh_figures_json(const flesh_figures *figures, const flesh_system *system, const flesh_scene *scene);

/* Calls, memory and, if timed, time of every effect, as a new list and as a table. */
json_t *flesh_costs_json(const flesh_costs *costs, const flesh_system *system);
void flesh_costs_print(FILE *stream, const flesh_costs *costs, const flesh_system *system);

/* A new object of the outcome alone: status, exit_code, message, failure. */
json_t *flesh_outcome_json(const flesh_outcome *outcome);

#endif
