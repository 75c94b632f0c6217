/* run.c: runs an experiment at given parameters, reads the measured quantities from its tables and last state, and
 * keeps the equilibria that they need. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/confine.h"
#include "base/error.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/text.h"
#include "cli/path.h"
#include "fit/fit.h"
#include "fit/map.h"
#include "run/runner.h"
#include "run/start.h"

/* Step in q of the differences for tangents. It can be small, as residuals have no solver error, and must be, as
 * Poisson's ratio may be near 1/2. */
static const double difference = 1e-5;
static const char *const table_names[] = {"probes.csv", "history.csv"};

void flesh_fit_scratch_remove(const flesh_fit *fit, const flesh_fit_experiment *e)
{
  const char *folders[] = {e->scratch, e->folder, flesh_path("%s/runs", fit->options.out)};
  for (int k = 0; k < 2; k++) flesh_path_unlink(flesh_path("%s/%s", e->scratch, table_names[k]));
  for (int k = 0; k < 3 && !flesh_path_remove_folder(folders[k]); k++) continue;
}

void flesh_fit_overrides(const flesh_fit *fit, const flesh_fit_experiment *e, const double *p, flesh_overrides *overrides)
{
  char number[FLESH_NUMBER_SIZE];
  flesh_overrides_copy(overrides, &e->set);
  if (fit->map) flesh_overrides_add(overrides, "body.material_map", flesh_path("%s/map.csv", fit->options.out));
  for (int k = 0; k < fit->key_count; k++)
    if (e->acts[k]) flesh_overrides_add(overrides, fit->parameters[k].key, flesh_number_text(p[k], number));
}

int flesh_fit_scene_at(const flesh_fit *fit, const flesh_fit_experiment *e, const double *p, flesh_scene **scene)
{
  flesh_overrides overrides;
  flesh_fit_overrides(fit, e, p, &overrides);
  int status = fit->map ? flesh_fit_map_write(fit, flesh_path("%s/map.csv", fit->options.out), p) : FLESH_OK;
  if (!status) status = flesh_overrides_read(&overrides, e->scene, scene);
  flesh_overrides_close(&overrides);
  return status;
}

double flesh_fit_direction(const flesh_fit *fit, const double *p, int k, double *direction)
{
  for (int j = 0; j < fit->parameter_count; j++) direction[j] = j == k;
  return difference * fabs(flesh_fit_slope(&fit->parameters[k], p[k]));
}

int flesh_fit_scenes_beside(const flesh_fit *fit, const flesh_fit_experiment *e, const double *p, const double *direction,
                            double h, flesh_scene *scenes[2])
{
  double *beside = malloc((size_t)fit->parameter_count * sizeof *beside);
  int status = beside ? FLESH_OK : flesh_no_memory();
  for (int s = 0; s < 2 && !status; s++) {
    for (int k = 0; k < fit->parameter_count; k++) {
      const double step = h * direction[k]; /* keep both sides within the bounds */
      beside[k] = fmax(fmin(p[k], fit->parameters[k].to - fabs(step)), fit->parameters[k].from + fabs(step)) + (s ? step : -step);
    }
    status = flesh_fit_scene_at(fit, e, beside, &scenes[s]);
  }
  free(beside);
  return status;
}

/* Finds the column of a run's table for a quantity; FLESH_ERR_ARGUMENT at the measurement's node if there is none. */
static int find_column(const flesh_csv *csv, const flesh_fit_measured *m, const flesh_fit_quantity *q, int *column)
{
  char name[FLESH_CSV_NAME], unit[FLESH_CSV_NAME], list[600] = "";
  *column = flesh_csv_find_label(csv, q->name, unit);
  if (*column >= 0 && (!*q->unit || !strcmp(unit, q->unit))) return FLESH_OK;
  if (*column >= 0)
    return flesh_node_fail(m->node, "%s: column %s is in %s; it must be in %s", m->path, q->name, q->unit,
                           *unit ? unit : "numbers without a unit");
  for (int c = 1; c < csv->columns; c++) {
    flesh_csv_label(csv, c, name, unit);
    flesh_text_add(list, sizeof list, "%s%s", *list ? ", " : "", name);
  }
  return flesh_node_fail(m->node, "%s: column %s is none of %s, which has %s", m->path, q->name, table_names[m->table], list);
}

