/* contact_make.c: creates and frees contact effects with an obstacle: their nodes, areas and default parameters. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/contact.h"
#include "effect/effect.h"
#include "effect/rank_share.h"
#include "element/body.h"
#include "geometry/obstacle.h"
#include "math/mat3.h"
#include "mesh/pieces.h"
#include "parallel/rank_part.h"

size_t flesh_contact_memory(const flesh_effect *effect)
{
  const flesh_contact *self = effect->data;
  const flesh_contact_core *core = &self->core;
  size_t bytes = sizeof *self + flesh_obstacle_memory(self->obstacle) +
                 (size_t)self->count * (sizeof *self->nodes + sizeof *self->area);
  if (core->points)
    bytes += 3 * (size_t)core->points * sizeof *core->centres + (size_t)core->node_count * sizeof *core->nodes +
             3 * (size_t)core->faces.count *
                 (sizeof *core->faces.nodes + sizeof *core->edge_weight + sizeof *core->vertex_weight);
  return bytes;
}

void flesh_contact_destroy(void *data)
{
  flesh_contact *self = data;
  if (!self) return;
  if (!self->borrows_obstacle) flesh_obstacle_destroy(&self->obstacle);
  flesh_contact_core_clear(&self->core);
  free(self->nodes);
  free(self->area);
  free(self->names);
  free(self);
}

const flesh_obstacle *flesh_effect_obstacle(const flesh_effect *effect)
{
  return effect->operations == &flesh_contact_operations ? ((const flesh_contact *)effect->data)->obstacle
                                                   : NULL;
}

void flesh_contact_options_default(flesh_contact_options *options)
{
  *options = (flesh_contact_options){.stiffness = NAN, .thickness = NAN, .slip_speed = 1e-3};
}

/* Computes a triangle's edge from the first to the second corner. Returns twice its area. */
static double measure_triangle(const double *X, const int *corner, double e[3])
{
  double f[3], n[3];
  for (int c = 0; c < 3; c++) {
    e[c] = X[3 * corner[1] + c] - X[3 * corner[0] + c];
    f[c] = X[3 * corner[2] + c] - X[3 * corner[0] + c];
  }
  flesh_vec3_cross(e, f, n);
  return sqrt(flesh_vec3_dot(n, n));
}

/* Measures the surface: means or, on a part, sums over the triangles of the rank's tets. One edge of each triangle
 * suffices for the mean length. */
static flesh_contact_measures measure_surface(const flesh_mesh *mesh, const flesh_rank_part *part)
{
  int triangles;
  const int *surface = flesh_mesh_surface(mesh, &triangles), *tets = flesh_mesh_surface_tets(mesh);
  flesh_contact_measures m = {.triangles = part ? 0 : 1};
  const double share = part ? 1 : triangles;
  for (int t = 0; t < triangles; t++) {
    double e[3];
    if (part && flesh_rank_share_tet(part, tets[t]) < 0) continue;
    m.areas += measure_triangle(flesh_mesh_positions(mesh), surface + 3 * (size_t)t, e) / share;
    m.edges += sqrt(flesh_vec3_dot(e, e)) / share;
    m.triangles += part != NULL;
  }
  return m;
}

/* Sets the parameters that were not given, and those of the core, from the measures of the whole body. The core's
 * weight takes a node's mean area, twice that of a triangle: a mesh has half as many nodes as triangles. */
static void settle(flesh_contact *self)
{
  const flesh_contact_measures *m = &self->measures;
  if (self->default_stiffness) self->stiffness = m->stiffness;
  if (self->default_thickness) self->thickness = m->edges / m->triangles / 20;
  self->core.weight = self->stiffness * (m->areas / m->triangles);
  self->core.thickness = self->thickness;
}

void flesh_contact_count(const flesh_effect *restricted, flesh_rank_numbers *numbers)
{
  const flesh_contact_measures *m = &((const flesh_contact *)restricted->data)->measures;
  numbers->sums[0] = m->edges;
  numbers->sums[1] = m->areas;
  numbers->sums[2] = m->triangles;
  numbers->largest[0] = m->stiffness;
}

