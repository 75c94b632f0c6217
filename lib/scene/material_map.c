/* material_map.c: material constants of single tets from a file, body.material_map, in place of those of the body's or
 * region's material. */
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/scan.h"
#include "mesh/mesh.h"
#include "mesh/split_part.h"
#include "scene/keys.h"
#include "scene/scene.h"
#include "scene/words.h"

enum { COLUMNS = 8 };

/* State of reading the file. */
typedef struct reading {
  flesh_scene *scene;
  flesh_scanner scanner;
  int tets; /* tets of the mesh as it was read */
  int column_count;
  const flesh_key *columns[COLUMNS]; /* after the first */
  int row_count;
  int *row_of;     /* [tets] -1: none */
  double *values;  /* [tets * COLUMNS] by rows */
} reading;

/* Returns the material constant with that name; NULL: there is none. */
static const flesh_key *constant_named(const char *name, flesh_suggestion *suggestion)
{
  for (const flesh_key *key = flesh_material_table; key->name; key++) {
    if (key->type != FLESH_KEY_NUMBER) continue;
    if (!strcmp(key->name, name)) return key;
    flesh_suggestion_offer(suggestion, key->name);
  }
  return NULL;
}

/* Checks that the unit [UNIT] of a column, if given, is that of its constant. */
static int check_unit(reading *r, const flesh_key *key)
{
  char unit[40] = "";
  const char *token;
  if (!flesh_scan_next_in_line(&r->scanner) || *r->scanner.at != '[') return FLESH_OK;
  const size_t length = flesh_scan_token(&r->scanner, &token);
  if (key->unit) snprintf(unit, sizeof unit, "[%s]", key->unit);
  if (strlen(unit) == length && !strncmp(unit, token, length)) return FLESH_OK;
  return flesh_scan_fail(&r->scanner, "%s is in %.*s; it must be %s%s", key->name, (int)(length < 40 ? length : 40), token,
                         *unit ? "in " : "without a unit", unit);
}

/* Reads the line of the names, such as tet,young [Pa]. */
static int read_head(reading *r)
{
  flesh_scanner *s = &r->scanner;
  if (!flesh_scan_next(s) || !flesh_scan_word(s, "tet"))
    return flesh_scan_fail(s, "the first column must be tet, as in tet,young [Pa]");
  while (flesh_scan_next_in_line(s)) {
    char name[64], words[512];
    const char *token;
    const size_t length = flesh_scan_token(s, &token);
    snprintf(name, sizeof name, "%.*s", (int)(length < sizeof name ? length : sizeof name - 1), token);
    flesh_suggestion suggestion = {.word = name};
    const flesh_key *key = constant_named(name, &suggestion);
    if (!key) return flesh_scan_fail(s, "%s is no constant of a material; %s", name, flesh_suggestion_text(&suggestion, words));
    for (int k = 0; k < r->column_count; k++)
      if (r->columns[k] == key) return flesh_scan_fail(s, "%s stands twice; names must differ", name);
    if (r->column_count == COLUMNS) return flesh_scan_fail(s, "the file has more than %d constants", COLUMNS);
    r->columns[r->column_count++] = key;
    const int status = check_unit(r, key);
    if (status) return status;
  }
  return r->column_count ? FLESH_OK : flesh_scan_fail(s, "no constant follows tet; one is needed, as in tet,young [Pa]");
}

static int read_rows(reading *r)
{
  flesh_scanner *s = &r->scanner;
  int status = read_head(r);
  for (; !status && flesh_scan_next(s); r->row_count++) {
    int64_t tet;
    s->index = r->row_count;
    status = flesh_scan_integer(s, &tet);
    if (status) return status;
    if (tet < 0 || tet >= r->tets) return flesh_scan_fail(s, "tet is %lld; it must be 0 to %d", (long long)tet, r->tets - 1);
    if (r->row_of[tet] >= 0) return flesh_scan_fail(s, "tet %lld stands twice; each may have one row", (long long)tet);
    r->row_of[tet] = r->row_count;
    for (int k = 0; k < r->column_count && !status; k++)
      status = flesh_scan_real(s, &r->values[(size_t)r->row_count * COLUMNS + (size_t)k]);
    if (!status) status = flesh_scan_row_end(s);
  }
  return status;
}

