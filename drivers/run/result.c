/* result.c: gathers the figures of a run and says how it ended, in words and as JSON. */
#include "run/result.h"

#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "base/text.h"
#include "material/form.h"
#include "cli/json_memory.h"
#include "output/resume.h"

int flesh_figures_open(flesh_figures *figures, const flesh_system *system, const flesh_scene *scene)
{
  int probes;
  const flesh_probe *probe = flesh_scene_probes(scene, &probes);
  flesh_probe_column columns[FLESH_PROBE_COLUMNS];
#define UNKNOWN(member, key) .member = NAN,
  *figures = (flesh_figures){FLESH_FIGURES_NUMBER_LIST(UNKNOWN)
                             .first_inverted_t = NAN,
                             .residual = NAN,
                             .residual_target = NAN,
                             .wall_s = NAN,
                             .cpu_s = NAN,
                             .longest_step = {.t = NAN, .ratio = NAN},
                             .effects = flesh_system_effect_count(system)};
#undef UNKNOWN
  for (int k = 0; k < probes; k++) figures->probe_columns += flesh_probe_columns(&probe[k], columns);
  const int count = figures->effects + FLESH_PROBE_FIGURES * figures->probe_columns;
  figures->energies = malloc(sizeof(double) * ((size_t)count + 1));
  if (!figures->energies) return flesh_no_memory();
  for (int k = 0; k < count; k++) figures->energies[k] = NAN;
  figures->probes = figures->energies + figures->effects;
  return FLESH_OK;
}

void flesh_figures_close(flesh_figures *figures)
{
  free(figures->energies);
  figures->energies = figures->probes = NULL;
}

static void add_counts(flesh_figures *figures, const flesh_solve_stats *stats)
{
#define ADD(member, of_step, key) figures->member += stats->of_step;
  FLESH_FIGURES_COUNT_LIST(ADD)
#undef ADD
}

void flesh_figures_add_unfinished(flesh_figures *figures, const flesh_solve_stats *stats)
{
  add_counts(figures, stats);
  figures->unfinished_newton = stats->newton;
  figures->unfinished_linear = stats->linear;
  if (stats->solves > 0) {
    figures->residual = stats->residual_last;
    figures->residual_target = stats->residual_target;
  }
}

int flesh_figures_observe(void *data, const flesh_step_record *record)
{
  flesh_figures *figures = data;
  const flesh_solve_stats *stats = record->stats;
  figures->steps = record->step;
  figures->t = record->state->t;
  figures->final_volume_drift = record->volume / record->rest_volume - 1;
  figures->max_volume_drift = fmax(figures->max_volume_drift, fabs(figures->final_volume_drift));
  if (!(figures->J_min <= record->J_min)) {
    figures->J_min = record->J_min;
    figures->J_min_t = record->state->t;
  }
  if (!(figures->J_bound <= record->J_bound)) figures->J_bound = record->J_bound;
  figures->final_inverted = record->inverted;
  if (record->inverted > figures->max_inverted) figures->max_inverted = record->inverted;
  if (record->inverted && isnan(figures->first_inverted_t))
    figures->first_inverted_t = record->state->t;
  add_counts(figures, stats);
  if (record->step) {
    figures->residual = stats->residual_last;
    figures->residual_target = stats->residual_target;
  }
  for (int e = 0; e < figures->effects; e++) {
    figures->energies[e] = record->energies[e] - record->rest_energies[e];
    if (!record->step && flesh_system_effect(record->system, e)->operations->role == FLESH_ROLE_CONTACT)
      figures->start_contact += figures->energies[e];
  }
  return FLESH_OK;
}

const char *flesh_outcome_word(const flesh_outcome *outcome)
{
  return outcome->status == FLESH_OK                ? "complete"
         : outcome->status == FLESH_ERR_INTERRUPTED ? "interrupted"
         : outcome->status == FLESH_ERR_BUDGET      ? "out of budget"
                                                    : "failed";
}