void flesh_contact_take(flesh_effect *restricted, const flesh_rank_numbers *numbers)
{
  flesh_contact *self = restricted->data;
  self->measures = (flesh_contact_measures){numbers->sums[0], numbers->sums[1], numbers->sums[2], numbers->largest[0]};
  settle(self);
}

/* Lists the nodes and their areas: shares of the rest surface or, for interior nodes, the 2/3 power of their share of
 * the volume. Interior nodes meet the obstacle only if the body is crushed, and must not pass through it then. */
static int collect_nodes(const flesh_mesh *mesh, flesh_contact *self)
{
  int triangles;
  const int *surface = flesh_mesh_surface(mesh, &triangles), nodes = flesh_mesh_node_count(mesh);
  const double *X = flesh_mesh_positions(mesh);
  double *area = calloc((size_t)nodes + 1, sizeof *area);
  double *volume = calloc((size_t)nodes + 1, sizeof *volume);
  self->nodes = malloc(((size_t)nodes + 1) * sizeof *self->nodes);
  self->area = malloc(((size_t)nodes + 1) * sizeof *self->area);
  if (!area || !volume || !self->nodes || !self->area) {
    free(area);
    free(volume);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the contact of %d triangles", triangles);
  }
  for (int t = 0; t < triangles; t++) {
    const int *corner = surface + 3 * (size_t)t;
    double e[3];
    const double twice = measure_triangle(X, corner, e);
    for (int k = 0; k < 3; k++) area[corner[k]] += twice / 6;
  }
  for (int t = 0; t < flesh_mesh_tet_count(mesh); t++) {
    int n[10], size = flesh_mesh_tet_nodes(mesh, t, n);
    for (int a = 0; a < size; a++) /* ten nodes: shares of the lumped mass (Hinton, Rock & Zienkiewicz 1976) */
      volume[n[a]] += flesh_mesh_tet_volumes(mesh)[t] * (size == 4 ? 1. / 4 : a < 4 ? 1. / 36 : 4. / 27);
  }
  for (int i = 0; i < nodes; i++)
    if (volume[i] > 0) {
      self->nodes[self->count] = i;
      self->area[self->count++] = area[i] > 0 ? area[i] : cbrt(volume[i] * volume[i]);
    }
  free(area);
  free(volume);
  return FLESH_OK;
}

/* Three times the largest shear modulus is Young's modulus of an incompressible material. */
double flesh_contact_body_stiffness(const flesh_body *body)
{
  int count = body->materials ? 1 : 0;
  double largest = 0;
  for (int e = 0; body->tet_material && e < flesh_mesh_tet_count(body->mesh); e++)
    if (body->tet_material[e] >= count) count = body->tet_material[e] + 1;
  for (int m = 0; m < count; m++)
    if (body->materials[m].mu > largest) largest = body->materials[m].mu;
  return 3 * largest;
}

