/* picture_body.c: makes the surface of a body and its colours. */
#include "picture/picture_body.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/sort.h"
#include "error/meshes.h"
#include "material/form.h"
#include "mesh/inspect.h"
#include "mesh/pieces.h"
#include "output/tet_stress.h"

/* ---- curved faces: six nodes each, divided into sixteen triangles ---- */

enum { PARTS = 4 };

/* Returns the vertex at (i, j, k)/4 of a face; new vertices inside the face become known by inside [3]. */
static int vertex_at(flesh_curved_surface *s, const int n[6], const int at[3], int inside[3])
{
  int *place = &inside[at[0] == 2 ? 0 : at[1] == 2 ? 1 : 2];
  for (int d = 0; d < 3; d++) {
    const int from = (d + 1) % 3, to = (d + 2) % 3, middle = n[3 + from];
    if (at[d] == PARTS) return n[d];
    if (at[d]) continue;
    if (at[from] == at[to]) return middle;
    /* A quarter of the way between two corners; every middle node belongs to one edge. */
    place = &s->places[2 * middle + (at[from] > at[to] ? n[from] > n[to] : n[to] > n[from])];
  }
  if (!*place) *place = s->vertices++;
  int *six = s->six + 6 * (*place - s->nodes), *eighths = s->eighths + 6 * (*place - s->nodes);
  memcpy(six, n, 6 * sizeof *six);
  /* In quarters, L (2 L - 1) and 4 L L' are multiples of 1/8. */
  for (int d = 0; d < 3; d++) eighths[d] = at[d] * (at[d] - 2), eighths[3 + d] = 2 * at[d] * at[(d + 1) % 3];
  return *place;
}

/* Appends the triangle of three lattice points of a face of tet `tet`; its side is an edge of the mesh if both ends of
 * it are on one. */
static void add_triangle(flesh_curved_surface *s, int tet, const int n[6], int points[3][3], int inside[3])
{
  const int t = s->triangles++;
  s->tets[t] = tet;
  for (int k = 0; k < 3; k++) {
    const int *p = points[(k + 1) % 3], *q = points[(k + 2) % 3];
    s->corners[3 * (size_t)t + (size_t)k] = vertex_at(s, n, points[k], inside);
    if (!((!p[0] && !q[0]) || (!p[1] && !q[1]) || (!p[2] && !q[2]))) s->hidden[t] |= (uint8_t)(1 << k);
  }
}

/* Adds the face whose first triangle in the mesh is `first`, in small triangles. */
static void add_face(const flesh_mesh *mesh, int first, flesh_curved_surface *s)
{
  const int tet = mesh->surface_tets[first], *own = mesh->surface + 3 * (size_t)first;
  if (flesh_mesh_face_parts(mesh, tet) == 1) {
    const int t = s->triangles++;
    s->tets[t] = tet;
    memcpy(s->corners + 3 * (size_t)t, own, 3 * sizeof *s->corners);
    return;
  }
  /* Its corners a, b, c and the middles of ab, bc, ca, from its four triangles, which follow each other. */
  const int n[6] = {own[0], own[4], own[8], own[1], own[5], own[2]};
  int inside[3] = {0};
  for (int j = 0; j < PARTS; j++)
    for (int k = 0; j + k < PARTS; k++) {
      const int i = PARTS - j - k;
      int up[3][3] = {{i, j, k}, {i - 1, j + 1, k}, {i - 1, j, k + 1}};
      int down[3][3] = {{i - 1, j + 1, k}, {i - 2, j + 1, k + 1}, {i - 1, j, k + 1}};
      add_triangle(s, tet, n, up, inside);
      if (i > 1) add_triangle(s, tet, n, down, inside);
    }
}

