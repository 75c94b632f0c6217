/* map_write.c: writes the results of fitting a map: result.json, fit.csv, tets.csv, map.vtu, the fitted scenes, and
 * sentences. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/sort.h"
#include "cli/json_memory.h"
#include "cli/path.h"
#include "fit/map.h"
#include "mesh/inspect.h"
#include "output/vtu.h"
#include "study/csv.h"

/* Residuals above this many deviations are mentioned; a tet is hardly known if the deviation of its q is above
 * `hardly`. */
static const double odd_scale = 1.5, hardly = 0.5;

typedef struct report {
  const flesh_fit *fit;
  const flesh_fit_map *map;
  const flesh_fit_found *found;
  double median, largest; /* deviations of q */
  int hardly_known, at_bounds;
} report;

static int measure(report *r)
{
  const size_t n = (size_t)r->map->count;
  double *sorted = malloc(n * sizeof *sorted);
  if (!sorted) return flesh_fail(FLESH_ERR_MEMORY, "out of memory for the results of a map");
  for (size_t k = 0; k < n; k++) {
    r->at_bounds += r->found->at_bound[(size_t)r->fit->key_count + k] != 0;
    if (r->found->deviations) r->hardly_known += r->found->deviations[k] > hardly;
  }
  if (r->found->deviations) {
    memcpy(sorted, r->found->deviations, n * sizeof *sorted);
    qsort(sorted, n, sizeof *sorted, flesh_compare_double);
    r->median = sorted[n / 2];
    r->largest = sorted[n - 1];
  }
  free(sorted);
  return FLESH_OK;
}

static int report_of(const flesh_fit *fit, const flesh_fit_found *found, report *r)
{
  *r = (report){.fit = fit, .map = fit->map, .found = found, .median = NAN, .largest = NAN};
  return measure(r);
}

static void tell_residuals(const report *r, flesh_fit_statistics *to)
{
  const flesh_fit_map *map = r->map;
  const double scale = to->scale, excess = scale * scale;
  if (isnan(map->weight) && excess < 0.95 && r->found->stage_count == 1)
    flesh_fit_say(to, "A nearly uniform value agrees with the measurements within their deviations: they say nothing of "
                      "differences between tets.");
  else if (isnan(map->weight) && excess > 1.05)
    flesh_fit_say(to, "The residuals stay %.3g times the stated deviations, however rough the map may be: the deviations are too "
                      "small, or the scene leaves something out. This is the smoothest map that fits as well.", scale);
  else if (!isnan(map->weight) && (scale > odd_scale || scale < 1 / odd_scale))
    flesh_fit_say(to, "The residuals are %.3g times the stated deviations: the weight is %s, or the deviations are not those of "
                      "the measurements.", scale, scale > 1 ? "too large" : "too small");
}

int flesh_fit_map_tell(const flesh_fit *fit, const flesh_fit_found *found, flesh_fit_statistics *to)
{
  report r;
  const int status = report_of(fit, found, &r);
  if (status) return status;
  tell_residuals(&r, to);
  if (found->deviations) {
    flesh_fit_say(to, "The measurements determine about %.0f numbers of the map; the penalty fills in the rest of its %d tets.",
                  found->determined, r.map->count);
    flesh_fit_say(to, "The deviation of a tet's value is %.2g %%%s (median), at most %.2g %%, where maps are as smooth as the "
                      "penalty says.", 100 * r.median, r.map->of.spacing == FLESH_LOGARITHMIC ? "" : " of start",
                  100 * r.largest);
    if (r.hardly_known)
      flesh_fit_say(to, "%d tets have a deviation above %g %%: the measurements hardly say their values (tets.csv).",
                    r.hardly_known, 100 * hardly);
  } else flesh_fit_say(to, "Deviations of tets, and of parameters beside them, are found for maps of 2500 tets and fewer.");
  if (r.at_bounds)
    flesh_fit_say(to, "%d tets lie at a bound (from, to): their values may be beyond it.", r.at_bounds);
  return FLESH_OK;
}

