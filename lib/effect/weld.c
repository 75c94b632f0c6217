/* weld.c: joins two surfaces: ties between non-matching meshes, segment by segment.
 *
 * V = k/2 times the integral over one surface at rest of |x_A(X) - x_B(X)|^2. x_A is interpolated on that surface, and
 * x_B is extrapolated from the tet at the other surface. Both follow affine motions exactly, so V is 0 in all of these,
 * even if the surfaces overlap or gape at rest, and it does not change by rotation.
 *
 * The integral is the sum over the common parts of the surfaces' triangles (Puso & Laursen 2004, segment to segment).
 * On each of them the shape functions of both sides are polynomials that the quadrature rule integrates exactly. So a
 * uniform traction loads the nodes on both sides consistently: constant stress passes from mesh to mesh without error,
 * with a constant jump of traction/k.
 *
 * A weld that may break keeps the ties of each common part as a group (weld_breaks.h). */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/effect.h"
#include "effect/face_points.h"
#include "effect/ties.h"
#include "effect/weld_breaks.h"
#include "effect/weld_segments.h"
#include "element/body.h"
#include "math/area.h"
#include "math/mat3.h"
#include "mesh/mesh.h"
#include "mesh/pieces.h"
#include "mesh/shape.h"

/* Default stiffness, in units of the softer side's Young's modulus over its edge length. */
static const double default_factor = 30;
/* Tolerance of a position within a tet, relative to the tet's size. */
static const double place_tolerance = 1e-12;
enum { PLACE_ITERATIONS = 60, TIE_NODES = FLESH_FACE_NODES + 10 };

/* The common part of two triangles. */
typedef struct segment {
  int triangles[2][3];
  double gap; /* m, at rest */
} segment;

typedef struct weld {
  flesh_ties ties; /* must come first, for the flesh_tied_ functions */
  int segment_count, segment_room;
  segment *segments; /* [segment_count] segment k is part k of `breaks`; empty on a rank's part */
  double stiffness; /* Pa/m */
  flesh_weld_breaks breaks; /* limit 0: it does not break */
  flesh_ties all; /* on a rank's part of a weld that may break: the ties of all ranks */
  flesh_cells places; /* one cell for each node of `breaks` */
} weld;

static size_t weld_memory(const flesh_effect *effect)
{
  const weld *self = effect->data;
  return sizeof *self + flesh_ties_memory(&self->ties) + flesh_ties_memory(&self->all) +
         flesh_weld_breaks_memory(&self->breaks) + (size_t)self->segment_room * sizeof *self->segments;
}

static void weld_destroy(void *data)
{
  weld *self = data;
  if (self) {
    flesh_ties_clear(&self->ties);
    flesh_ties_clear(&self->all);
    flesh_weld_breaks_clear(&self->breaks);
    flesh_free(self->segments);
  }
  free(self);
}

/* Restricts the weld to the ties, or the parts, whose first node the rank owns. If it may break, every rank finds out
 * which parts do, from the positions of all nodes. */
static int weld_restrict(const flesh_effect *whole, const flesh_rank_part *part, const flesh_body *body,
                         flesh_effect **restricted)
{
  const weld *from = whole->data;
  const int breaks = from->breaks.limit > 0;
  weld *self = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a weld");
  self->stiffness = from->stiffness;
  int status = flesh_ties_restrict(&from->ties, part, 0, &self->ties);
  if (!status && breaks) status = flesh_ties_restrict(&from->ties, part, 1, &self->all);
  if (!status && breaks) status = flesh_weld_breaks_restrict(&from->breaks, part, &self->breaks);
  return flesh_effect_create_after(status, whole->operations, body->mesh, self, restricted);
}

static const flesh_cells *weld_cells(const flesh_effect *whole, int *everywhere)
{
  const weld *self = whole->data;
  *everywhere = self->breaks.limit > 0;
  return *everywhere ? &self->places : &self->ties.cells;
}

static int count_bonds(const flesh_effect *effect) { return ((const weld *)effect->data)->segment_count; }

static void get_bond(const flesh_effect *effect, int k, flesh_bond *bond)
{
  const weld *self = effect->data;
  const segment *of = &self->segments[k];
  *bond = (flesh_bond){{3, 3}, {of->triangles[0], of->triangles[1]}, of->gap, self->breaks.limit > 0 ? k : -1};
}

static const flesh_effect_bonds weld_bonds = {.count = count_bonds, .get = get_bond};