int flesh_contact_options_check(const flesh_contact_options *o)
{
  if (!(o->stiffness > 0 && o->stiffness < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "stiffness is %g Pa; it must be positive, and given where the body has no elasticity",
                      o->stiffness);
  if (!(o->thickness > 0 && o->thickness < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "thickness is %g m; it must be positive", o->thickness);
  if (!(o->friction >= 0 && o->friction < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "friction is %g; it must not be negative", o->friction);
  if (!(o->slip_speed > 0 && o->slip_speed < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "slip_speed is %g m/s; it must be positive", o->slip_speed);
  if (o->separates != 0 && o->separates != 1)
    return flesh_fail(FLESH_ERR_ARGUMENT, "separates is %d; it must be 0 or 1", o->separates);
  if (o->adaptive != 0 && o->adaptive != 1)
    return flesh_fail(FLESH_ERR_ARGUMENT, "adaptive is %d; it must be 0 or 1", o->adaptive);
  return FLESH_OK;
}

int flesh_effect_obstacle_contact(const flesh_body *body, const flesh_contact_options *options,
                                  flesh_obstacle **obstacle, flesh_effect **effect)
{
  FLESH_NEED({obstacle, "obstacle"});
  const flesh_needed needed[] = {{body, "body"}, {options, "options"}, {*obstacle, "*obstacle"}, {effect, "effect"},
                                 {NULL, NULL}};
  int status = flesh_check_needed(__func__, needed);
  if (!status) status = flesh_body_check(body);
  if (effect) *effect = NULL;
  if (status) { /* the obstacle is consumed even then */
    flesh_obstacle_destroy(obstacle);
    return status;
  }
  flesh_contact_options own = *options;
  flesh_contact *self = calloc(1, sizeof *self);
  if (!self) {
    flesh_obstacle_destroy(obstacle);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for a contact effect");
  }
  self->obstacle = *obstacle;
  *obstacle = NULL;
  self->mesh = body->mesh;
  status = collect_nodes(body->mesh, self);
  if (!status) {
    self->default_stiffness = isnan(own.stiffness);
    self->default_thickness = isnan(own.thickness);
    self->stiffness = own.stiffness;
    self->thickness = own.thickness;
    self->measures = measure_surface(body->mesh, NULL);
    self->measures.stiffness = flesh_contact_body_stiffness(body);
    settle(self);
    own.stiffness = self->stiffness;
    own.thickness = self->thickness;
    status = flesh_contact_options_check(&own);
    if (!status && own.separates)
      status = flesh_fail(FLESH_ERR_ARGUMENT, "separates applies to contact between bodies; it must be 0 for an obstacle");
    if (!status && own.adaptive)
      status = flesh_fail(FLESH_ERR_ARGUMENT, "adaptive applies to contact between bodies; it must be 0 for an obstacle");
  }
  if (!status)
    status = flesh_contact_core_create(body->mesh, self->obstacle, self->core.weight, self->thickness, &self->core);
  self->friction = own.friction;
  self->slip_speed = own.slip_speed;
  return flesh_effect_create_after(status, &flesh_contact_operations, body->mesh, self, effect);
}

/* Restricts the core to the faces of the rank's tets. */
static int restrict_core(const flesh_contact_core *whole, const flesh_rank_part *part, const flesh_body *body,
                         flesh_contact_core *core)
{
  int found = 0, *kept = NULL, *corners = NULL;
  if (!whole->points) return FLESH_OK;
  int status = flesh_rank_share_faces(part, whole->faces.count, whole->faces.nodes, &found, &kept, &corners);
  if (!status && found) status = flesh_contact_core_restrict(whole, found, kept, corners, body->mesh, core);
  if (!status) flesh_free(kept), flesh_free(corners);
  return status;
}

/* Restricts the effect to the nodes that the rank owns. */
int flesh_contact_restrict(const flesh_effect *whole, const flesh_rank_part *part, const flesh_body *body,
                           flesh_effect **restricted)
{
  const flesh_contact *from = whole->data;
  const size_t count = (size_t)from->count;
  int *kept = malloc((count + 1) * sizeof *kept);
  flesh_contact *self = calloc(1, sizeof *self);
  if (self) {
    *self = (flesh_contact){.obstacle = from->obstacle, .borrows_obstacle = 1, .stiffness = from->stiffness,
                            .thickness = from->thickness, .friction = from->friction, .slip_speed = from->slip_speed,
                            .default_stiffness = from->default_stiffness, .default_thickness = from->default_thickness,
                            .measures = measure_surface(from->mesh, part), .mesh = from->mesh};
    self->measures.stiffness = flesh_contact_body_stiffness(body);
    self->nodes = malloc((count + 1) * sizeof *self->nodes);
    self->names = malloc((count + 1) * sizeof *self->names);
    self->area = malloc((count + 1) * sizeof *self->area);
  }
  int status = kept && self && self->nodes && self->names && self->area
                   ? restrict_core(&from->core, part, body, &self->core)
                   : flesh_fail(FLESH_ERR_MEMORY, "no memory for a contact effect");
  if (!status) {
    self->count = flesh_rank_share_nodes(part, from->count, from->nodes, kept, self->nodes);
    for (int k = 0; k < self->count; k++) {
      self->names[k] = flesh_rank_part_team(part)->numbers[self->nodes[k]];
      self->area[k] = from->area[kept[k]];
    }
    status = flesh_effect_create(&flesh_contact_operations, body->mesh, self, restricted);
  } else {
    flesh_contact_destroy(self);
  }
  free(kept);
  return status;
}
