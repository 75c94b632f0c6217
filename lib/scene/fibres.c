/* fibres.c: which tets have muscle fibres, and the directions of the fibres. */
#include "scene/fibres.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/rising.h"
#include "base/scan.h"
#include "math/mat3.h"
#include "mesh/inspect.h"
#include "mesh/mesh.h"
#include "mesh/split_part.h"
#include "scene/selection.h"

#define AT(member) .offset = offsetof(flesh_fibre_field, member)
#define ALONG(member) .offset = offsetof(flesh_fibre_field, along.member) - offsetof(flesh_fibre_field, along)
static const flesh_key along_keys[] = {
    {.name = "from", .type = FLESH_KEY_VECTOR, ALONG(from), .unit = "m", .doc = "one end"},
    {.name = "to", .type = FLESH_KEY_VECTOR, ALONG(to), .unit = "m", .doc = "other end"},
    {0}};
const flesh_key flesh_fibre_field_keys[] = {
    {.name = "direction", .type = FLESH_KEY_VECTOR, AT(direction), .default_value = "",
     .doc = "the same direction everywhere, of any length"},
    {.name = "file", .type = FLESH_KEY_PATH, AT(file), .default_value = "",
     .doc = "text file with a row \"x y z\" for each tet of the mesh (of the body, if the muscle names one), in its "
            "order: the direction at rest, of any length; 0 0 0 for no fibre"},
    {.name = "along", .type = FLESH_KEY_OBJECT, AT(along), .default_value = "", .children = along_keys,
     .doc = "circular arcs from one point to another, as in a spindle: each tet's fibre is the tangent of the circle "
            "through both points and the tet's centre"},
    {0}};
#undef AT
#undef ALONG

static int has_box(const flesh_tet_selection *s) { return !isnan(s->box[0]); }

static int is_chosen(const flesh_tet_selection *s, const flesh_mesh_set *set, const flesh_body_part *part,
                     const flesh_mesh *mesh, int tet)
{
  double centre[3];
  int of_region = s->regions.count == 0;
  for (int k = 0; k < s->regions.count; k++) of_region |= flesh_mesh_regions(mesh)[tet] == s->regions.values[k];
  if (!of_region || (part && (tet < part->first_tet || tet - part->first_tet >= part->tets))) return 0;
  if (set && flesh_rising_find(set->tets.values, 0, set->tets.count, tet) < 0) return 0;
  if (!has_box(s)) return 1;
  flesh_mesh_centre(mesh, flesh_mesh_positions(mesh), tet, centre);
  for (int c = 0; c < 3; c++)
    if (!(centre[c] >= s->box[c] && centre[c] <= s->box[3 + c])) return 0;
  return 1;
}

/* Finds the chosen tets, without directions. */
static int choose_tets(const flesh_tet_selection *s, const flesh_body_part *part, const flesh_mesh *mesh,
                       flesh_chosen_fibres *chosen)
{
  const int tets = flesh_mesh_tet_count(mesh);
  const flesh_mesh_set *set;
  const int status = flesh_selection_set(s->set, mesh, &set);
  if (status) return status;
  for (int c = 0; has_box(s) && c < 3; c++)
    if (s->box[c] > s->box[3 + c])
      return flesh_fail(FLESH_ERR_ARGUMENT, "box has low %c = %g above high %c = %g; it must be [[low], [high]]",
                        'x' + c, s->box[c], 'x' + c, s->box[3 + c]);
  chosen->tets = malloc(((size_t)tets + 1) * sizeof *chosen->tets);
  if (!chosen->tets) return flesh_fail(FLESH_ERR_MEMORY, "no memory to choose among %d tets", tets);
  for (int e = 0; e < tets; e++)
    if (is_chosen(s, set, part, mesh, e)) chosen->tets[chosen->count++] = e;
  if (mesh->split) mesh->split->found = chosen->count; /* found in this part; share.c asks all ranks */
  if (!chosen->count && !mesh->split)
    return flesh_fail(FLESH_ERR_ARGUMENT, "no tet of the mesh meets all of the given regions, box, set and body");
  chosen->directions = calloc(3 * (size_t)chosen->count + 1, sizeof *chosen->directions);
  return chosen->directions ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for %d fibres", chosen->count);
}

/* Computes the direction at x of the circle through a, b and x: the field of a line source at a and a line sink at b in
 * the plane of the three. */