void flesh_skin_print(FILE *stream, const char *surface, const flesh_skin_info *info)
{
  fprintf(stream, "skin: %s, %d vertices, ", surface, info->vertices);
  if (!info->outside) fprintf(stream, "all inside the body\n");
  else
    fprintf(stream,
            "%d outside the body, at most by %.3g m (vertex %d); they are extrapolated, the least weight is %.3g\n",
            info->outside, info->distance_max, info->farthest, info->weight_min);
}

void flesh_time_print(FILE *stream, const flesh_scene *scene)
{
  const flesh_scene_time *time = flesh_scene_times(scene);
  const char *name = flesh_method_name(time->method);
  if (time->method == FLESH_METHOD_STATIC)
    fprintf(stream, "time: statics, %s\n",
            flesh_system_moves(flesh_scene_system(scene)) ? "a sequence of equilibria" : "one equilibrium");
  else if (time->adaptive.control || time->method == FLESH_METHOD_IDA)
    fprintf(stream, "time: %s, steps by its error (tolerance %g), states every %g s to %g s\n", name,
            time->adaptive.tolerance, time->step, time->end);
  else fprintf(stream, "time: %s, steps of %g s to %g s\n", name, time->step, time->end);
}

void flesh_materials_print(FILE *stream, const flesh_scene *scene)
{
  const flesh_material *materials = flesh_scene_body(scene)->materials;
  for (int m = 0; materials && m < flesh_scene_material_count(scene); m++) {
    double mu = NAN, lambda = NAN, stress = NAN; /* at small strain; NaN where it has none */
    flesh_material_small_strain(&materials[m], &mu, &lambda, &stress);
    fprintf(stream, "material %d: %s (%s), mu %g Pa, lambda %g Pa", m,
            flesh_energy_name(materials[m].energy), flesh_constants_name(materials[m].constants),
            materials[m].mu, materials[m].lambda);
    if (materials[m].alpha != 1)
      fprintf(stream, ", alpha %g", materials[m].alpha);
#define FORM_CONSTANT(FORM, name, ...)                                                                                 \
  if (materials[m].energy == FLESH_ENERGY_##FORM) fprintf(stream, ", " #name " %g", materials[m].name);
    FLESH_FORM_CONSTANT_LIST(FORM_CONSTANT)
#undef FORM_CONSTANT
    fprintf(stream, "; small strain: young %g Pa, poisson %g", flesh_young_of_lame(mu, lambda),
            flesh_poisson_of_lame(mu, lambda));
    if (fabs(stress) > 1e-9 * fabs(mu)) fprintf(stream, ", rest stress %g Pa", stress);
    putc('\n', stream);
  }
}

static void set(json_t *object, const char *key, double value)
{
  json_object_set_new(object, key, flesh_json_number(value));
}

static void set_integer(json_t *object, const char *key, long value)
{
  json_object_set_new(object, key, json_integer(value));
}

json_t *flesh_materials_json(const flesh_scene *scene)
{
  json_t *array = json_array();
  const flesh_material *materials = flesh_scene_body(scene)->materials;
  for (int m = 0; materials && m < flesh_scene_material_count(scene); m++) {
    double mu = NAN, lambda = NAN, stress = NAN; /* at small strain; NaN where it has none */
    flesh_material_small_strain(&materials[m], &mu, &lambda, &stress);
    json_t *row = json_pack("{ss ss}", "energy", flesh_energy_name(materials[m].energy), "constants",
                            flesh_constants_name(materials[m].constants));
    set(row, "mu", materials[m].mu);
    set(row, "lambda", materials[m].lambda);
    set(row, "alpha", materials[m].alpha);
#define FORM_CONSTANT(FORM, name, ...) if (materials[m].energy == FLESH_ENERGY_##FORM) set(row, #name, materials[m].name);
    FLESH_FORM_CONSTANT_LIST(FORM_CONSTANT)
#undef FORM_CONSTANT
    set(row, "small_strain_mu", mu);
    set(row, "small_strain_lambda", lambda);
    set(row, "small_strain_young", flesh_young_of_lame(mu, lambda));
    set(row, "small_strain_poisson", flesh_poisson_of_lame(mu, lambda));
    set(row, "rest_stress", stress);
    json_array_append_new(array, row);
  }
  return array;
}

/* Returns the energies by effect; effects with the same name are numbered from 2. */
static json_t *energies_json(const flesh_figures *figures, const flesh_system *system)
{
  json_t *energies = json_object();
  double total = 0;
  for (int e = 0; e < figures->effects; e++) {
    char key[80];
    const flesh_effect_operations *operations = flesh_system_effect(system, e)->operations;
    if (!operations->energy) continue; /* a dissipative effect has no energy */
    snprintf(key, sizeof key, "%s", operations->name);
    for (int n = 2; json_object_get(energies, key); n++) snprintf(key, sizeof key, "%.60s_%d", operations->name, n);
    set(energies, key, figures->energies[e]);
    total += figures->energies[e];
  }
  set(energies, "total", total);
  return energies;
}

/* Returns an object "tip.position_z": {"unit", "final", "min", "max"} for every column of probes.csv. */
static json_t *probes_json(const flesh_figures *figures, const flesh_scene *scene)
{
  json_t *object = json_object();
  int probes;
  const flesh_probe *probe = flesh_scene_probes(scene, &probes);
  const double *of = figures->probes;
  for (int k = 0; k < probes; k++) {
    flesh_probe_column columns[FLESH_PROBE_COLUMNS];
    const int count = flesh_probe_columns(&probe[k], columns);
    for (int c = 0; c < count; c++, of += FLESH_PROBE_FIGURES) {
      char *name = flesh_text_new("%s.%s", probe[k].name, columns[c].name);
      json_t *row = json_pack("{s:s, s:o, s:o, s:o}", "unit", columns[c].unit, "final", flesh_json_number(of[0]), "min",
                              flesh_json_number(of[1]), "max", flesh_json_number(of[2]));
      json_object_set_new(object, name ? name : "", row);
      free(name);
    }
  }
  return object;
}

json_t *flesh_figures_json(const flesh_figures *figures, const flesh_system *system, const flesh_scene *scene)
{
  json_t *object = json_object();
  double steps = figures->steps, newton = (double)figures->newton;
  set_integer(object, "steps", figures->steps);
#define SET(member, key) set(object, key, figures->member);
  FLESH_FIGURES_NUMBER_LIST(SET)
#undef SET
  set_integer(object, "max_inverted", figures->max_inverted);
  set_integer(object, "final_inverted", figures->final_inverted);
  set(object, "first_inverted_t", figures->first_inverted_t);
  const flesh_energy_balance *balance = &figures->balance;
  set(object, "work_put_in", balance->begun ? balance->supplied : NAN);
  set(object, "energy_released", balance->released);
  set(object, "energy_gain", balance->begun ? balance->gain : NAN);
  set(object, "energy_gain_J", balance->begun ? balance->largest : NAN);
  set(object, "energy_gain_t", balance->gain > 0 ? balance->t_largest : NAN);
  set(object, "stressed_rest_J", figures->stressed_rest);
  if (figures->separation.begun) {
    set_integer(object, "intersecting_at_start", figures->separation.begun);
    set_integer(object, "intersecting_at_end", figures->separation.ignored);
    set(object, "apart_t", figures->separation.t_apart);
  }
  set_integer(object, "longest_step", figures->longest_step.step);
  set_integer(object, "longest_step_newton", figures->longest_step.newton);
  set_integer(object, "longest_step_linear", figures->longest_step.linear);
  set_integer(object, "longest_step_cuts", figures->longest_step.cuts);
  set(object, "longest_step_over_median", figures->longest_step.ratio);
#define SET(member, of_step, key) set_integer(object, key, figures->member);
  FLESH_FIGURES_COUNT_LIST(SET)
#undef SET
  set_integer(object, "unfinished_newton", figures->unfinished_newton);
  set_integer(object, "unfinished_linear", figures->unfinished_linear);
  set(object, "newton_per_step", (newton - (double)figures->unfinished_newton) / steps);
  set(object, "linear_per_newton", (double)figures->linear / newton);
  set(object, "residual", figures->residual);
  set(object, "residual_target", figures->residual_target);
  json_object_set_new(object, "energies", energies_json(figures, system));
  if (figures->probe_columns) json_object_set_new(object, "probes", probes_json(figures, scene));
  set(object, "wall_s", figures->wall_s);
  set(object, "cpu_s", figures->cpu_s);
  set_integer(object, "peak_memory_kB", figures->peak_memory_kB);
  return object;
}

json_t *flesh_costs_json(const flesh_costs *costs, const flesh_system *system)
{
  json_t *array = json_array();
  for (int e = 0; e < flesh_system_effect_count(system); e++) {
    const flesh_effect_cost *cost = &costs->effects[e];
    const size_t bytes = flesh_system_effect_memory(system, e);
    json_t *row = json_pack("{s:s, s:I, s:I, s:I, s:I, s:o, s:o}", "name",
                            flesh_system_effect(system, e)->operations->name, "residuals", (json_int_t)cost->residuals,
                            "jacobians", (json_int_t)cost->jacobians, "potentials", (json_int_t)cost->potentials,
                            "energies", (json_int_t)cost->energies, "memory_bytes",
                            flesh_json_number(bytes ? (double)bytes : NAN), "cpu_s",
                            flesh_json_number(costs->timed ? cost->cpu_s : NAN));
    json_array_append_new(array, row);
  }
  return array;
}

void flesh_costs_print(FILE *stream, const flesh_costs *costs, const flesh_system *system)
{
  fprintf(stream, "effect        residuals  Jacobians potentials   energies   memory kB      CPU s\n");
  for (int e = 0; e < flesh_system_effect_count(system); e++) {
    const flesh_effect_cost *cost = &costs->effects[e];
    char memory[32] = "-";
    size_t bytes = flesh_system_effect_memory(system, e);
    if (bytes) snprintf(memory, sizeof memory, "%.1f", (double)bytes / 1024);
    fprintf(stream, "%-12s %10ld %10ld %10ld %10ld %11s %10.4f\n",
            flesh_system_effect(system, e)->operations->name, cost->residuals, cost->jacobians,
            cost->potentials, cost->energies, memory, cost->cpu_s);
  }
}

static json_t *failure_json(const flesh_outcome *outcome)
{
  const flesh_failure *f = &outcome->failure;
  const int solved = f->worst_node >= 0 && !f->order; /* null if there is none */
  json_t *failure =
      json_pack("{s:s, s:s, s:o, s:o, s:f, s:i, s:i, s:o, s:o, s:i, s:i, s:s}", "reason", flesh_status_name(f->status),
                "meaning", flesh_status_text(f->status), "t", flesh_json_number(f->t), "h", flesh_json_number(f->h),
                "load_factor", f->load, "halvings", f->halvings, "order", f->order,
                "residual", flesh_json_number(solved ? f->residual : NAN),
                "residual_target", flesh_json_number(solved ? f->target : NAN), "worst_tet", f->worst_tet,
                "worst_node", f->worst_node, "advice", outcome->advice);
  if (f->worst_tet < 0) return failure;
  set(failure, "worst_J", f->worst_J);
  json_object_set_new(failure, "worst_position", flesh_json_numbers(3, f->worst_position));
  return failure;
}

json_t *flesh_outcome_json(const flesh_outcome *outcome)
{
  json_t *warning = *outcome->warning ? flesh_json_text(outcome->warning) : json_null();
  json_t *notes = *outcome->notes ? flesh_json_text(outcome->notes) : json_null();
  return json_pack("{s:s, s:i, s:o, s:o, s:o, s:o}", "status", flesh_outcome_word(outcome), "exit_code",
                   outcome->exit_code, "message", flesh_json_text(outcome->message), "warning", warning, "notes", notes,
                   "failure", outcome->has_failure ? failure_json(outcome) : json_null());
}