int flesh_fit_tables_open(const flesh_fit_experiment *e, const flesh_scene *scene, flesh_fit_tables *tables)
{
  int count, wanted[3] = {0}, status = flesh_folder_make(e->scratch);
  const flesh_probe *list = flesh_scene_probes(scene, &count);
  const flesh_system *system = flesh_scene_system(scene);
  *tables = (flesh_fit_tables){0};
  for (int k = 0; k < e->measured_count && !status; k++) {
    const flesh_fit_measured *m = &e->measured[k];
    wanted[m->table] = 1;
    if (m->table == FLESH_FIT_OF_PROBES && !count)
      status = flesh_node_fail(m->node, "%s: column %s is none of probes.csv, which has no columns, as the scene has no probes",
                               m->path, m->quantities[0].name);
  }
  if (!status && wanted[FLESH_FIT_OF_HISTORY])
    status = flesh_history_create(flesh_path("%s/history.csv", e->scratch), system, &tables->history);
  if (!status && wanted[FLESH_FIT_OF_PROBES])
    status = flesh_probes_create(flesh_path("%s/probes.csv", e->scratch), flesh_scene_body(scene), system,
                                 flesh_scene_times(scene)->method, count, list, &tables->probes);
  return status;
}

int flesh_fit_tables_close(flesh_fit_tables *tables, int status)
{
  const int closed[] = {flesh_history_close(&tables->history), flesh_probes_close(&tables->probes)};
  return status ? status : closed[0] ? closed[0] : closed[1];
}

int flesh_fit_try(flesh_fit *fit, const flesh_fit_experiment *e)
{
  flesh_scene *scene = NULL;
  flesh_fit_tables tables = {0};
  double *p = flesh_arena_take(&fit->arena, (size_t)(fit->parameter_count + e->count) * sizeof *p);
  if (!p) return flesh_no_memory();
  for (int k = 0; k < fit->parameter_count; k++) p[k] = fit->parameters[k].start;
  int status = flesh_fit_scene_at(fit, e, p, &scene);
  if (status) flesh_node_fail_within(status, e->scene_node, "%s", "");
  else status = flesh_fit_tables_open(e, scene, &tables);
  status = flesh_fit_tables_close(&tables, status);
  if (!status) /* finds the columns of tables without rows */
    status = flesh_fit_read_values(e, e->scratch, flesh_mesh_positions(flesh_scene_mesh(scene)), p + fit->parameter_count);
  flesh_scene_destroy(&scene);
  flesh_fit_scratch_remove(fit, e);
  return status;
}

/* Returns the number of a column at time t, interpolated linearly between rows; NaN: in the last row. Of rows with the
 * same time the last one counts: a single equilibrium may have the time of the start, whose row comes first. */
static double number_at(const flesh_csv *csv, int time, int column, double t)
{
  double before = NAN, at = NAN, value = NAN, last = NAN;
  for (int row = 0; row < csv->rows; row++) {
    if (!flesh_csv_number(csv, row, time, &at)) return NAN;
    if (at > t && before == t) return last;
    if (!flesh_csv_number(csv, row, column, &value)) return NAN;
    if (at > t && row) return last + (value - last) * (t - before) / (at - before);
    before = at;
    last = value;
  }
  return isnan(t) || fabs(t - at) <= 1e-9 * (1 + fabs(t)) ? value : NAN;
}

static int read_table(const flesh_fit_measured *m, const char *folder, double *values)
{
  int *columns = calloc((size_t)m->quantity_count + 1, sizeof *columns);
  flesh_csv csv = {0};
  int status = columns ? flesh_csv_read(flesh_path("%s/%s", folder, table_names[m->table]), FLESH_CSV_WHOLE, &csv)
                       : flesh_no_memory();
  for (int q = 0; q < m->quantity_count && !status; q++) status = find_column(&csv, m, &m->quantities[q], &columns[q]);
  for (int d = 0; d < m->count && !status; d++)
    values[d] = number_at(&csv, 0, columns[m->data[d].quantity], m->data[d].t);
  flesh_csv_clear(&csv);
  free(columns);
  return status;
}

int flesh_fit_read_values(const flesh_fit_experiment *e, const char *folder, const double *x, double *values)
{
  int status = FLESH_OK;
  for (int k = 0; k < e->measured_count && !status; values += e->measured[k++].count)
    if (e->measured[k].table == FLESH_FIT_OF_POSITIONS)
      for (int d = 0; d < e->measured[k].count; d++)
        values[d] = flesh_fit_position(&e->measured[k], &e->measured[k].data[d], x);
    else status = read_table(&e->measured[k], folder, values);
  return status;
}

