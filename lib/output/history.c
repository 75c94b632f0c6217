/* history.c: a CSV file with a row per step. */
#include "flesh/observer.h"

#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/file.h"
#include "effect/effect.h"
#include "output/resume.h"
#include "output/rows.h"
#include "system/effect_view.h"
#include "system/rank_numbers.h"

struct flesh_history {
  const flesh_system *system; /* borrowed */
  int reports;     /* number of columns that effects report */
  double *values;  /* [reports] */
  double *zeros;   /* [3*n] accelerations, if there are reports */
  flesh_rows rows;
};

/* Prints a column's name: energy_spring, energy_spring_2, ... or spring_<column>, spring_2_<column>. */
static void print_name(FILE *stream, const flesh_system *system, int index, const char *prefix,
                       const char *column)
{
  const char *name = flesh_system_effect(system, index)->operations->name;
  int occurrence = 1;
  for (int e = 0; e < index; e++)
    occurrence += !strcmp(flesh_system_effect(system, e)->operations->name, name);
  fprintf(stream, "%s%s", prefix, name);
  if (occurrence > 1) fprintf(stream, "_%d", occurrence);
  fputs(column, stream);
}

static const char *const *report_names(const flesh_system *system, int index)
{
  static const char *const none[] = {NULL};
  const flesh_effect_figures *figures = flesh_effect_figures_of(flesh_system_effect(system, index));
  return figures->report_names ? figures->report_names : none;
}

/* Makes a history without its file. */
static int create(const char *path, const flesh_system *system, flesh_history **result)
{
  flesh_history *history = calloc(1, sizeof *history);
  if (!history) return flesh_no_memory_for(path);
  history->system = system;
  for (int e = 0; e < flesh_system_effect_count(system); e++)
    for (const char *const *name = report_names(system, e); *name; name++) history->reports++;
  if (history->reports) {
    history->values = calloc((size_t)history->reports, sizeof(double));
    history->zeros = calloc((size_t)flesh_system_unknowns(system), sizeof(double));
    if (!history->values || !history->zeros) {
      flesh_history_close(&history);
      return flesh_no_memory_for(path);
    }
  }
  *result = history;
  return FLESH_OK;
}

int flesh_history_resume(const char *path, const flesh_system *system, long length, flesh_history **history)
{
  *history = NULL;
  int status = create(path, system, history);
  if (!status) status = flesh_rows_resume(path, length, &(*history)->rows);
  if (status) flesh_history_close(history);
  return status;
}

long flesh_history_length(const flesh_history *history) { return history->rows.whole; }

int flesh_history_create(const char *path, const flesh_system *system, flesh_history **result)
{
  FLESH_NEED({result, "history"});
  *result = NULL;
  FLESH_NEED({path, "path"}, {system, "system"});
  flesh_history *history = NULL;
  int status = create(path, system, &history);
  if (!status) status = flesh_rows_open(path, &history->rows);
  if (status) {
    flesh_history_close(&history);
    return status;
  }
  fputs("t,step,h,internal_steps,newton,linear,assemblies,projections,backtracks,residual,residual_target,",
        history->rows.stream);
  for (int e = 0; e < flesh_system_effect_count(system); e++) {
    if (!flesh_system_effect(system, e)->operations->energy) continue;
    print_name(history->rows.stream, system, e, "energy_", ",");
  }
  fputs("energy_total,volume,volume_ratio,J_min,J_min_tet,J_bound,inverted", history->rows.stream);
  for (int e = 0; e < flesh_system_effect_count(system); e++)
    for (const char *const *name = report_names(system, e); *name; name++) {
      putc(',', history->rows.stream);
      print_name(history->rows.stream, system, e, "", "_");
      fputs(*name, history->rows.stream);
    }
  putc('\n', history->rows.stream);
  status = flesh_rows_flush(&history->rows);
  if (status) flesh_history_close(&history);
  *result = history;
  return status;
}

int flesh_history_close(flesh_history **history)
{
  if (!history || !*history) return FLESH_OK;
  int status = flesh_rows_close(&(*history)->rows);
  free((*history)->values);
  free((*history)->zeros);
  free(*history);
  *history = NULL;
  return status;
}

static void put(FILE *stream, double value)
{
  flesh_number_print(stream, value);
  putc(',', stream);
}

static void put_reports(flesh_history *history, const flesh_step_record *record)
{
  double *values = history->values;
  for (int e = 0; e < flesh_system_effect_count(record->system); e++) {
    const flesh_effect *effect = flesh_system_effect(record->system, e);
    if (!flesh_effect_figures_of(effect)->report_names) continue;
    const int of_ranks = record->reports && flesh_rank_numbers_reporting(effect) != NULL;
    const double *of_all = of_ranks ? record->reports + FLESH_RANK_SUMS * (size_t)e : NULL;
    const flesh_state *at = flesh_effect_reports_stage(effect) ? record->stage : record->state;
    const flesh_environment environment = {.proximity = record->proximity};
    flesh_point point = flesh_point_at(at->t, at->x, at->v, history->zeros);
    point.internal = record->state->internal;
    point.environment = &environment;
    flesh_effect_view view = flesh_effect_view_of(record->system, &point);
    if (!of_ranks) flesh_effect_figures_of(effect)->report(effect, flesh_effect_view_turn(&view, e), values);
    for (int k = 0; of_ranks && report_names(record->system, e)[k]; k++) values[k] = of_all[k];
    for (const char *const *name = report_names(record->system, e); *name; name++) {
      putc(',', history->rows.stream);
      flesh_number_print(history->rows.stream, *values++);
    }
  }
}

int flesh_history_observe(void *data, const flesh_step_record *record)
{
  FLESH_NEED({data, "history"}, {record, "record"});
  flesh_history *history = data;
  if (record->system != history->system)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the history is made for another system than the run's");
  FILE *stream = history->rows.stream;
  const flesh_solve_stats *stats = record->stats;
  put(stream, record->state->t);
  fprintf(stream, "%d,", record->step);
  put(stream, record->h);
  fprintf(stream, "%d,%d,%d,%d,%d,%d,", stats->steps, stats->newton, stats->linear, stats->assemblies,
          stats->projections, stats->backtracks);
  put(stream, stats->residual_last);
  put(stream, stats->residual_target);
  double total = 0;
  for (int e = 0; e < flesh_system_effect_count(record->system); e++) {
    if (!flesh_system_effect(record->system, e)->operations->energy) continue;
    double energy = record->energies[e] - record->rest_energies[e];
    total += energy;
    put(stream, energy);
  }
  put(stream, total);
  put(stream, record->volume);
  put(stream, record->volume / record->rest_volume);
  put(stream, record->J_min);
  fprintf(stream, "%d,", record->J_min_tet);
  put(stream, record->J_bound);
  fprintf(stream, "%d", record->inverted);
  if (history->reports) put_reports(history, record);
  putc('\n', stream);
  return flesh_rows_flush(&history->rows);
}
