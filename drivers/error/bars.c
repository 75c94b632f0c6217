/* bars.c: the error bars of a complete run. */
#include "error/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/confine.h"
#include "base/error.h"
#include "base/scan.h"
#include "cli/json_memory.h"
#include "cli/output.h"
#include "error/quantity.h"
#include "scene/scene.h"

static const char *const files[] = {"history.csv", "probes.csv"};
enum { FILES = sizeof files / sizeof *files };

int flesh_error_wanted(const flesh_scene *scene) { return scene->keys.output.error_bars; }

/* The run with all that its bars are made of. */
typedef struct bars {
  char *path; /* room for the folder and a name */
  flesh_scene *scene;
  flesh_error_judge judges[FLESH_ERROR_KINDS];
  flesh_error_quantities quantities[FILES];
} bars;

static int judge_file(bars *b, const char *folder, int file)
{
  flesh_error_quantities *all = &b->quantities[file];
  flesh_error_table tables[FLESH_ERROR_KINDS][FLESH_ERROR_COMPANIONS] = {{{{0}, NULL}}};
  int status = flesh_error_quantities_read(folder, files[file], b->scene, all);
  for (int kind = 0; kind < FLESH_ERROR_KINDS; kind++)
    for (int k = 0; k < b->judges[kind].count && !status; k++) {
      sprintf(b->path, "%s/%s", folder, b->judges[kind].companions[k].folder);
      status = flesh_error_table_read(b->path, files[file], &tables[kind][k]);
    }
  for (int kind = 0; kind < FLESH_ERROR_KINDS && !status; kind++)
    if (b->judges[kind].count)
      status = flesh_error_quantities_judge(all, (flesh_error_kind)kind, &b->judges[kind], tables);
  for (int k = 0; k < FLESH_ERROR_KINDS * FLESH_ERROR_COMPANIONS; k++) flesh_error_table_clear(&tables[0][0] + k);
  return status;
}

/* A judge as it stands in result.json. */
static json_t *judge_json(const flesh_error_judge *judge)
{
  json_t *object = json_object(), *companions = json_array();
  json_object_set_new(object, judge->count ? "compared_with" : "no_bar", flesh_json_text(judge->words));
  for (int k = 0; k < judge->count; k++)
    json_array_append_new(companions, json_pack("{sss[ss*]sf}", "folder", judge->companions[k].folder, "set",
                                                judge->companions[k].set[0],
                                                *judge->companions[k].set[1] ? judge->companions[k].set[1] : NULL,
                                                "cpu_s", judge->companions[k].cpu_s));
  if (judge->count) json_object_set_new(object, "factor", json_real(judge->factor));
  json_object_set_new(object, "companions", companions);
  return object;
}

static json_t *quantity_json(const flesh_error_quantity *q, int last)
{
  json_t *object = json_pack("{so* so* so*}", "name", flesh_json_text(q->name), "unit", flesh_json_text(q->unit), "value",
                             flesh_json_number(q->values[last]));
  char key[32];
  for (int kind = 0; kind < FLESH_ERROR_KINDS; kind++) {
    snprintf(key, sizeof key, "error_%s", flesh_error_kind_names[kind]);
    json_object_set_new(object, key, flesh_json_number(q->bars[kind] ? q->bars[kind][last] : NAN));
    if (!*q->why[kind]) continue;
    snprintf(key, sizeof key, "no_%s_bar", flesh_error_kind_names[kind]);
    json_object_set_new(object, key, flesh_json_text(q->why[kind]));
  }
  if (isfinite(q->better)) json_object_set_new(object, "better", json_real(q->better));
  return object;
}

/* Adds the bars to result.json. */
static int write_result(bars *b, const char *folder)
{
  json_t *result, *object = json_object(), *list = json_array();
  sprintf(b->path, "%s/result.json", folder);
  const int status = flesh_json_read(b->path, &result);
  for (int kind = 0; kind < FLESH_ERROR_KINDS; kind++)
    json_object_set_new(object, flesh_error_kind_names[kind], judge_json(&b->judges[kind]));
  for (int file = 0; file < FILES; file++)
    for (int k = 0; k < b->quantities[file].count; k++)
      json_array_append_new(list, quantity_json(&b->quantities[file].list[k], b->quantities[file].table.csv.rows - 1));
  json_object_set_new(object, "quantities", list);
  json_object_set_new(result, "error_bars", object); /* freed where there is no result */
  return status ? status : flesh_json_write(b->path, result);
}