int flesh_curved_surface_make(const flesh_mesh *mesh, flesh_arena *arena, flesh_curved_surface *s)
{
  /* Each of the mesh's triangles becomes at most four, with at most three vertices that are not nodes. */
  const size_t nodes = (size_t)flesh_mesh_node_count(mesh), most = (size_t)mesh->triangles;
  *s = (flesh_curved_surface){.nodes = (int)nodes, .vertices = (int)nodes,
                              .places = flesh_arena_take(arena, (2 * nodes + 52 * most) * sizeof(int) + 4 * most)};
  if (!s->places) return flesh_picture_no_memory();
  s->six = s->places + 2 * nodes;
  s->eighths = s->six + 18 * most;
  s->corners = s->eighths + 18 * most;
  s->tets = s->corners + 12 * most;
  s->hidden = (uint8_t *)(s->tets + 4 * most);
  for (int k = 0; k < mesh->triangles; k += flesh_mesh_face_parts(mesh, mesh->surface_tets[k])) add_face(mesh, k, s);
  return FLESH_OK;
}

/* Computes values at the vertices [components*vertices] from those at the nodes [components*nodes], by the faces' quadratic
 * shape functions. */
static void interpolate(const flesh_curved_surface *s, int components, const double *nodal, double *values)
{
  const size_t m = (size_t)components, nodes = (size_t)s->nodes;
  memcpy(values, nodal, m * nodes * sizeof *values);
  for (size_t v = nodes; v < (size_t)s->vertices; v++)
    for (size_t c = 0; c < m; c++) {
      const int *six = s->six + 6 * (v - nodes), *eighths = s->eighths + 6 * (v - nodes);
      double sum = 0;
      for (int a = 0; a < 6; a++)
        if (eighths[a]) sum += eighths[a] / 8. * nodal[m * (size_t)six[a] + c];
      values[m * v + c] = sum;
    }
}

/* ---- values and colours ---- */

/* Palette for fields with a centre: from blue through a neutral middle to red. */
static const unsigned char diverging[][3] = {
    {38, 54, 140}, {104, 154, 208}, {238, 230, 220}, {230, 152, 98}, {160, 34, 44}};
/* Palette for fields that begin at zero: from light to dark through warm hues. */
static const unsigned char rising[][3] = {
    {247, 232, 214}, {244, 190, 130}, {226, 116, 74}, {164, 40, 78}, {104, 22, 92}};
/* Colours of the regions; the first is that of flesh. */
static const unsigned char regions[][3] = {
    {224, 164, 140}, {236, 222, 196}, {150, 172, 190}, {190, 130, 160}, {150, 186, 140}};
static const unsigned char obstacle_colour[3] = {168, 176, 188};

void flesh_picture_colour(flesh_picture_field field, double part, double rgb[3])
{
  const unsigned char(*palette)[3] = field == FLESH_PICTURE_J ? diverging : rising;
  double at = 4 * fmin(fmax(part, 0), 1);
  int k = (int)fmin(at, 3);
  for (int d = 0; d < 3; d++)
    rgb[d] = (palette[k][d] + (at - k) * (palette[k + 1][d] - palette[k][d])) / 255;
}

static void linear(const unsigned char colour[3], float rgb[3])
{
  for (int d = 0; d < 3; d++) rgb[d] = (float)flesh_srgb_decode(colour[d] / 255.);
}

/* Computes von Mises' stress in the middle of every tet, from Cauchy's stress and that of the system's effects; NaN
 * where it is undefined. */
static int measure_stress(const flesh_picture_panel *panel, double *values)
{
  static const double centre[4] = {0.25, 0.25, 0.25, 0.25};
  const flesh_state state = {.t = panel->t, .x = (double *)panel->x}; /* only read */
  flesh_tet_stress stress;
  const int status = flesh_tet_stress_open(panel->body, panel->system, &stress);
  for (int t = 0; t < flesh_mesh_tet_count(panel->body->mesh) && !status; t++) {
    flesh_strain_point at;
    flesh_tet_stress_at(&stress, &state, t, centre, &at);
    const double mean = (at.tau[0] + at.tau[4] + at.tau[8]) / 3;
    double sum = 0;
    for (int k = 0; k < 9; k++) sum += pow(at.tau[k] - (k % 4 ? 0 : mean), 2);
    values[t] = at.J > 0 ? sqrt(1.5 * sum) / at.J : NAN;
  }
  flesh_tet_stress_clear(&stress);
  return status;
}

