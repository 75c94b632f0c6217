/* case.c: a sweep as a study: what each of its cases sets, and how it is done in a process of its own. */
#include <stdio.h>

#include "base/error.h"
#include "base/text.h"
#include "cli/interrupt.h"
#include "run/provenance.h"
#include "run/runner.h"
#include "sweep/sweep.h"
#include "cli/json_memory.h"

static void choose_values(const flesh_sweep *sweep, long number, flesh_study_case *made)
{
  long left = number;
  made->repeat = (int)(left % sweep->repeats) + 1;
  left /= sweep->repeats;
  for (int g = sweep->group_count - 1; g >= 0; g--) {
    const flesh_sweep_group *group = &sweep->groups[g];
    for (int c = group->first; c < group->first + group->columns; c++) {
      made->values[c] = sweep->columns[c].values[left % group->count];
      made->nodes[c] = sweep->columns[c].nodes[left % group->count];
    }
    left /= group->count;
  }
}

static int make_case(const void *data, int number, flesh_study_case *made)
{
  const flesh_sweep *sweep = ((const flesh_sweep_work *)data)->sweep;
  char seed[16];
  *made = (flesh_study_case){.scene = sweep->scene};
  choose_values(sweep, number, made);
  flesh_overrides_copy(&made->overrides, &(flesh_texts){sweep->set.count, sweep->set.texts});
  for (int c = 0; c < sweep->column_count; c++)
    if (!strcmp(sweep->columns[c].key, "scene")) made->scene = made->values[c];
    else flesh_overrides_add(&made->overrides, sweep->columns[c].key, made->values[c]);
  snprintf(seed, sizeof seed, "%d", sweep->seed + made->repeat - 1);
  if (sweep->seed >= 0) flesh_overrides_add(&made->overrides, "output.seed", seed);
  if (!made->overrides.failed) return FLESH_OK;
  flesh_study_case_free(made);
  return flesh_no_memory();
}

/* The scene as the case will read it. */
static int build(const flesh_sweep *sweep, int number)
{
  const flesh_sweep_work given = {sweep, NULL};
  flesh_study_case c;
  flesh_scene *scene = NULL;
  int status = make_case(&given, number, &c);
  if (status) return status;
  status = flesh_overrides_read(&c.overrides, c.scene, &scene);
  flesh_scene_destroy(&scene);
  flesh_study_case_free(&c);
  return status;
}

int flesh_sweep_case_try(const flesh_sweep *sweep, int shard, int shards)
{
  char first[900] = "";
  int cases = 0, refused = FLESH_OK;
  for (int number = shard - 1; number < sweep->case_count; number += shards, cases++) {
    int status = build(sweep, number);
    if (!status || status == FLESH_ERR_MEMORY || flesh_interrupt_signal()) return FLESH_OK;
    if (refused) continue;
    refused = status;
    snprintf(first, sizeof first, "%s", flesh_error_text());
  }
  if (!refused) return FLESH_OK;
  return cases == 1 ? flesh_fail(refused, "its only case is refused: %s", first)
                    : flesh_fail(refused, "all %d cases are refused; the first: %s", cases, first);
}

static json_t *refused(int status)
{
  return json_pack("{sssisosn}", "status", status == FLESH_ERR_MEMORY ? "failed" : "refused", "exit_code",
                   flesh_exit_code(status), "message", flesh_json_text(flesh_error_text()), "result");
}

static json_t *run_scene(const flesh_sweep *sweep, const flesh_study_case *c, const char *folder)
{
  flesh_scene *scene = NULL;
  flesh_figures figures = {0};
  flesh_outcome outcome = {0};
  int status = flesh_overrides_read(&c->overrides, c->scene, &scene);
  if (status) return refused(status);
  const flesh_runner_options options = {.out = folder, .scene_path = c->scene, .max_seconds = sweep->max_seconds,
                                        .no_frames = !folder, .quiet = 1};
  flesh_runner_run(scene, &options, &figures, &outcome);
  json_t *result = flesh_outcome_json(&outcome);
  json_object_set_new(result, "figures", flesh_figures_json(&figures, flesh_scene_system(scene), scene));
  json_object_set_new(result, "materials", flesh_materials_json(scene));
  json_object_set_new(result, "inputs", flesh_provenance_scene(scene, c->scene));
  json_t *record = json_pack("{sssisO}", "status", flesh_outcome_word(&outcome), "exit_code", outcome.exit_code,
                             "message", json_object_get(result, "message"));
  json_object_set_new(record, "result", result);
  flesh_figures_close(&figures);
  flesh_scene_destroy(&scene);
  return record;
}