/* Reads the values of a run that ended well from its tables and its last state. */
static int read_run(const flesh_fit_experiment *e, double *values)
{
  flesh_state state;
  int status = flesh_state_make(e->nodes, 0, 0, &state);
  if (!status) status = flesh_state_read(flesh_path("%s/state.txt", e->folder), e->nodes, &state);
  if (!status) status = flesh_fit_read_values(e, e->folder, state.x, values);
  for (int d = 0; d < e->count && !status; d++)
    if (!isfinite(values[d]))
      status = flesh_fail(FLESH_FIT_RUN_FAILED, "measured number %d of the experiment %s is not finite in its run", d + 1,
                          e->name);
  free(state.x);
  return status;
}

void flesh_fit_equilibria_clear(flesh_fit_equilibria *equilibria)
{
  for (int k = 0; k < equilibria->count; k++) free(equilibria->states[k].x);
  free(equilibria->states);
  free(equilibria->p);
  *equilibria = (flesh_fit_equilibria){0};
}

int flesh_fit_state_copy(const flesh_state *from, int nodes, flesh_state *to)
{
  const int multipliers = from->multiplier_count, status = flesh_state_make(nodes, multipliers, 0, to);
  if (status) return status;
  to->t = from->t;
  memcpy(to->x, from->x, 3 * (size_t)nodes * sizeof *to->x);
  if (multipliers) memcpy(to->multipliers, from->multipliers, (size_t)multipliers * sizeof *to->x);
  return FLESH_OK;
}

/* Returns whether a number was measured after `low` and before `high`, or at `at`. */
static int is_measured(const flesh_fit_experiment *e, double low, double at, double high)
{
  for (int k = 0; k < e->measured_count; k++)
    for (int d = 0; d < e->measured[k].count; d++) {
      const double t = e->measured[k].data[d].t;
      if (t == at || (t > low && t < high)) return 1;
    }
  return 0;
}

/* Keeps the state of a row; drops the row before it if nothing was measured there. */
static int keep(void *experiment, const flesh_step_record *record)
{
  flesh_fit_experiment *e = experiment;
  flesh_fit_equilibria *kept = &e->equilibria;
  if (kept->count) {
    flesh_state *last = &kept->states[kept->count - 1];
    const double at = last->t;
    if (!is_measured(e, kept->before, at, record->state->t)) {
      free(last->x);
      kept->count--;
      kept->has_start &= kept->count > 0;
    }
    kept->before = at;
  } else kept->before = record->state->t;
  if (!flesh_grow(&kept->states, sizeof *kept->states, kept->count, &kept->room))
    return flesh_fail(FLESH_ERR_MEMORY, "out of memory for the equilibria of a fit");
  kept->has_start |= record->step == 0;
  const int status = flesh_fit_state_copy(record->state, e->nodes, &kept->states[kept->count]);
  kept->count += !status;
  return status;
}

int flesh_fit_run(flesh_fit *fit, flesh_fit_experiment *e, const double *p, double *values, double *cpu_s)
{
  const size_t size = (size_t)fit->parameter_count * sizeof *p;
  const int keeps = !*e->differences && !e->moves;
  const flesh_observer keeper = {keep, e};
  flesh_scene *scene = NULL;
  flesh_figures figures = {0};
  flesh_outcome outcome = {0};
  *cpu_s = 0;
  int status = flesh_fit_scene_at(fit, e, p, &scene);
  const int refused = status == FLESH_ERR_ARGUMENT;
  if (!status) {
    const flesh_runner_options options = {.out = e->folder, .scene_path = e->scene, .quiet = 1, .no_frames = 1,
                                          .observer_count = keeps, .observers = &keeper, .argc = fit->options.argc,
                                          .argv = fit->options.argv};
    flesh_fit_equilibria_clear(&e->equilibria);
    status = flesh_runner_run(scene, &options, &figures, &outcome);
    *cpu_s = figures.cpu_s;
    flesh_figures_close(&figures);
  }
  if (!status) status = read_run(e, values);
  if (!status && keeps) {
    e->equilibria.p = malloc(size);
    if (e->equilibria.p) memcpy(e->equilibria.p, p, size);
  } else if (refused || status == FLESH_ERR_SOLVE || status == FLESH_ERR_INTEGRATOR || status == FLESH_ERR_NONFINITE ||
             status == FLESH_ERR_ENERGY) /* because of the parameters, so that the search can continue */
    status = *outcome.message ? flesh_fail(FLESH_FIT_RUN_FAILED, "%.300s", outcome.message) : FLESH_FIT_RUN_FAILED;
  flesh_scene_destroy(&scene);
  return status;
}