static int write_tets(const report *r, const flesh_mesh *mesh)
{
  const flesh_fit_map *map = r->map;
  flesh_file file;
  const int status = flesh_table_open(r->fit->options.out, "tets.csv", &file);
  if (status) return status;
  const char *unit = *map->unit ? map->unit : "1";
  fprintf(file.stream, "tet,X [m],Y [m],Z [m],%s [%s],low_95 [%s],high_95 [%s],deviation of q,resolution\n", map->of.key, unit,
          unit, unit);
  for (int k = 0; k < map->count; k++) {
    const double p = r->found->p[r->fit->key_count + k], q = flesh_fit_q_of(&map->of, p);
    const double deviation = r->found->deviations ? r->found->deviations[k] : NAN;
    double centre[3];
    fprintf(file.stream, "%d", map->tets[k]);
    flesh_mesh_centre(mesh, flesh_mesh_positions(mesh), map->tets[k], centre);
    for (int c = 0; c < 3; c++) flesh_table_field(file.stream, centre[c]);
    const double fields[] = {p, flesh_fit_p_of(&map->of, q - 1.96 * deviation),
                             flesh_fit_p_of(&map->of, q + 1.96 * deviation), deviation,
                             r->found->resolutions ? r->found->resolutions[k] : NAN};
    for (int c = 0; c < 5; c++) flesh_table_field(file.stream, fields[c]);
    putc('\n', file.stream);
  }
  return flesh_file_commit(&file);
}

/* Writes the body at rest with the map as cell data; NaN in tets outside the map. */
static int write_vtu(const report *r, const flesh_mesh *mesh)
{
  const int tets = flesh_mesh_tet_count(mesh);
  const double *const from[] = {r->found->p + r->fit->key_count, r->found->deviations, r->found->resolutions};
  double *room = malloc(3 * (size_t)tets * sizeof *room);
  int status = room ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "out of memory for the results of a map");
  for (int k = 0; k < 3 * tets && !status; k++) room[k] = NAN;
  for (int a = 0; a < 3 && !status; a++)
    for (int k = 0; k < r->map->count && from[a]; k++) room[(size_t)a * (size_t)tets + (size_t)r->map->tets[k]] = from[a][k];
  const char *unit = *r->map->unit ? r->map->unit : NULL;
  const flesh_vtu_array arrays[] = {{.name = r->map->of.key, .components = 1, .doubles = room, .unit = unit},
                                    {.name = "deviation", .components = 1, .doubles = room + tets},
                                    {.name = "resolution", .components = 1, .doubles = room + 2 * (size_t)tets}};
  const flesh_vtu content = {.points = flesh_mesh_node_count(mesh), .tets = tets, .positions = flesh_mesh_positions(mesh),
                             .tet_nodes = flesh_mesh_tets(mesh), .edge_nodes = flesh_mesh_tet_edges(mesh),
                             .cell_array_count = from[1] ? 3 : 1, .cell_arrays = arrays};
  if (!status) status = flesh_vtu_write(flesh_path("%s/map.vtu", r->fit->options.out), &content);
  free(room);
  return status;
}

static json_t *stages_json(const flesh_fit_found *found)
{
  json_t *list = json_array();
  for (int k = 0; k < found->stage_count; k++) {
    const flesh_fit_stage *s = &found->stages[k];
    json_array_append_new(list, json_pack("{sfsfsfsfsisb}", "weight", s->weight, "sum_of_squares", s->squares, "penalty",
                                          s->penalty, "determined_numbers", s->determined, "iterations", s->iterations,
                                          "converged", s->converged));
  }
  return list;
}

json_t *flesh_fit_map_json(const flesh_fit *fit, const flesh_fit_found *found)
{
  report r;
  if (report_of(fit, found, &r)) return NULL;
  return json_pack("{sssisssfsssosososo}", "constant", r.map->of.key, "tets", r.map->count, "penalty",
                   r.map->penalty == FLESH_FIT_QUADRATIC ? "quadratic" : "variation", "weight",
                   found->stages[found->chosen].weight, "weight_from", isnan(r.map->weight) ? "discrepancy" : "spec",
                   "determined_numbers", flesh_json_number(found->determined), "median_deviation", flesh_json_number(r.median),
                   "largest_deviation", flesh_json_number(r.largest), "stages", stages_json(found));
}

int flesh_fit_map_tables(const flesh_fit *fit, const flesh_fit_found *found)
{
  const report r = {.fit = fit, .map = fit->map, .found = found};
  flesh_scene *scene = NULL;
  int status = flesh_fit_scene_at(fit, 0, found->p, &scene);
  if (!status) status = write_tets(&r, flesh_scene_mesh(scene));
  if (!status) status = write_vtu(&r, flesh_scene_mesh(scene));
  flesh_scene_destroy(&scene);
  return status;
}
