/* map.c: the keys of a map, its tets and their neighbours, and its penalty and file. */
#include "fit/map.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/file.h"
#include "base/sort.h"
#include "math/area.h"
#include "math/mat3.h"
#include "mesh/inspect.h"
#include "mesh/mesh.h"
#include "scene/scene.h"
#include "sensitivity/sensitivity.h"

static const char *const penalties[] = {"quadratic", "variation", NULL};

#define AT(member) .offset = offsetof(flesh_fit_map, member)
const flesh_key flesh_fit_map_table[] = {
    {.name = "constant", .type = FLESH_KEY_TEXT, AT(of.key), .doc = "of the first body's material: young, poisson, mu, ..."},
    {.name = "start", .type = FLESH_KEY_NUMBER, AT(of.start), .doc = "value of all tets that the search begins with"},
    {.name = "from", .type = FLESH_KEY_NUMBER, AT(of.from), .default_value = "-.inf", .doc = "least value"},
    {.name = "to", .type = FLESH_KEY_NUMBER, AT(of.to), .default_value = ".inf", .doc = "largest value"},
    {.name = "spacing", .type = FLESH_KEY_CHOICE, AT(of.spacing), .choices = flesh_spacings, .default_value = "logarithmic",
     .doc = "logarithmic: the logarithm q is searched, and its differences are penalised; linear: q is the value over start"},
    FLESH_TET_SELECTION_KEYS(flesh_fit_map, tets_chosen),
    {.name = "penalty", .type = FLESH_KEY_CHOICE, AT(penalty), .choices = penalties, .default_value = "quadratic",
     .doc = "for differences d of q over faces between tets. quadratic: d^2 (Tikhonov's, of the first order), for maps that "
            "change slowly; variation: 2 edge^2 (sqrt(1 + (d/edge)^2) - 1), like total variation, for inclusions with an edge"},
    {.name = "edge", .type = FLESH_KEY_NUMBER, AT(edge), .range = FLESH_RANGE_POSITIVE, .default_value = "0.05",
     .doc = "difference of q from which on variation counts a difference by its size and not by its square"},
    {.name = "weight", .type = FLESH_KEY_NUMBER, AT(weight), .range = FLESH_RANGE_POSITIVE, .default_value = "",
     .doc = "of the penalty, the sum over faces of (area / distance of the centres / cube root of the volume) times the above; "
            "default: the largest with which the sum of squared residuals, over their deviations, is the count of measured "
            "numbers less that of numbers that they determine"},
    {.name = NULL},
};
#undef AT

double flesh_fit_map_residual(const flesh_fit *fit, int k, const double *p, double *slope)
{
  const flesh_fit_map *map = fit->map;
  const int *pair = map->faces + 2 * k;
  const double d = flesh_fit_q_of(&map->of, p[pair[0]]) - flesh_fit_q_of(&map->of, p[pair[1]]);
  *slope = 1;
  if (map->penalty == FLESH_FIT_QUADRATIC || d == 0) return d;
  const double s = d / map->edge, root = sqrt(1 + s * s);
  /* equals sqrt(2 (root - 1)), without cancellation */
  const double size = fabs(s) * sqrt(2 / (root + 1));
  *slope = fabs(s) / (root * size);
  return copysign(map->edge * size, d);
}

/* A face of a chosen tet; a face between two of them appears twice. */
typedef struct side {
  int corners[3], tet; /* index into tets */
} side;

/* Returns the face's area over the distance of the tets' centres, m. */
static double conductance(const flesh_mesh *mesh, const int corners[3], int a, int b)
{
  double normal[3], from[3], to[3];
  flesh_area_vector_at(flesh_mesh_positions(mesh), corners, normal);
  flesh_mesh_centre(mesh, flesh_mesh_positions(mesh), a, from);
  flesh_mesh_centre(mesh, flesh_mesh_positions(mesh), b, to);
  for (int c = 0; c < 3; c++) to[c] -= from[c];
  return 0.5 * sqrt(flesh_vec3_dot(normal, normal) / flesh_vec3_dot(to, to));
}

static int find_faces(flesh_fit *fit, const flesh_mesh *mesh)
{
  flesh_fit_map *map = fit->map;
  const size_t count = 4 * (size_t)map->count;
  side *sides = flesh_arena_take(&fit->arena, count * sizeof *sides);
  map->faces = flesh_arena_take(&fit->arena, count * sizeof *map->faces);
  map->face_weights = flesh_arena_take(&fit->arena, count * sizeof *map->face_weights);
  if (!sides || !map->faces || !map->face_weights) return flesh_no_memory();
  double volume = 0;
  for (int k = 0; k < map->count; k++) {
    const int *nodes = flesh_mesh_tets(mesh) + 4 * (size_t)map->tets[k];
    volume += flesh_mesh_tet_volumes(mesh)[map->tets[k]];
    for (int f = 0; f < 4; f++) {
      side *one = &sides[4 * k + f];
      *one = (side){{nodes[(f + 1) % 4], nodes[(f + 2) % 4], nodes[(f + 3) % 4]}, k};
      qsort(one->corners, 3, sizeof *one->corners, flesh_compare_int);
    }
  }
  qsort(sides, count, sizeof *sides, flesh_compare_three_ints);
  for (size_t k = 1; k < count; k++) {
    if (flesh_compare_three_ints(&sides[k - 1], &sides[k])) continue;
    int *pair = map->faces + 2 * (size_t)map->face_count;
    pair[0] = fit->key_count + sides[k - 1].tet;
    pair[1] = fit->key_count + sides[k].tet;
    map->face_weights[map->face_count++] =
        conductance(mesh, sides[k].corners, map->tets[sides[k - 1].tet], map->tets[sides[k].tet]) / cbrt(volume);
  }
  return FLESH_OK;
}

