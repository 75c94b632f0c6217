/* picture_body.c: what is seen of a body, and in which colours. */
#include "picture/picture_body.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/sort.h"
#include "mesh/pieces.h"
#include "mesh/shape.h"
#include "output/tet_stress.h"
#include "picture/picture_curved.h"

static int no_memory(void) { return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a picture"); }

/* From blue over a neutral middle to red, for what is centred. */
static const unsigned char diverging[][3] = {
    {38, 54, 140}, {104, 154, 208}, {238, 230, 220}, {230, 152, 98}, {160, 34, 44}};
/* From light to dark over warm hues, for what begins at zero. */
static const unsigned char rising[][3] = {
    {247, 232, 214}, {244, 190, 130}, {226, 116, 74}, {164, 40, 78}, {104, 22, 92}};
/* Flesh, and what else is in it. */
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

/* The change of x along the three edges from a tet's first corner; of ten nodes that of the map at its centre. */
static void edges_of(const flesh_mesh *mesh, const double *x, int t, double d[3][3])
{
  static const double centre[4] = {0.25, 0.25, 0.25, 0.25};
  int n[10];
  const int size = flesh_mesh_tet_nodes(mesh, t, n);
  for (int k = 0; k < 3; k++) {
    double along[4] = {-1, 0, 0, 0}, N[10];
    along[k + 1] = 1;
    flesh_tet10_shape_along(centre, along, N);
    for (int i = 0; i < 3; i++) {
      d[k][i] = x[3 * (size_t)n[k + 1] + (size_t)i] - x[3 * (size_t)n[0] + (size_t)i];
      if (size == 4) continue;
      d[k][i] = 0;
      for (int a = 0; a < size; a++) d[k][i] += N[a] * x[3 * (size_t)n[a] + (size_t)i];
    }
  }
}

/* Von Mises' stress of the Cauchy stress of a tet, P F^T / J and that of the system's effects; NaN where there is
 * none. */
static double tet_stress(const flesh_picture_panel *panel, int t)
{
  const flesh_body *body = panel->body;
  double D[3][3], d[3][3], B[3][3], F[9], P[9], S[9], tau[9] = {0}, J = 0;
  edges_of(body->mesh, flesh_mesh_positions(body->mesh), t, D);
  edges_of(body->mesh, panel->x, t, d);
  for (int k = 0; k < 3; k++) /* rows of the edges' inverse: cross products over the volume */
    for (int i = 0; i < 3; i++)
      B[k][i] = D[(k + 1) % 3][(i + 1) % 3] * D[(k + 2) % 3][(i + 2) % 3] -
                D[(k + 1) % 3][(i + 2) % 3] * D[(k + 2) % 3][(i + 1) % 3];
  double volume = D[0][0] * B[0][0] + D[0][1] * B[0][1] + D[0][2] * B[0][2];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      F[3 * i + j] = 0;
      for (int k = 0; k < 3; k++) F[3 * i + j] += d[k][i] * B[k][j] / volume;
    }
  for (int i = 0; i < 3; i++)
    J += F[i] * (F[3 + (i + 1) % 3] * F[6 + (i + 2) % 3] - F[3 + (i + 2) % 3] * F[6 + (i + 1) % 3]);
  const flesh_material *material =
      &body->materials[body->tet_material ? body->tet_material[t] : 0];
  if (!(J > 0) || flesh_material_stress(material, F, P)) return NAN;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      S[3 * i + j] = 0;
      for (int k = 0; k < 3; k++) S[3 * i + j] += P[3 * i + k] * F[3 * j + k] / J;
    }
  if (panel->system) flesh_tet_stress_add(panel->system, panel->t, t, F, tau);
  for (int k = 0; k < 9; k++) S[k] += tau[k] / J;
  double pressure = (S[0] + S[4] + S[8]) / 3, sum = 0;
  for (int k = 0; k < 9; k++) {
    double deviator = S[k] - (k % 4 ? 0 : pressure);
    sum += deviator * deviator;
  }
  return sqrt(1.5 * sum);
}