/* Makes the material of a row: that of `keys` with the row's constants. */
static int make_material(const reading *r, int row, int tet, const flesh_scene_material *keys, flesh_material *material)
{
  flesh_scene_material own = *keys;
  for (int k = 0; k < r->column_count; k++) {
    double *constant = (double *)((char *)&own + r->columns[k]->offset);
    if (isnan(*constant))
      return flesh_fail(FLESH_ERR_ARGUMENT, "%s: the material of tet %d has no %s that the map could replace", r->scanner.path,
                        tet, r->columns[k]->name);
    *constant = r->values[(size_t)row * COLUMNS + (size_t)k];
  }
  const int status = flesh_material_from_given((flesh_energy)own.energy, (flesh_constants)own.constants, &own.given, material);
  if (status) return flesh_fail_within(status, "%s: tet %d: ", r->scanner.path, tet);
  if (material->incompressible == r->scene->materials[0].incompressible) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT, "%s: tet %d: a map cannot change whether poisson is 0.5", r->scanner.path, tet);
}

/* Returns whether the row repeats the values of the row before. */
static int repeats(const reading *r, int row)
{
  const double *own = r->values + (size_t)row * COLUMNS;
  return row > 0 && !memcmp(own, own - COLUMNS, (size_t)r->column_count * sizeof *own);
}

/* Gives tets with rows materials of their own, which follow the others. `of` [material_count] are the keys of each
 * material, NULL for those that are not of the first body. */
static int assign(reading *r, int shift, const flesh_scene_material *const *of, int *tet_material)
{
  flesh_scene *scene = r->scene;
  const flesh_split_part *split = scene->mesh->split;
  const int before = scene->material_count, room = before + r->row_count;
  flesh_material *materials = flesh_arena_take(&scene->arena, ((size_t)room + 1) * sizeof *materials);
  flesh_element *elements = flesh_arena_take(&scene->arena, ((size_t)room + 1) * sizeof *elements);
  int *made = flesh_arena_take(&scene->arena, ((size_t)r->row_count + 1) * 2 * sizeof *made); /* and what each replaces */
  if (!materials || !elements || !made) return flesh_no_memory_for(scene->path);
  memcpy(materials, scene->materials, (size_t)before * sizeof *materials);
  memcpy(elements, scene->material_elements, (size_t)before * sizeof *elements);
  memset(made, -1, ((size_t)r->row_count + 1) * 2 * sizeof *made);
  scene->materials = materials;
  scene->material_elements = elements;
  for (int t = 0; t < scene->parts[0].tets; t++) {
    const int tet = (split ? split->tets[t] : t) >> shift, row = r->row_of[tet], from = tet_material[t];
    if (row < 0) continue;
    if (made[2 * row] < 0 && repeats(r, row) && made[2 * row - 2] >= 0 && made[2 * row - 1] == from)
      memcpy(made + 2 * row, made + 2 * row - 2, 2 * sizeof *made);
    if (made[2 * row] < 0) {
      made[2 * row] = scene->material_count++;
      made[2 * row + 1] = from;
      elements[made[2 * row]] = from < before ? elements[from] : FLESH_ELEMENT_AUTO;
      const int status = make_material(r, row, tet, of[from], &materials[made[2 * row]]);
      if (status) return status;
    }
    tet_material[t] = made[2 * row];
  }
  return FLESH_OK;
}

int flesh_scene_map_materials(flesh_scene *scene, const flesh_scene_material *const *of, int *tet_material)
{
  const flesh_split_part *split = scene->mesh->split;
  const int shift = 3 * scene->keys.body.refine;
  reading r = {.scene = scene, .tets = (split ? split->whole_tets : scene->parts[0].tets) >> shift};
  if (!scene->material_count)
    return flesh_fail(FLESH_ERR_ARGUMENT, "a map needs body.material, of which it replaces constants");
  r.row_of = flesh_arena_take(&scene->arena, ((size_t)r.tets + 1) * sizeof *r.row_of);
  r.values = flesh_arena_take(&scene->arena, ((size_t)r.tets + 1) * COLUMNS * sizeof *r.values);
  if (!r.row_of || !r.values) return flesh_no_memory_for(scene->path);
  for (int t = 0; t < r.tets; t++) r.row_of[t] = -1;
  int status = flesh_scan_open(&r.scanner, scene->keys.body.material_map);
  r.scanner.commas = 1;
  r.scanner.item = "row";
  r.scanner.form = "tet,constant";
  if (!status) status = read_rows(&r);
  if (!status) status = assign(&r, shift, of, tet_material);
  flesh_scan_close(&r.scanner);
  return status ? status : flesh_scene_make_absolute(scene, &scene->keys.body.material_map);
}