/* Computes Young's modulus of every tet at small strains; NaN where it is undefined. */
static void measure_young(const flesh_body *body, double *values)
{
  for (int t = 0; t < flesh_mesh_tet_count(body->mesh); t++) {
    double mu, lambda;
    const flesh_material *material = &body->materials[body->tet_material ? body->tet_material[t] : 0];
    const int status = flesh_material_small_strain(material, &mu, &lambda, NULL);
    values[t] = status ? NAN : flesh_young_of_lame(mu, lambda);
  }
}

/* Computes the absolute value of every tet's contribution to the mesh's error of the panel's column. */
static int measure_error(const flesh_picture_panel *panel, double *values)
{
  const flesh_state state = {.t = panel->t, .x = (double *)panel->x, .v = (double *)panel->v}; /* only read */
  double cut_off;
  int is_goal = 0, status = FLESH_OK;
  if (flesh_mesh_order(panel->body->mesh) == 2)
    status = flesh_error_indicate(panel->scene, &state, panel->column, values, &is_goal, &cut_off);
  if (!status && !is_goal)
    status = flesh_fail(FLESH_ERR_ARGUMENT, "the colours of --error %s need ten-node tets and a position of a probe, as "
                                            "tip.position_z", panel->column);
  for (int t = 0; t < flesh_mesh_tet_count(panel->body->mesh) && !status; t++) values[t] = fabs(values[t]);
  return status;
}

/* Computes values at nodes from those of tets. */
static int average(const flesh_mesh *mesh, const double *tet_values, double *values)
{
  int nodes = flesh_mesh_node_count(mesh);
  double *weights = calloc((size_t)nodes, sizeof *weights);
  if (!weights) return flesh_picture_no_memory();
  for (int i = 0; i < nodes; i++) values[i] = 0;
  for (int t = 0; t < flesh_mesh_tet_count(mesh); t++) {
    double volume = flesh_mesh_tet_volumes(mesh)[t];
    if (!isfinite(tet_values[t])) continue;
    int n[10], size = flesh_mesh_tet_nodes(mesh, t, n);
    for (int k = 0; k < size; k++) {
      values[n[k]] += volume * tet_values[t];
      weights[n[k]] += volume;
    }
  }
  for (int i = 0; i < nodes; i++) values[i] = weights[i] > 0 ? values[i] / weights[i] : NAN;
  free(weights);
  return FLESH_OK;
}

void flesh_picture_jacobians(const flesh_mesh *mesh, const double *x, double *J)
{
  flesh_mesh_mean_jacobians(mesh, x, J);
  flesh_mesh_jacobians(mesh, x, J + flesh_mesh_tet_count(mesh), NULL, NULL);
}

/* Gives the mean of J in each tet or, with `least`, its least value there. */
static void measure_J(const flesh_picture_panel *panel, int least, double *J)
{
  const flesh_mesh *mesh = panel->body->mesh;
  const size_t tets = (size_t)flesh_mesh_tet_count(mesh);
  if (panel->J) memcpy(J, panel->J + (least ? tets : 0), sizeof *J * tets);
  else if (least) flesh_mesh_jacobians(mesh, panel->x, J, NULL, NULL);
  else flesh_mesh_mean_jacobians(mesh, panel->x, J);
}

int flesh_picture_is_inverted(const flesh_picture_panel *panel)
{
  const int tets = flesh_mesh_tet_count(panel->body->mesh);
  int inverted = 0;
  if (!panel->J) flesh_mesh_jacobians(panel->body->mesh, panel->x, NULL, NULL, &inverted);
  for (int t = 0; t < tets && panel->J; t++) inverted += !(panel->J[tets + t] > 0);
  return inverted > 0;
}

static void find_extremes(int count, const double *values, double extremes[2])
{
  if (!extremes) return;
  for (int i = 0; i < count; i++) {
    if (!isfinite(values[i])) continue;
    extremes[0] = fmin(extremes[0], values[i]); /* fmin and fmax ignore NaN */
    extremes[1] = fmax(extremes[1], values[i]);
  }
}