static void say_quantity(const flesh_error_quantity *q, int last)
{
  const char *blank = *q->unit ? " " : "";
  printf("%s = %.5g%s%s", q->name, q->values[last], blank, q->unit);
  for (int kind = 0; kind < FLESH_ERROR_KINDS; kind++)
    if (q->bars[kind]) printf(" +/- %.2g (%s)", q->bars[kind][last], flesh_error_kind_names[kind]);
  if (isfinite(q->better)) printf("; tet10-mean gives %.5g%s%s", q->better, blank, q->unit);
  for (int kind = 0; kind < FLESH_ERROR_KINDS; kind++)
    if (*q->why[kind]) printf("; no bar (%s): %s", flesh_error_kind_names[kind], q->why[kind]);
  putchar('\n');
}

/* Prints the bars of probes, or of the whole body's energies where there are none. */
static void say(const bars *b)
{
  const int file = b->quantities[1].count ? 1 : 0;
  for (int kind = 0; kind < FLESH_ERROR_KINDS; kind++)
    printf("error bars of the %s: %s%s\n", flesh_error_kind_names[kind], b->judges[kind].count ? "by " : "none, as ",
           b->judges[kind].words);
  for (int k = 0; k < b->quantities[file].count; k++)
    say_quantity(&b->quantities[file].list[k], b->quantities[file].table.csv.rows - 1);
}

static int make(bars *b, const flesh_runner_options *options)
{
  sprintf(b->path, "%s/scene.yaml", options->out);
  int status = flesh_scene_read(b->path, 0, NULL, &b->scene);
  if (!status) status = flesh_error_choose(b->scene, b->path, b->judges);
  char *path = strdup(b->path);
  flesh_runner_options of_companions = *options;
  of_companions.scene_path = path;
  if (!status && !path) status = flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  for (int kind = 0; kind < FLESH_ERROR_KINDS && !status; kind++)
    status = flesh_error_run(&of_companions, &b->judges[kind]);
  free(path);
  for (int file = 0; file < FILES && !status; file++) status = judge_file(b, options->out, file);
  for (int file = 0; file < FILES && !status; file++)
    if (b->quantities[file].count)
      status = flesh_error_quantities_write(&b->quantities[file], options->out, files[file]);
  if (!status) status = write_result(b, options->out);
  if (!status && !options->quiet) say(b);
  return status;
}

int flesh_error_bars(const flesh_runner_options *options)
{
  bars b = {.path = malloc(strlen(options->out) + 64)};
  flesh_folder_claim claim = {.descriptor = -1};
  int status = b.path ? flesh_output_claim(options->out, "run", &claim) : flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  if (!status) status = make(&b, options);
  for (int kind = 0; kind < FLESH_ERROR_KINDS; kind++) flesh_error_judge_close(&b.judges[kind]);
  for (int file = 0; file < FILES; file++) flesh_error_quantities_clear(&b.quantities[file]);
  flesh_scene_destroy(&b.scene);
  free(b.path);
  flesh_folder_claim_release(&claim);
  return status;
}

int flesh_error_catch_up(const flesh_runner_options *options, int wanted)
{
  char *path = malloc(strlen(options->out) + 64);
  json_t *result = NULL;
  flesh_scene *scene = NULL;
  if (!path) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  sprintf(path, "%s/result.json", options->out);
  int status = flesh_json_read(path, &result);
  const int has = json_object_get(result, "error_bars") != NULL;
  sprintf(path, "%s/scene.yaml", options->out);
  if (!status && !has && !wanted) status = flesh_scene_read(path, 0, NULL, &scene);
  if (scene) wanted = flesh_error_wanted(scene);
  json_decref(result);
  flesh_scene_destroy(&scene);
  free(path);
  return status || has || !wanted ? status : flesh_error_bars(options);
}