/* Node values from those of tets. */
static int average(const flesh_mesh *mesh, const double *tet_values, double *values)
{
  int nodes = flesh_mesh_node_count(mesh);
  double *weights = calloc((size_t)nodes, sizeof *weights);
  if (!weights) return no_memory();
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

static void measure_mean(const flesh_picture_panel *panel, double *J_mean)
{
  const flesh_mesh *mesh = panel->body->mesh;
  if (panel->J) memcpy(J_mean, panel->J, sizeof *J_mean * (size_t)flesh_mesh_tet_count(mesh));
  else flesh_mesh_mean_jacobians(mesh, panel->x, J_mean);
}

static void measure_least(const flesh_picture_panel *panel, double *J_min)
{
  const flesh_mesh *mesh = panel->body->mesh;
  const size_t tets = (size_t)flesh_mesh_tet_count(mesh);
  if (panel->J) memcpy(J_min, panel->J + tets, sizeof *J_min * tets);
  else flesh_mesh_jacobians(mesh, panel->x, J_min, NULL, NULL);
}

int flesh_picture_is_inverted(const flesh_picture_panel *panel, int *inverted)
{
  const int tets = flesh_mesh_tet_count(panel->body->mesh);
  double *J = malloc(sizeof *J * (size_t)tets);
  *inverted = 0;
  if (!J) return no_memory();
  measure_least(panel, J);
  for (int t = 0; t < tets; t++) *inverted |= !(J[t] > 0);
  free(J);
  return FLESH_OK;
}

static void find_extremes(int count, const double *values, double extremes[2])
{
  if (!extremes) return;
  for (int i = 0; i < count; i++) {
    if (!isfinite(values[i])) continue;
    extremes[0] = fmin(extremes[0], values[i]); /* fmin and fmax pass over NaN */
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
  if (field == FLESH_PICTURE_STRESS && !panel->body->materials)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the body has no material, and so no stress to show");
  double *made = malloc(sizeof *made * (size_t)nodes);
  double *of_tets = malloc(sizeof *of_tets * (size_t)tets);
  if (!made || !of_tets) status = no_memory();
  else if (field == FLESH_PICTURE_SPEED) {
    for (int i = 0; i < nodes; i++) {
      const double *v = panel->v + 3 * (size_t)i;
      made[i] = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    }
    find_extremes(nodes, made, extremes);
  } else {
    if (field == FLESH_PICTURE_J) measure_mean(panel, of_tets);
    else
      for (int t = 0; t < tets; t++) of_tets[t] = tet_stress(panel, t);
    find_extremes(tets, of_tets, extremes);
    status = average(mesh, of_tets, made);
  }
  free(of_tets);
  if (status) free(made);
  else *values = made;
  return status;
}

/* Adopts memory of malloc's. */
static int keep(flesh_picture_scene *scene, void *memory)
{
  void **longer = realloc(scene->owned, sizeof *longer * (size_t)(scene->owned_count + 1));
  if (!longer) {
    free(memory);
    return no_memory();
  }
  scene->owned = longer;
  scene->owned[scene->owned_count++] = memory;
  return FLESH_OK;
}

/* New memory that the scene frees. */
static void *take(flesh_picture_scene *scene, size_t size)
{
  void *made = malloc(size + 1);
  return made && !keep(scene, made) ? made : NULL;
}

static int has_regions(const flesh_mesh *mesh)
{
  const int *tags = flesh_mesh_regions(mesh);
  for (int t = 1; t < flesh_mesh_tet_count(mesh); t++)
    if (tags[t] != tags[0]) return 1;
  return 0;
}

/* A colour per boundary triangle by the rank of its tet's region tag. */
static int colour_regions(flesh_picture_scene *scene, const flesh_mesh *mesh, const int *tets,
                          int triangles, float *colours)
{
  enum { COLOURS = sizeof regions / sizeof *regions };
  int count = flesh_mesh_tet_count(mesh), distinct = 0;
  int *tags = take(scene, sizeof *tags * (size_t)count);
  if (!tags) return no_memory();
  memcpy(tags, flesh_mesh_regions(mesh), sizeof *tags * (size_t)count);
  qsort(tags, (size_t)count, sizeof *tags, flesh_compare_int);
  for (int t = 0; t < count; t++)
    if (!t || tags[t] != tags[t - 1]) tags[distinct++] = tags[t];
  for (int s = 0; s < triangles; s++) {
    const int *found = bsearch(&flesh_mesh_regions(mesh)[tets[s]], tags, (size_t)distinct,
                               sizeof *tags, flesh_compare_int);
    linear(regions[(found - tags) % COLOURS], colours + 3 * (size_t)s);
  }
  return FLESH_OK;
}

/* Colours of values [vertices] into rgb [3*vertices]. */
static void colour_values(flesh_picture_field field, const flesh_picture_frame *frame, int vertices,
                          const double *values, float *rgb)
{
  for (int v = 0; v < vertices; v++) {
    double encoded[3], part = (values[v] - frame->low) / (frame->high - frame->low);
    flesh_picture_colour(field, isnan(part) ? 0 : part, encoded);
    for (int d = 0; d < 3; d++) rgb[3 * (size_t)v + (size_t)d] = (float)flesh_srgb_decode(encoded[d]);
  }
}

/* The boundary of curved tets instead of s, with values in place of *values, which the scene then owns. */
static int add_curved(const flesh_mesh *mesh, const flesh_picture_panel *panel, flesh_picture_scene *scene,
                      flesh_render_surface *s, const double **values, const int **behind)
{
  flesh_curved_surface curved;
  int status = flesh_curved_surface_make(mesh, &curved);
  if (status) return status;
  const size_t vertices = (size_t)curved.vertices;
  double *x = take(scene, sizeof *x * 3 * vertices), *rest = take(scene, sizeof *rest * 3 * vertices);
  double *own = take(scene, sizeof *own * vertices);
  if (x && rest && own) {
    flesh_curved_surface_apply(&curved, 3, panel->x, x);
    flesh_curved_surface_apply(&curved, 3, flesh_mesh_positions(mesh), rest);
    if (*values) flesh_curved_surface_apply(&curved, 1, *values, own);
  } else {
    status = no_memory();
  }
  s->vertices = curved.vertices, s->triangles = curved.triangles;
  s->x = x, s->rest = rest, s->corners = curved.corners, s->hidden = curved.hidden;
  *values = *values ? own : NULL;
  *behind = curved.tets;
  void *const parts[] = {curved.rows, curved.corners, curved.tets, curved.hidden};
  for (int k = 0; k < 4; k++) {
    const int kept = keep(scene, parts[k]);
    if (!status) status = kept;
  }
  return status;
}

/* The body's skin, or its boundary. */
static int add_body(const flesh_picture_panel *panel, const flesh_picture_options *options,
                    const flesh_picture_frame *frame, const double *values,
                    flesh_picture_scene *scene)
{
  const flesh_mesh *mesh = panel->body->mesh;
  flesh_render_surface *s = &scene->surfaces[scene->count];
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
  uint8_t *marked = take(scene, (size_t)s->triangles);
  double *J = take(scene, sizeof *J * (size_t)flesh_mesh_tet_count(mesh));
  if (!marked || !J) return no_memory();
  measure_least(panel, J);
  if (skinned) {
    s->vertices = flesh_surface_vertex_count(panel->surface);
    s->rest = flesh_surface_positions(panel->surface);
    double *x = take(scene, sizeof *x * 3 * (size_t)s->vertices);
    double *own = take(scene, sizeof *own * (size_t)s->vertices);
    if (!x || !own) return no_memory();
    flesh_skin_apply(panel->skin, 3, 0, panel->x, x);
    if (values) flesh_skin_apply(panel->skin, 1, 1, values, own);
    s->x = x;
    values = values ? own : NULL;
  }
  for (int t = 0; t < s->triangles; t++)
    marked[t] = !(J[skinned ? flesh_skin_tets(panel->skin)[s->corners[3 * (size_t)t]]
                            : behind[t]] > 0);
  s->marked = options->field == FLESH_PICTURE_PLAIN ? NULL : marked;
  if (values) {
    float *rgb = take(scene, sizeof *rgb * 3 * (size_t)s->vertices);
    if (!rgb) return no_memory();
    colour_values(options->field, frame, s->vertices, values, rgb);
    s->colours = rgb;
  } else if (!skinned && has_regions(mesh)) {
    float *rgb = take(scene, sizeof *rgb * 3 * (size_t)s->triangles);
    int status = rgb ? colour_regions(scene, mesh, behind, s->triangles, rgb)
                     : no_memory();
    if (status) return status;
    s->triangle_colours = rgb;
  }
  scene->count++;
  return FLESH_OK;
}

int flesh_picture_scene_make(const flesh_picture_panel *panel, const flesh_picture_options *options,
                             const flesh_picture_frame *frame, flesh_picture_scene *scene)
{
  int obstacles = flesh_picture_obstacle_count(panel);
  double *values;
  *scene = (flesh_picture_scene){0};
  if (!panel->x) return FLESH_OK;
  int status = flesh_picture_values(panel, options->field, &values, NULL);
  if (status) return status;
  scene->surfaces = calloc((size_t)obstacles + 1, sizeof *scene->surfaces);
  status = scene->surfaces ? add_body(panel, options, frame, values, scene) : no_memory();
  free(values);
  for (int k = 0; k < obstacles && !status; k++) {
    flesh_render_surface *s = &scene->surfaces[scene->count];
    flesh_picture_obstacle o;
    status = flesh_picture_obstacle_make(panel, k, &frame->view, &o);
    if (status) break;
    *s = (flesh_render_surface){.vertices = o.vertices, .triangles = o.triangles, .x = o.x, .corners = o.corners,
                                .glass = 1, .ground = o.is_plane,
                                .fade = o.is_plane ? flesh_picture_plane_extent(&frame->view) : 0};
    linear(obstacle_colour, s->plain);
    status = keep(scene, o.x);
    const int kept = keep(scene, o.corners);
    if (!status) status = kept;
    if (!status) scene->count++;
  }
  if (status) flesh_picture_scene_free(scene);
  return status;
}

void flesh_picture_scene_free(flesh_picture_scene *scene)
{
  for (int k = 0; k < scene->owned_count; k++) free(scene->owned[k]);
  free(scene->owned);
  free(scene->surfaces);
  *scene = (flesh_picture_scene){0};
}