int flesh_picture_values(const flesh_picture_panel *panel, flesh_picture_field field,
                         double **values, double extremes[2])
{
  const flesh_mesh *mesh = panel->body->mesh;
  int nodes = flesh_mesh_node_count(mesh), tets = flesh_mesh_tet_count(mesh), status = FLESH_OK;
  *values = NULL;
  if (extremes) extremes[0] = extremes[1] = NAN;
  if (field == FLESH_PICTURE_PLAIN || !panel->x) return FLESH_OK;
  if (field != FLESH_PICTURE_J && field != FLESH_PICTURE_SPEED && !panel->body->materials)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the body has no material, and so no %s to show",
                      field == FLESH_PICTURE_YOUNG ? "stiffness" : "stress");
  double *made = malloc(sizeof *made * (size_t)nodes);
  double *of_tets = malloc(sizeof *of_tets * (size_t)tets);
  if (!made || !of_tets) status = flesh_picture_no_memory();
  else if (field == FLESH_PICTURE_SPEED) {
    for (int i = 0; i < nodes; i++) {
      const double *v = panel->v + 3 * (size_t)i;
      made[i] = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    }
    find_extremes(nodes, made, extremes);
  } else {
    if (field == FLESH_PICTURE_J) measure_J(panel, 0, of_tets);
    else if (field == FLESH_PICTURE_YOUNG) measure_young(panel->body, of_tets);
    else if (field == FLESH_PICTURE_ERROR) status = measure_error(panel, of_tets);
    else status = measure_stress(panel, of_tets);
    if (!status) find_extremes(tets, of_tets, extremes);
    if (!status) status = average(mesh, of_tets, made);
  }
  free(of_tets);
  if (status) free(made);
  else *values = made;
  return status;
}

/* If the mesh has several regions, gives every boundary triangle the colour of its tet's region, by the rank of the
 * region's tag. */
static int colour_regions(flesh_picture_scene *scene, const flesh_mesh *mesh, const int *behind, flesh_render_surface *s)
{
  enum { COLOURS = sizeof regions / sizeof *regions };
  int *tags, count = flesh_mesh_region_list(mesh, &tags);
  float *rgb = tags && count > 1 ? flesh_arena_take(&scene->arena, sizeof *rgb * 3 * (size_t)s->triangles) : NULL;
  const int lacks = !tags || (count > 1 && !rgb);
  for (int t = 0; t < s->triangles && rgb; t++) {
    const int *found = bsearch(&flesh_mesh_regions(mesh)[behind[t]], tags, (size_t)count, sizeof *tags, flesh_compare_int);
    linear(regions[(found - tags) % COLOURS], rgb + 3 * (size_t)t);
  }
  s->triangle_colours = rgb;
  free(tags);
  return lacks ? flesh_picture_no_memory() : FLESH_OK;
}

/* Writes the colours of values [vertices] to rgb [3*vertices]. */
static void colour_values(flesh_picture_field field, const flesh_picture_frame *frame, int vertices,
                          const double *values, float *rgb)
{
  for (int v = 0; v < vertices; v++) {
    double encoded[3], part = (values[v] - frame->low) / (frame->high - frame->low);
    flesh_picture_colour(field, isnan(part) ? 0 : part, encoded);
    for (int d = 0; d < 3; d++) rgb[3 * (size_t)v + (size_t)d] = (float)flesh_srgb_decode(encoded[d]);
  }
}

/* Replaces s by the boundary of curved tets, and *values by values at its vertices; both are in the scene's arena. */
static int add_curved(const flesh_mesh *mesh, const flesh_picture_panel *panel, flesh_picture_scene *scene,
                      flesh_render_surface *s, const double **values, const int **behind)
{
  flesh_curved_surface curved;
  const int status = flesh_curved_surface_make(mesh, &scene->arena, &curved);
  if (status) return status;
  const size_t vertices = (size_t)curved.vertices;
  double *x = flesh_arena_take(&scene->arena, sizeof *x * 3 * vertices), *rest = flesh_arena_take(&scene->arena, sizeof *rest * 3 * vertices);
  double *own = flesh_arena_take(&scene->arena, sizeof *own * vertices);
  if (!x || !rest || !own) return flesh_picture_no_memory();
  interpolate(&curved, 3, panel->x, x);
  interpolate(&curved, 3, flesh_mesh_positions(mesh), rest);
  if (*values) interpolate(&curved, 1, *values, own);
  s->vertices = curved.vertices, s->triangles = curved.triangles;
  s->x = x, s->rest = rest, s->corners = curved.corners, s->hidden = curved.hidden;
  *values = *values ? own : NULL;
  *behind = curved.tets;
  return FLESH_OK;
}