static const flesh_effect_ranks weld_ranks = {.restrict_to_part = weld_restrict, .cells = weld_cells};

static const flesh_effect_operations weld_operations = {
    .name = "weld",
    FLESH_TIED_OPERATIONS,
    .destroy = weld_destroy,
    .figures = &(const flesh_effect_figures){.memory = weld_memory},
    .library = &(const flesh_effect_private){.ranks = &weld_ranks, .bonds = &weld_bonds},
};

static int variables(const flesh_effect *effect)
{
  const weld *self = effect->data;
  return flesh_weld_breaks_variables(&self->breaks);
}

static int update(const flesh_effect *effect, const flesh_point *point, double *internal, int *changed)
{
  const weld *self = effect->data;
  const flesh_ties *all = self->all.groups ? &self->all : &self->ties;
  if (flesh_weld_breaks_update(&self->breaks, all, point->t, point->x, internal)) *changed = 1;
  return FLESH_OK;
}

static void tell(const flesh_effect *effect, const double *internal, size_t size, char *text)
{
  const weld *self = effect->data;
  flesh_weld_breaks_tell(&self->breaks, internal, size, text);
}

static void report(const flesh_effect *effect, const flesh_point *point, double *values)
{
  const weld *self = effect->data;
  flesh_weld_breaks_report(&self->breaks, point->x, point->internal, values);
}

static const char *const report_names[] = {"broken", "released", "traction", NULL};

static const flesh_effect_operations breaking_operations = {
    .name = "weld",
    FLESH_TIED_OPERATIONS,
    .destroy = weld_destroy,
    .figures = &(const flesh_effect_figures){.memory = weld_memory, .report_names = report_names, .report = report},
    .internal = &(const flesh_effect_internal){.count = variables, .update = update, .tell = tell},
    .library = &(const flesh_effect_private){.ranks = &weld_ranks, .bonds = &weld_bonds},
};

/* Finds the nodes' weights of a point in a tet, or extrapolated from it. With ten nodes, x(L) = P is solved iteratively
 * with the affine map of the corners. Returns 0 if that does not converge. */
static int place_in(const double *X, int count, const int node[10], const double P[3], double N[10])
{
  double D[9], inverse[9], L[4] = {0.25, 0.25, 0.25, 0.25}, size = 0;
  for (int i = 0; i < 9; i++) {
    D[i] = X[3 * (size_t)node[i % 3 + 1] + (size_t)(i / 3)] - X[3 * (size_t)node[0] + (size_t)(i / 3)];
    size = fmax(size, fabs(D[i]));
  }
  flesh_mat3_inverse(D, inverse);
  for (int iteration = 0; iteration < PLACE_ITERATIONS; iteration++) {
    double off[3] = {0}, worst = 0;
    if (count == 4) memcpy(N, L, sizeof L);
    else flesh_tet10_weights(L, N);
    for (int c = 0; c < 3; c++) {
      for (int a = 0; a < count; a++) off[c] += N[a] * (P[c] - X[3 * (size_t)node[a] + (size_t)c]);
      worst = fmax(worst, fabs(off[c]));
    }
    if (worst <= place_tolerance * size) return 1;
    for (int k = 0; k < 3; k++) {
      double step = 0;
      for (int c = 0; c < 3; c++) step += inverse[3 * k + c] * off[c];
      L[k + 1] += step;
      L[0] -= step;
    }
  }
  return 0;
}

/* One of the two surfaces. */
typedef struct surface {
  int count;
  const int *triangles;
  int *numbers; /* [count] their numbers in the mesh's surface */
  double edge, young; /* mean square root of twice a triangle's area, m; mean of 3 mu, Pa */
} surface;

typedef struct making {
  const flesh_body *body;
  const double *X;
  surface side[2];
  flesh_faces faces; /* faces of the first surface */
  double distance, area; /* m; m^2, area tied so far */
  weld *self;
} making;

