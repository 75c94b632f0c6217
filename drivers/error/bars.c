/* bars.c: makes the error bars of a complete run. */
#include "error/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/file.h"
#include "base/scan.h"
#include "base/text.h"
#include "cli/json_memory.h"
#include "cli/output.h"
#include "cli/path.h"
#include "error/companion.h"
#include "plot/curves.h"
#include "scene/scene.h"
#include "sensitivity/sensitivity.h"
#include "study/embedded.h"
#include "study/study.h"

static const char *const files[] = {"history.csv", "probes.csv"};
static const char *const kind_names[FLESH_ERROR_KINDS] = {"mesh", "step"};

/* The run and everything from which its bars are made. */
typedef struct bars {
  flesh_scene *scene;
  flesh_error_judge judges[FLESH_ERROR_KINDS];
  flesh_study_store store; /* only its database is used, in memory */
} bars;

/* Returns a judge as new text, as in result.json. */
static char *judge_text(const flesh_error_judge *judge)
{
  json_t *companions = json_array();
  for (int k = 0; k < judge->count; k++)
    json_array_append_new(companions, json_pack("{sss[ss*]sf}", "folder", judge->companions[k].folder, "set",
                                                judge->companions[k].set[0],
                                                *judge->companions[k].set[1] ? judge->companions[k].set[1] : NULL,
                                                "cpu_s", judge->companions[k].cpu_s));
  json_t *object = json_pack("{so so* so* so}", judge->count ? "compared_with" : "no_bar", flesh_json_text(judge->words),
                             "factor", judge->count ? json_real(judge->factor) : NULL, "left_out",
                             judge->count && *judge->left_out ? flesh_json_text(judge->left_out) : NULL, "companions", companions);
  char *text = json_dumps(object, JSON_COMPACT);
  json_decref(object);
  return text;
}

/* Returns whether the volumes of a material are so stiff, as with a Poisson's ratio from 0.48 on, that J of four-node
 * tets differs from that of ten-node tets by chance. */
static int is_stiff(const flesh_scene *scene)
{
  static const double least_ratio = 24;
  double mu, lambda;
  int stiff = 0;
  for (int k = 0; scene->body.materials && k < flesh_scene_material_count(scene); k++)
    stiff |= !flesh_material_small_strain(&scene->body.materials[k], &mu, &lambda, NULL) &&
             lambda >= least_ratio * (1 - 1e-9) * mu;
  return stiff;
}

/* Fills tables for the SQL with how the run is judged, and with the probes at points. */
static int fill(bars *b)
{
  flesh_study_store *store = &b->store;
  int count, held, source = 1;
  int status = flesh_study_store_execute(store, "CREATE TABLE judges (aspect INTEGER PRIMARY KEY, name, count, factor, better, "
                                                "coarser, doubled, adds, data);"
                                                "CREATE TABLE companions (source INTEGER PRIMARY KEY, aspect, number);"
                                                "CREATE TABLE points (probe, is_pinned); CREATE TABLE asked (result);"
                                                "CREATE TABLE same_mesh (is_stiff)");
  if (!status && b->judges[FLESH_ERROR_MESH].better && !b->scene->keys.body.refine)
    status = flesh_study_store_execute(store, "INSERT INTO same_mesh VALUES (%d)", is_stiff(b->scene));
  for (int kind = 0; kind < FLESH_ERROR_KINDS && !status; kind++) {
    const flesh_error_judge *judge = &b->judges[kind];
    char *text = judge_text(judge);
    status = text ? flesh_study_store_execute(store, "INSERT INTO judges VALUES (%d, %Q, %d, %!.17g, %d, %d, %d, %d, %Q)", kind,
                                              kind_names[kind], judge->count, judge->factor, judge->better, judge->coarser,
                                              judge->doubled, judge->adds, text) : flesh_no_memory();
    free(text);
    for (int k = 0; k < judge->count && !status; k++)
      status = flesh_study_store_execute(store, "INSERT INTO companions VALUES (%d, %d, %d)", source++, kind, k);
  }
  const flesh_probe *probes = flesh_scene_probes(b->scene, &count);
  for (int k = 0; k < count && !status; k++) {
    status = flesh_probe_is_at_pin(b->scene, &probes[k], 0, &held);
    if (!status && !isnan(probes[k].point[0]))
      status = flesh_study_store_execute(store, "INSERT INTO points VALUES (%Q, %d)", probes[k].name, held);
  }
  return status;
}

static int is_for_bars(const char *column)
{
  return strstr(column, "_error_mesh") || strstr(column, "_error_step") || strstr(column, "_smooth [");
}

/* Prints the table with its bars, which the query returns as rows and fields; they replace those that the table already has
 * and smoothed values. */