static char *case_folder(const void *data, int number)
{
  const flesh_sweep_work *given = data;
  return given->sweep->keep ? flesh_text_new("%s/cases/%06d", given->out, number + 1) : NULL;
}

static json_t *run_case(const void *data, int number, const char *folder)
{
  const flesh_sweep *sweep = ((const flesh_sweep_work *)data)->sweep;
  flesh_study_case c;
  int status = sweep->keep && !folder ? flesh_no_memory() : make_case(data, number, &c);
  if (status) return refused(status);
  json_t *record = run_scene(sweep, &c, folder);
  flesh_study_case_free(&c);
  return record;
}

/* Figures of result.json, and the energies and probes of the first scene that can be read, as "name", "energies.name" and
 * probes."name".max. */
static json_t *figure_names(const void *data)
{
  const flesh_sweep *sweep = ((const flesh_sweep_work *)data)->sweep;
  json_t *names = json_array(), *figures = NULL, *value;
  flesh_scene *scene = NULL;
  flesh_figures empty = {0};
  const char *key, *inner;
  for (int number = 0; number < sweep->case_count && !scene; number++) {
    flesh_study_case c;
    if (make_case(data, number, &c) || flesh_interrupt_signal()) return names;
    flesh_overrides_read(&c.overrides, c.scene, &scene);
    flesh_study_case_free(&c);
  }
  if (scene && !flesh_figures_open(&empty, flesh_scene_system(scene), scene))
    figures = flesh_figures_json(&empty, flesh_scene_system(scene), scene);
  json_object_foreach(figures, key, value) {
    json_t *below;
    const char *const of_probe[] = {"final", "min", "max"};
    if (!json_is_object(value)) json_array_append_new(names, json_string(key));
    else if (!strcmp(key, "energies"))
      json_object_foreach(value, inner, below) json_array_append_new(names, json_sprintf("energies.%s", inner));
    else
      json_object_foreach(value, inner, below)
        for (int k = 0; k < 3; k++) json_array_append_new(names, json_sprintf("probes.\"%s\".%s", inner, of_probe[k]));
  }
  json_decref(figures);
  flesh_figures_close(&empty);
  flesh_scene_destroy(&scene);
  return names;
}

flesh_study flesh_sweep_study(const flesh_sweep_work *given)
{
  /* Time after the end of its budget within which a case must end, s; it stops by itself between two steps, and is
   * killed later. */
  static const double grace = 2;
  const flesh_sweep *sweep = given->sweep;
  return (flesh_study){.name = "sweep",
                       .text = sweep->text,
                       .path = sweep->path,
                       .fingerprint = sweep->fingerprint,
                       .different = sweep->keep
                                        ? "the spec or the scene it names has changed since, and cases that keep folders "
                                          "cannot get further values; undo the change"
                                        : "the spec or the scene it names has changed since, in more than the values of "
                                          "axes and derived columns; undo the change",
                       .column_count = sweep->column_count,
                       .columns = sweep->described,
                       .repeats = sweep->repeats,
                       .derived_count = sweep->derived_count,
                       .derived = sweep->derived,
                       .case_count = sweep->case_count,
                       .max_seconds = sweep->max_seconds > 0 ? sweep->max_seconds + grace : 0,
                       .budget = sweep->max_seconds,
                       .asks = 1,
                       .data = given,
                       .make = make_case,
                       .figures = figure_names,
                       .work = run_case,
                       .folder = case_folder};
}