/* Makes the first surface: the body's skin, or its boundary. */
static int make_body(const flesh_picture_panel *panel, const flesh_picture_options *options,
                     const flesh_picture_frame *frame, const double *values, flesh_picture_scene *scene)
{
  const flesh_mesh *mesh = panel->body->mesh;
  flesh_render_surface *s = scene->surfaces;
  int nodes = flesh_mesh_node_count(mesh), skinned = panel->skin && panel->surface;
  *s = (flesh_render_surface){.vertices = nodes, .x = panel->x, .rest = flesh_mesh_positions(mesh)};
  linear(regions[0], s->plain);
  s->corners = skinned ? flesh_surface_triangles(panel->surface, &s->triangles)
                       : flesh_mesh_surface(mesh, &s->triangles);
  s->edges = options->edges && !skinned;
  const int *behind = flesh_mesh_surface_tets(mesh);
  if (!skinned && flesh_mesh_order(mesh) == 2) {
    int status = add_curved(mesh, panel, scene, s, &values, &behind);
    if (status) return status;
  }
  uint8_t *marked = flesh_arena_take(&scene->arena, (size_t)s->triangles);
  double *J = flesh_arena_take(&scene->arena, sizeof *J * (size_t)flesh_mesh_tet_count(mesh));
  if (!marked || !J) return flesh_picture_no_memory();
  measure_J(panel, 1, J);
  if (skinned) {
    s->vertices = flesh_surface_vertex_count(panel->surface);
    s->rest = flesh_surface_positions(panel->surface);
    double *x = flesh_arena_take(&scene->arena, sizeof *x * 3 * (size_t)s->vertices);
    double *own = flesh_arena_take(&scene->arena, sizeof *own * (size_t)s->vertices);
    if (!x || !own) return flesh_picture_no_memory();
    flesh_skin_apply(panel->skin, 3, 0, panel->x, x);
    if (values) flesh_skin_apply(panel->skin, 1, 1, values, own);
    s->x = x;
    values = values ? own : NULL;
  }
  for (int t = 0; t < s->triangles; t++)
    marked[t] = !(J[skinned ? flesh_skin_tets(panel->skin)[s->corners[3 * (size_t)t]]
                            : behind[t]] > 0);
  s->marked = options->field == FLESH_PICTURE_PLAIN ? NULL : marked;
  if (!values) return skinned ? FLESH_OK : colour_regions(scene, mesh, behind, s);
  float *rgb = flesh_arena_take(&scene->arena, sizeof *rgb * 3 * (size_t)s->vertices);
  if (!rgb) return flesh_picture_no_memory();
  colour_values(options->field, frame, s->vertices, values, rgb);
  s->colours = rgb;
  return FLESH_OK;
}

int flesh_picture_scene_make(const flesh_picture_panel *panel, const flesh_picture_options *options,
                             const flesh_picture_frame *frame, flesh_picture_scene *scene)
{
  double *values;
  *scene = (flesh_picture_scene){0};
  if (!panel->x) return FLESH_OK;
  int status = flesh_picture_values(panel, options->field, &values, NULL);
  if (status) return status;
  status = flesh_picture_obstacles(panel, &frame->view, scene);
  if (!status) status = make_body(panel, options, frame, values, scene);
  free(values);
  for (int k = 1; k < scene->count; k++) linear(obstacle_colour, scene->surfaces[k].plain);
  if (status) flesh_arena_free(&scene->arena);
  return status;
}