/* Checks that the measured quantities have derivatives by a map. */
static int check_measured(const flesh_fit_experiment *e, const flesh_scene *scene)
{
  int status = FLESH_OK;
  for (int k = 0; k < e->measured_count; k++) {
    const flesh_fit_measured *m = &e->measured[k];
    if (m->table == FLESH_FIT_OF_HISTORY)
      return flesh_node_fail(m->node, "a map is fitted to positions and to columns of probes, not to history");
    for (int q = 0; q < m->quantity_count && m->table == FLESH_FIT_OF_PROBES && !e->moves && !status; q++) {
      flesh_response response;
      status = flesh_response_find(scene, m->quantities[q].name, e->end, &response);
      if (!status && response.probes) status = flesh_fail(FLESH_ERR_ARGUMENT, "it is not linear in the state");
      flesh_response_clear(&response);
      if (status && status != FLESH_ERR_MEMORY)
        return flesh_node_fail_within(status, m->node, "%s: column %s is none that a map can be fitted to: ", m->path,
                                      m->quantities[q].name);
    }
  }
  return status;
}

/* Checks that an experiment's scene can have a map. */
static int check_scene(const flesh_fit *fit, const flesh_fit_experiment *e, const flesh_scene *scene)
{
  const flesh_fit_map *map = fit->map;
  if (*e->differences)
    return flesh_node_fail(e->scene_node, "a map needs tangents, but derivatives of %s are by differences: %s", e->name,
                           e->differences);
  if (scene->keys.body.material_map || scene->keys.body.refine)
    return flesh_node_fail(e->scene_node, "the scene has body.%s, beside which no map can be fitted; leave it out",
                           scene->keys.body.refine ? "refine" : "material_map");
  if (map->tet_count && map->tet_count != scene->parts[0].tets)
    return flesh_node_fail(e->scene_node, "the body of %s has %d tets, and that of %s %d; one map needs one mesh",
                           e->name, scene->parts[0].tets, fit->experiments[0].name, map->tet_count);
  return FLESH_OK;
}

/* Chooses the tets among those of the first body. */
static int choose(flesh_fit *fit, const flesh_scene *scene)
{
  flesh_fit_map *map = fit->map;
  flesh_chosen_fibres chosen = {0};
  map->tet_count = scene->parts[0].tets;
  int status = flesh_tets_choose(&map->tets_chosen, flesh_scene_body(scene), &chosen);
  if (status) flesh_node_fail_within(status, map->of.node, "map: ");
  map->tets = flesh_arena_take(&fit->arena, ((size_t)chosen.count + 1) * sizeof *map->tets);
  if (!status && !map->tets) status = flesh_no_memory();
  for (int k = 0; k < chosen.count && !status; k++)
    if (chosen.tets[k] < map->tet_count) map->tets[map->count++] = chosen.tets[k];
  flesh_fibres_free(&chosen);
  if (!status && map->count < 2)
    status = flesh_node_fail(map->of.node, "the map has %d tets of the first body; it must have two or more", map->count);
  return status ? status : find_faces(fit, flesh_scene_mesh(scene));
}

int flesh_fit_map_prepare(flesh_fit *fit)
{
  flesh_fit_map *map = fit->map;
  map->of.scale = NAN;
  map->of.name = map->of.key;
  map->unit = "";
  const char *name = flesh_arena_print(&fit->arena, "body.material.%s", map->of.key);
  int status = name ? flesh_fit_check_numbers(&map->of) : flesh_no_memory();
  for (const flesh_key *key = flesh_material_table; key->name; key++)
    if (!strcmp(key->name, map->of.key) && key->unit) map->unit = key->unit;
  for (int e = 0; e < fit->experiment_count && !status; e++) {
    const flesh_fit_experiment *one = &fit->experiments[e];
    flesh_scene *scene = NULL;
    status = flesh_fit_check_values(one, name, &map->of, "constant");
    if (!status) status = flesh_scene_read(one->scene, one->set.count, one->set.values, &scene);
    if (!status) status = check_measured(one, scene);
    if (!status) status = check_scene(fit, one, scene);
    if (!status && !e) status = choose(fit, scene);
    flesh_scene_destroy(&scene);
  }
  return status;
}

int flesh_fit_map_write(const flesh_fit *fit, const char *path, const double *p)
{
  const flesh_fit_map *map = fit->map;
  flesh_file file;
  const int status = flesh_file_open(path, &file);
  if (status) return status;
  fprintf(file.stream, "tet,%s%s%s%s\n", map->of.key, *map->unit ? " [" : "", map->unit, *map->unit ? "]" : "");
  for (int k = 0; k < map->count; k++) {
    char number[FLESH_NUMBER_SIZE];
    fprintf(file.stream, "%d,%s\n", map->tets[k], flesh_number_text(p[fit->key_count + k], number));
  }
  return flesh_file_commit(&file);
}