static void print_table(FILE *stream, const flesh_csv *csv, sqlite3_stmt *query)
{
  for (int row = -1; row < csv->rows; row++) {
    for (int c = 0; c < csv->columns; c++) {
      if (is_for_bars(csv->names[c])) continue;
      if (c) putc(',', stream);
      flesh_csv_print(stream, row < 0 ? csv->names[c] : flesh_csv_cell(csv, row, c));
    }
    for (int more = 1; more && sqlite3_column_int(query, 0) == row; more = sqlite3_step(query) == SQLITE_ROW)
      fprintf(stream, ",%s", (const char *)sqlite3_column_text(query, 1));
    putc('\n', stream);
  }
}

/* Writes a table with its bars, if it has any. */
static int write_table(const bars *b, const char *folder, int tab)
{
  static const char sql[] = "SELECT row, text FROM fields WHERE tab = ? ORDER BY row, id, aspect";
  flesh_csv csv = {0};
  flesh_file file;
  sqlite3_stmt *query = NULL;
  const int bad = sqlite3_prepare_v2(b->store.database, sql, -1, &query, NULL) || sqlite3_bind_int(query, 1, tab);
  int status = bad ? flesh_no_memory() : FLESH_OK;
  if (!status && sqlite3_step(query) == SQLITE_ROW) {
    const char *path = flesh_path("%s/%s", folder, files[tab]);
    status = flesh_csv_read(path, FLESH_CSV_WHOLE, &csv);
    if (!status) status = flesh_file_open(path, &file);
    if (!status) {
      print_table(file.stream, &csv, query);
      status = flesh_file_commit(&file);
    }
  }
  sqlite3_finalize(query);
  flesh_csv_clear(&csv);
  return status;
}

/* Computes the bars by SQL from the tables of the run and its companions; writes the tables and result.json, and prints
 * what they say. */
static int write_bars(bars *b, const char *folder, int quiet)
{
  const flesh_results to = {.out = folder, .quiet = quiet};
  const char *const words[] = {flesh_own_text("error_words"), NULL};
  char *paths[1 + FLESH_ERROR_COMPANIONS * FLESH_ERROR_KINDS] = {NULL}, *text = NULL;
  int count = 0, status = sqlite3_open(":memory:", &b->store.database) ? flesh_no_memory() : fill(b);
  if (!(paths[count++] = strdup(folder))) status = flesh_no_memory();
  for (int kind = 0; kind < FLESH_ERROR_KINDS; kind++)
    for (int k = 0; k < b->judges[kind].count && !status; k++)
      if (!(paths[count++] = flesh_text_new("%s/%s", folder, b->judges[kind].companions[k].folder))) status = flesh_no_memory();
  if (!status)
    status = flesh_curves_make(b->store.database, count, paths, flesh_own_text("error_columns"), flesh_own_text("error_bars"),
                               &to);
  for (int tab = 0; tab < 2 && !status; tab++) status = write_table(b, folder, tab);
  size_t size;
  const char *path = flesh_path("%s/result.json", folder);
  if (!status) status = flesh_file_load(path, &text, &size);
  if (!status) status = flesh_study_store_execute(&b->store, "INSERT INTO asked VALUES (%Q)", text);
  if (!status) status = flesh_results_make(b->store.database, path, words, &to);
  for (int k = 0; k < count; k++) free(paths[k]);
  free(text);
  return status;
}

static int make(bars *b, const flesh_runner_options *options)
{
  char *path = flesh_text_new("%s/scene.yaml", options->out);
  int status = path ? flesh_scene_read(path, 0, NULL, &b->scene) : flesh_no_memory();
  flesh_runner_options of_companions = *options;
  of_companions.scene_path = path;
  for (int kind = FLESH_ERROR_KINDS - 1; kind >= 0 && !status; kind--) {
    status = flesh_error_choose(b->scene, path, (flesh_error_kind)kind, b->judges);
    if (!status) status = flesh_error_run(&of_companions, &b->judges[kind]);
  }
  free(path);
  return status ? status : write_bars(b, options->out, options->quiet);
}

int flesh_error_bars(const flesh_runner_options *options)
{
  bars b = {.store = {.path = "error bars"}};
  flesh_folder_claim claim = {.descriptor = -1};
  int status = flesh_output_claim(options->out, "run", &claim);
  if (!status) status = make(&b, options);
  for (int kind = 0; kind < FLESH_ERROR_KINDS; kind++) flesh_error_judge_close(&b.judges[kind]);
  sqlite3_close(b.store.database);
  flesh_scene_destroy(&b.scene);
  flesh_folder_claim_release(&claim);
  return status;
}

int flesh_error_catch_up(const flesh_runner_options *options, int wanted)
{
  json_t *result = NULL;
  flesh_scene *scene = NULL;
  int status = flesh_json_read(flesh_path("%s/result.json", options->out), &result);
  const int has = json_object_get(result, "error_bars") != NULL;
  if (!status && !has && !wanted) status = flesh_scene_read(flesh_path("%s/scene.yaml", options->out), 0, NULL, &scene);
  if (scene) wanted = scene->keys.output.error_bars;
  json_decref(result);
  flesh_scene_destroy(&scene);
  return status || has || !wanted ? status : flesh_error_bars(options);
}