/* Ties the point L of face `a` to the tet of triangle b, for the fraction `weight` of an area. */
static int add_tie(making *m, int a, int b, const double L[3], double weight, double area)
{
  const flesh_face_quarter *face = &m->faces.faces[a];
  double N[10], by_L[FLESH_FACE_NODES][3], P[3] = {0}, c[TIE_NODES];
  int tet[10], nodes[TIE_NODES], count = flesh_face_nodes(&m->faces, a);
  flesh_face_shapes(face->quarter, L, c, by_L);
  for (int k = 0; k < count; k++) {
    nodes[k] = face->node[k];
    for (int i = 0; i < 3; i++) P[i] += c[k] * m->X[3 * (size_t)nodes[k] + (size_t)i];
  }
  const int number = flesh_mesh_surface_tets(m->body->mesh)[m->side[1].numbers[b]];
  const int size = flesh_mesh_tet_nodes(m->body->mesh, number, tet);
  if (!place_in(m->X, size, tet, P, N))
    return flesh_fail(FLESH_ERR_ARGUMENT, "tet %d is too curved for a weld to (%g, %g, %g); a smaller distance may help",
                      number, P[0], P[1], P[2]);
  for (int k = 0; k < size; k++) {
    if (fabs(N[k]) < 1e-10) continue; /* nodes that are not on the face */
    nodes[count] = tet[k];
    c[count++] = -N[k];
  }
  flesh_ties_add(&m->self->ties, count, nodes, c, m->self->stiffness * weight * area);
  if (m->self->breaks.limit > 0) flesh_weld_breaks_add(&m->self->breaks, count, nodes, c, weight * area, P);
  return FLESH_OK;
}

static int add_segment(weld *self, const int first[3], const int second[3], double gap)
{
  if (!flesh_grow(&self->segments, sizeof *self->segments, self->segment_count, &self->segment_room))
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the %d parts of a weld", self->segment_count + 1);
  segment *added = &self->segments[self->segment_count++];
  memcpy(added->triangles[0], first, sizeof added->triangles[0]);
  memcpy(added->triangles[1], second, sizeof added->triangles[1]);
  added->gap = fabs(gap);
  return FLESH_OK;
}

/* Ties the common part of two triangles as a fan of triangles, each with the quadrature rule of its face. */
static int weld_triangles(void *data, int a, int b)
{
  making *m = data;
  const double *T[2][3];
  double L[FLESH_SEGMENT_CORNERS][3], gap;
  for (int s = 0; s < 2; s++)
    for (int k = 0; k < 3; k++) T[s][k] = m->X + 3 * (size_t)m->side[s].triangles[3 * (size_t)(s ? b : a) + (size_t)k];
  const int corners = flesh_weld_segment(T[0], T[1], L, &gap);
  if (!corners || fabs(gap) > m->distance) return FLESH_OK;
  double normal[3];
  flesh_area_vector(T[0][0], T[0][1], T[0][2], normal);
  const double twice = sqrt(flesh_vec3_dot(normal, normal));
  const int flat = flesh_face_is_flat(&m->faces, a) && flesh_mesh_order(m->body->mesh) == 1;
  const int breaks = m->self->breaks.limit > 0;
  const int added = add_segment(m->self, m->side[0].triangles + 3 * (size_t)a, m->side[1].triangles + 3 * (size_t)b, gap);
  if (added) return added;
  if (breaks) flesh_ties_begin_group(&m->self->ties);
  if (breaks) flesh_weld_breaks_begin(&m->self->breaks, m->side[0].triangles + 3 * (size_t)a);
  for (int k = 1; k + 1 < corners; k++) {
    double part[9], at[3], weight;
    for (int i = 0; i < 9; i++) part[i] = L[i / 3 == 0 ? 0 : k + i / 3 - 1][i % 3];
    const double area = fabs(flesh_mat3_determinant(part)) * twice / 2;
    m->area += area;
    for (int q = 0; (weight = flesh_face_rule(flat, q, part, at)) > 0; q++) {
      const int status = add_tie(m, a, b, at, weight, area);
      if (status) return status;
    }
  }
  if (breaks) flesh_weld_breaks_end(&m->self->breaks);
  return FLESH_OK;
}

/* Returns three times the shear modulus at small strains. */
static double young_of(const flesh_body *body, int tet)
{
  double mu, lambda, residual;
  if (!body->materials) return 0;
  const flesh_material *material = &body->materials[body->tet_material ? body->tet_material[tet] : 0];
  return 3 * (flesh_material_small_strain(material, &mu, &lambda, &residual) ? material->mu : mu);
}

