/* result.h: the figures of a run, its outcome, and result.json. */
#ifndef FLESH_RUN_RESULT_H
#define FLESH_RUN_RESULT_H

#include <jansson.h>

#include "flesh/skin.h"
#include "run/run_trace.h"
#include "system/system.h"

/* COUNT(member, member of one step's statistics, key in result.json): sums over all steps, including one that ended the
 * run. `solves_at_rounding` and `solves_unconverged` count solves that ended above the tolerance but were accepted;
 * `impact_steps` and `damped_steps` count internal steps that backward Euler or Runge-Kutta took instead of the method. */
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

/* NUMBER(member, key in result.json): what is observed at the end of steps. */
#define FLESH_FIGURES_NUMBER_LIST(NUMBER) \
  NUMBER(t, "t_end") /* s */ \
  NUMBER(max_volume_drift, "max_volume_drift")     /* max over time of |V/V_rest - 1| */ \
  NUMBER(final_volume_drift, "final_volume_drift") /* V/V_rest - 1 at the end, with its sign */ \
  NUMBER(J_min, "J_min")     /* over the run, at points of quadrature */ \
  NUMBER(J_min_t, "J_min_t") /* when */ \
  NUMBER(J_bound, "J_bound") /* over the run, bound of J anywhere in a tet */
#define FLESH_FIGURES_NUMBER(member, key) double member;

/* The figures of a run, gathered by observing it; zero-initialise, then open. NaN where nothing was observed. */
typedef struct flesh_figures {
  int steps;
  FLESH_FIGURES_NUMBER_LIST(FLESH_FIGURES_NUMBER)
  int max_inverted, final_inverted; /* number of tets with J <= 0 at a point of quadrature: largest at any time; at the end */
  double first_inverted_t; /* first time with such a tet; NaN: never */
  FLESH_FIGURES_COUNT_LIST(FLESH_FIGURES_MEMBER)
  long unfinished_newton, unfinished_linear; /* the part of these that belongs to a step that ended the run */
  flesh_energy_balance balance; /* flesh_integrator_energy_balance */
  double residual, residual_target; /* of the last step */
  int effects;
  double stressed_rest; /* strain energy, J, of a body at rest in a stressed state that no load holds; 0: it is not */
  flesh_longest_step longest_step;
  flesh_separation separation; /* of bodies that overlapped at the start */
  double start_contact; /* energy of contacts at the start, J */
  double *energies; /* [effects] at the end, J; elasticity relative to rest */
  int probe_columns;
  double *probes; /* [FLESH_PROBE_FIGURES*probe_columns], as in flesh_probes_note; stands behind `energies` */
  double wall_s, cpu_s;
  long peak_memory_kB;
} flesh_figures;

int flesh_figures_open(flesh_figures *figures, const flesh_system *system, const flesh_scene *scene);
void flesh_figures_close(flesh_figures *figures); /* NULL-safe members */
int flesh_figures_observe(void *figures, const flesh_step_record *record);
/* Adds the statistics of a step that was not finished. */
void flesh_figures_add_unfinished(flesh_figures *figures, const flesh_solve_stats *stats);

/* How a run ended. */
typedef struct flesh_outcome {
  int status, exit_code;
  char message[1200]; /* empty when fine */
  int has_failure;    /* a step failed: see `failure` and `advice` */
  flesh_failure failure;
  const char *advice;
  char warning[800]; /* what the user should know although nothing failed; "": nothing */
  char notes[800];   /* what effects report of the run, such as what broke; "": nothing */
} flesh_outcome;

/* Returns "complete", "failed", "interrupted" or "out of budget". */
const char *flesh_outcome_word(const flesh_outcome *outcome);

/* Returns advice for a step that failed, in a run with these figures. */
const char *flesh_failure_advice(const flesh_failure *failure, const flesh_scene *scene, const flesh_figures *figures);

/* Prints the failure in a few lines on `stream`; the scene gives the names of bodies. */
void flesh_failure_print(FILE *stream, const flesh_outcome *outcome, const flesh_scene *scene);

/* Prints the surface of a skin, and how it is bound, in a line or two. */
void flesh_skin_print(FILE *stream, const char *surface, const flesh_skin_info *info);

/* Print the settings of time, and the constants in force of every material; return the latter as a new array. */
void flesh_time_print(FILE *stream, const flesh_scene *scene);
void flesh_materials_print(FILE *stream, const flesh_scene *scene);
json_t *flesh_materials_json(const flesh_scene *scene);

/* Returns the figures as a new object; `system` gives the names of energies, and `scene` those of probes. */
json_t *flesh_figures_json(const flesh_figures *figures, const flesh_system *system, const flesh_scene *scene);

/* Return, or print as a table, the calls, the memory and, if timed, the time of every effect; the list is new. */
json_t *flesh_costs_json(const flesh_costs *costs, const flesh_system *system);
void flesh_costs_print(FILE *stream, const flesh_costs *costs, const flesh_system *system);

/* Returns a new object of the outcome alone: status, exit_code, message, failure. */
json_t *flesh_outcome_json(const flesh_outcome *outcome);

#endif