static void tangent(const double a[3], const double b[3], const double x[3], double direction[3])
{
  double from[3], to[3];
  for (int c = 0; c < 3; c++) from[c] = x[c] - a[c], to[c] = x[c] - b[c];
  const double near_a = flesh_vec3_dot(from, from), near_b = flesh_vec3_dot(to, to);
  for (int c = 0; c < 3; c++) direction[c] = from[c] * near_b - to[c] * near_a;
  const double length = sqrt(flesh_vec3_dot(direction, direction));
  for (int c = 0; c < 3; c++) direction[c] = length > 0 ? direction[c] / length : b[c] - a[c];
}

/* Reads the rows of `count` tets from `first` on and keeps those of the chosen tets. `numbers`: the tets' numbers in
 * the whole if the mesh is a part, else NULL. */
static int read_rows(flesh_scanner *s, int first, int count, const int *numbers, flesh_chosen_fibres *chosen)
{
  int kept = 0;
  for (int e = 0; e < count; e++) {
    double row[3];
    if (!flesh_scan_next(s))
      return flesh_scan_fail(s, "the file has %d rows; a fibre's direction is needed for each of the %d tets", e, count);
    s->index = e;
    for (int c = 0; c < 3; c++) {
      int status = flesh_scan_real(s, &row[c]);
      if (status) return status;
    }
    int status = flesh_scan_row_end(s);
    if (status) return status;
    const int tet = kept < chosen->count ? chosen->tets[kept] : -1;
    if (tet >= 0 && (numbers ? numbers[tet] : tet) == first + e)
      memcpy(chosen->directions + 3 * (size_t)kept++, row, sizeof row);
  }
  if (flesh_scan_next(s)) return flesh_scan_fail(s, "the file has more rows than the mesh has tets (%d)", count);
  return FLESH_OK;
}

static int read_file(const char *path, const flesh_body_part *part, const flesh_mesh *mesh, flesh_chosen_fibres *chosen)
{
  flesh_scanner scanner;
  int status = flesh_scan_open(&scanner, path);
  scanner.item = "tet";
  scanner.form = "x y z";
  const flesh_split_part *split = mesh->split;
  const int tets = split ? split->whole_tets : part ? part->tets : flesh_mesh_tet_count(mesh);
  if (!status) status = read_rows(&scanner, part ? part->first_tet : 0, tets, split ? split->tets : NULL, chosen);
  flesh_scan_close(&scanner);
  return status;
}

int flesh_tets_choose(const flesh_tet_selection *selection, const flesh_body *body, flesh_chosen_fibres *chosen)
{
  const flesh_body_part *part;
  *chosen = (flesh_chosen_fibres){0};
  const int status = flesh_selection_body(selection->body, body, &part);
  return status ? status : choose_tets(selection, part, body->mesh, chosen);
}

int flesh_fibres_choose(const flesh_tet_selection *selection, const flesh_fibre_field *field, const flesh_body *body,
                        flesh_chosen_fibres *chosen)
{
  const flesh_mesh *mesh = body->mesh;
  const flesh_body_part *part;
  const int direction = !isnan(field->direction[0]), along = !isnan(field->along.from[0]), file = field->file != NULL;
  *chosen = (flesh_chosen_fibres){0};
  if (direction + along + file != 1)
    return flesh_fail(FLESH_ERR_ARGUMENT, "%d kinds of fibres are given; one of direction, file or along is needed",
                      direction + along + file);
  const double *a = field->along.from, *b = field->along.to, *d = field->direction;
  if (direction && d[0] == 0 && d[1] == 0 && d[2] == 0)
    return flesh_fail(FLESH_ERR_ARGUMENT, "fibres.direction is [0, 0, 0]; it must point somewhere");
  if (along && a[0] == b[0] && a[1] == b[1] && a[2] == b[2])
    return flesh_fail(FLESH_ERR_ARGUMENT, "fibres.along.from and .to are the same point; they must be two");
  int status = flesh_selection_body(selection->body, body, &part);
  if (!status) status = choose_tets(selection, part, mesh, chosen);
  if (!status && file) return read_file(field->file, part, mesh, chosen);
  for (int k = 0; !status && k < chosen->count; k++) {
    double centre[3], *to = chosen->directions + 3 * (size_t)k;
    flesh_mesh_centre(mesh, flesh_mesh_positions(mesh), chosen->tets[k], centre);
    if (along) tangent(a, b, centre, to);
    else memcpy(to, d, 3 * sizeof *to);
  }
  return status;
}

void flesh_fibres_free(flesh_chosen_fibres *chosen)
{
  free(chosen->tets);
  free(chosen->directions);
  *chosen = (flesh_chosen_fibres){0};
}