/* Describes a surface and computes a box for each of its triangles, enlarged by half the distance. */
static int take_surface(making *m, surface *s, int count, const int *triangles, double (*boxes)[6])
{
  s->count = count;
  s->triangles = triangles;
  s->numbers = malloc(((size_t)count + 1) * sizeof *s->numbers);
  if (!s->numbers) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d triangles", count);
  const int status = flesh_face_numbers(m->body->mesh, count, triangles, s->numbers);
  for (int k = 0; k < count && !status; k++) {
    double normal[3];
    const double *x[3];
    for (int i = 0; i < 3; i++) x[i] = m->X + 3 * (size_t)triangles[3 * (size_t)k + (size_t)i];
    for (int c = 0; c < 3; c++) {
      boxes[k][c] = fmin(x[0][c], fmin(x[1][c], x[2][c])) - m->distance / 2;
      boxes[k][3 + c] = fmax(x[0][c], fmax(x[1][c], x[2][c])) + m->distance / 2;
    }
    flesh_area_vector(x[0], x[1], x[2], normal);
    const double twice = sqrt(flesh_vec3_dot(normal, normal));
    s->edge += sqrt(twice) / count;
    s->young += young_of(m->body, flesh_mesh_surface_tets(m->body->mesh)[s->numbers[k]]) / count;
  }
  return status;
}

static int make(making *m, const int count[2], const int *const triangles[2])
{
  double (*boxes)[6] = malloc(((size_t)count[0] + (size_t)count[1] + 1) * sizeof *boxes);
  int status = boxes ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for %d triangles", count[0] + count[1]);
  for (int s = 0; s < 2 && !status; s++)
    status = take_surface(m, &m->side[s], count[s], triangles[s], boxes + (s ? count[0] : 0));
  if (!status) status = flesh_faces_create(m->body->mesh, count[0], triangles[0], &m->faces);
  if (!status && isnan(m->self->stiffness)) {
    const double first = m->side[0].young / m->side[0].edge, second = m->side[1].young / m->side[1].edge;
    m->self->stiffness = default_factor * fmin(first, second);
    if (!(m->self->stiffness > 0))
      status = flesh_fail(FLESH_ERR_ARGUMENT, "stiffness is missing; a body without elasticity needs one for its weld");
  }
  if (!status) status = flesh_weld_pairs(count[0], count[1], (const double (*)[6])boxes, weld_triangles, m);
  if (!status && !(m->area > 0))
    status = flesh_fail(FLESH_ERR_ARGUMENT, "the two surfaces do not face each other anywhere within distance %g m",
                        m->distance);
  if (!status) status = flesh_ties_finish(&m->self->ties);
  if (!status) status = flesh_weld_breaks_finish(&m->self->breaks);
  m->self->breaks.stiffness = m->self->stiffness;
  m->self->places = (flesh_cells){.count = m->self->breaks.entries, .nodes_per_cell = 1, .nodes = m->self->breaks.nodes};
  free(boxes);
  for (int s = 0; s < 2; s++) free(m->side[s].numbers);
  flesh_faces_clear(&m->faces);
  return status;
}

int flesh_effect_weld(const flesh_body *body, flesh_triangles first, flesh_triangles second, double distance,
                      double stiffness, double breaks_at, flesh_effect **effect)
{
  FLESH_NEED_BODY({body, "body"}, {first.corners, "first"}, {second.corners, "second"});
  if (first.count < 1 || second.count < 1)
    return flesh_fail(FLESH_ERR_ARGUMENT, "a weld needs triangles of two surfaces; there are %d and %d", first.count,
                      second.count);
  if (!(distance >= 0 && distance < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "distance is %g m; it must not be negative", distance);
  if (!(isnan(stiffness) || (stiffness > 0 && stiffness < INFINITY)))
    return flesh_fail(FLESH_ERR_ARGUMENT, "stiffness is %g Pa/m; it must be positive", stiffness);
  if (!(isnan(breaks_at) || (breaks_at > 0 && breaks_at < INFINITY)))
    return flesh_fail(FLESH_ERR_ARGUMENT, "breaks_at is %g Pa; it must be positive", breaks_at);
  weld *self = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a weld");
  self->stiffness = stiffness;
  self->breaks.limit = isnan(breaks_at) ? 0 : breaks_at;
  making m = {.body = body, .X = flesh_mesh_positions(body->mesh), .distance = distance, .self = self};
  const int status = make(&m, (const int[]){first.count, second.count}, (const int *const[]){first.corners, second.corners});
  return flesh_effect_create_after(status, self->breaks.limit > 0 ? &breaking_operations : &weld_operations, body->mesh, self,
                             effect);
}
