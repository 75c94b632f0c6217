/* torn_body.c: the derivative of a sum over tets by an argument, from residuals of the body torn into its tets: two for
 * each component of each node of a tet except the first, as nothing changes when all nodes move alike; more for tets with a
 * kink between the two, as where an eigenvalue is clamped. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "mesh/pieces.h"
#include "mesh/torn.h"
#include "sensitivity/coupling.h"

enum { ARRAYS = 7 }; /* number of arrays of a point */
/* The two one-sided differences of a smooth tet agree to `kinked` and round-off, which is large with stiff volumes. Other
 * tets get steps a tenth as long, at most FINER times. */
enum { FINER = 3 };
static const double kinked = 1e-5, finer_step = 0.1;

void flesh_torn_body_clear(int effects, flesh_torn_body *torn_body)
{
  for (int e = 0; e < effects && torn_body->of; e++) flesh_system_destroy(&torn_body->of[e]);
  flesh_free(torn_body->of);
  flesh_mesh_destroy(&torn_body->mesh);
  flesh_free(torn_body->from);
  flesh_free(torn_body->room);
  *torn_body = (flesh_torn_body){0};
}

static int no_memory(void) { return flesh_fail(FLESH_ERR_MEMORY, "no memory for the sensitivities of single tets"); }

int flesh_torn_body_open(const flesh_mesh *mesh, flesh_torn_body *torn_body)
{
  const int status = flesh_mesh_tear(mesh, &torn_body->mesh, &torn_body->from);
  if (status) return status;
  torn_body->n = 3 * flesh_mesh_node_count(torn_body->mesh);
  torn_body->room = flesh_malloc(17 * (size_t)torn_body->n * sizeof *torn_body->room);
  return torn_body->room ? FLESH_OK : no_memory();
}

static int make_mesh(flesh_couplings *self)
{
  flesh_torn_body *torn_body = &self->torn_body;
  const int effects = flesh_system_effect_count(self->system);
  if (torn_body->of) return FLESH_OK;
  flesh_torn_body_clear(0, torn_body); /* frees what was made before the failure */
  const int status = flesh_torn_body_open(flesh_system_mesh(self->system), torn_body);
  if (!status) torn_body->of = flesh_calloc((size_t)effects, sizeof(flesh_system *));
  return status || torn_body->of ? status : no_memory();
}

static int make_system(flesh_couplings *self, int e)
{
  const flesh_effect *effect = flesh_system_effect(self->system, e);
  flesh_effect *torn = NULL;
  flesh_system *system = NULL;
  int status = make_mesh(self);
  if (status || self->torn_body.of[e]) return status;
  status = flesh_effect_private_of(effect)->partials->tear(effect, NULL, self->torn_body.mesh, &torn);
  if (!status) status = flesh_system_create(self->torn_body.mesh, &system);
  if (!status) status = flesh_system_add_effect(system, &torn);
  if (!status) status = flesh_system_finalize(system);
  flesh_effect_destroy(&torn);
  if (status) flesh_system_destroy(&system);
  self->torn_body.of[e] = system;
  return status;
}

flesh_point flesh_torn_body_point(const flesh_torn_body *torn_body, const flesh_point *point)
{
  flesh_point torn = *point;
  const double **arrays[ARRAYS] = {&torn.x, &torn.v, &torn.a, &torn.lagged.x, &torn.lagged.v, &torn.frozen.x, &torn.frozen.v};
  const double *given[ARRAYS];
  for (int k = 0; k < ARRAYS; k++) given[k] = *arrays[k];
  for (int k = 0; k < ARRAYS; k++) {
    double *to = torn_body->room + (size_t)k * (size_t)torn_body->n;
    int same = 0;
    while (same < k && given[same] != given[k]) same++;
    if (same < k) *arrays[k] = *arrays[same];
    if (same < k || !given[k]) continue;
    for (int i = 0; i < torn_body->n / 3; i++)
      memcpy(to + 3 * (size_t)i, given[k] + 3 * (size_t)torn_body->from[i], 3 * sizeof *to);
    *arrays[k] = to;
  }
  torn.environment = NULL;
  return torn;
}

/* A torn effect, its point, the argument that is varied, and the step. */
typedef struct variation {
  const flesh_torn_body *torn_body;
  const flesh_system *system;
  flesh_point *point;
  const double **read;
  double step;
  double *varied, *before, *after, *middle; /* work space [n]; residuals before, after and at the point */
} variation;

/* Computes r [n], the residual with a component of each tet's node `a` moved by `by`. */
static int move(const variation *v, int component, int a, double by, double *r)
{
  const flesh_torn_body *torn_body = v->torn_body;
  const double *base = *v->read;
  for (int d = 0; d < torn_body->n; d++) v->varied[d] = base ? base[d] : 0;
  for (int t = 0, i = 0, nodes[10]; t < flesh_mesh_tet_count(torn_body->mesh); t++) {
    const int has = flesh_mesh_tet_nodes(torn_body->mesh, t, nodes);
    if (a < has) v->varied[3 * (i + a) + component] += by;
    i += has;
  }
  *v->read = v->varied;
  const int status = flesh_system_residual(v->system, v->point, r);
  *v->read = base;
  return status;
}

/* Takes the differences of the `count` forces of a tet from `first` on, between points `step` to either side. Returns
 * whether there is a kink between them, beyond round-off. */
static int take_tet(const variation *v, int first, int count, double step, double *sum)
{
  double bent = 0, size = 0, forces = 0;
  for (int d = first; d < first + count; d++) {
    const double change = v->after[d] - v->before[d];
    bent = fmax(bent, fabs(v->after[d] - v->middle[d] - (v->middle[d] - v->before[d])));
    size = fmax(size, fabs(change));
    forces = fmax(forces, fabs(v->middle[d]));
    sum[d] = change / (2 * step);
  }
  return bent > kinked * size + 16384 * DBL_EPSILON * forces;
}

/* Takes the tets whose `sum` is not known, with NAN as its first number. Returns the number of tets with a kink, which are
 * taken again unless this was the last time. */
static int take_tets(const variation *v, double step, int last, double *sum)
{
  const flesh_mesh *mesh = v->torn_body->mesh;
  int bent = 0;
  for (int t = 0, first = 0, nodes[10]; t < flesh_mesh_tet_count(mesh); t++) {
    const int numbers = 3 * flesh_mesh_tet_nodes(mesh, t, nodes);
    if (isnan(sum[first]) && take_tet(v, first, numbers, step, sum) && !last) sum[first] = NAN, bent++;
    first += numbers;
  }
  return bent;
}

/* Computes sum [n], the derivative by a component of each tet's node `a`, and subtracts it from `first` [n], that of the
 * first node. */
static int differentiate(const variation *v, int component, int a, double *sum, double *first)
{
  double step = v->step;
  int status = FLESH_OK, some = 1;
  for (int d = 0; d < v->torn_body->n; d++) sum[d] = NAN;
  for (int finer = 0; finer <= FINER && some && !status; finer++, step *= finer_step) {
    status = move(v, component, a, -step, v->before);
    if (!status) status = move(v, component, a, step, v->after);
    if (!status) some = take_tets(v, step, finer == FINER, sum);
  }
  for (int d = 0; d < v->torn_body->n; d++) first[d] -= sum[d];
  return status;
}

/* Appends the blocks of each tet's node `a`; sums [3][n] are the derivatives by its components. */
static int append_blocks(const flesh_torn_body *torn_body, int a, const double *sums, flesh_coupling *to)
{
  int status = FLESH_OK;
  for (int t = 0, first = 0, nodes[10]; t < flesh_mesh_tet_count(torn_body->mesh) && !status; t++) {
    const int has = flesh_mesh_tet_nodes(torn_body->mesh, t, nodes);
    for (int b = 0; b < has && a < has && !status; b++) {
      double block[9];
      for (int k = 0; k < 9; k++) block[k] = sums[(size_t)(k % 3) * (size_t)torn_body->n + (size_t)(3 * (first + b) + k / 3)];
      status = flesh_coupling_append(to, torn_body->from[first + b], torn_body->from[first + a], block);
    }
    first += has;
  }
  return status;
}

int flesh_couplings_find_torn(flesh_couplings *self, int effect, const flesh_point *given, flesh_argument argument, double step)
{
  int status = make_system(self, effect);
  if (status) return status;
  const flesh_torn_body *torn_body = &self->torn_body;
  flesh_point point = flesh_torn_body_point(torn_body, given);
  const double **const read[FLESH_ARGUMENTS] = {&point.lagged.x, &point.lagged.v, &point.frozen.x, &point.frozen.v,
                                                &point.v,        &point.x};
  const size_t n = (size_t)torn_body->n;
  double *room = torn_body->room + ARRAYS * n, *sums = room + 4 * n, *first = sums + 3 * n;
  const variation v = {torn_body, torn_body->of[effect], &point, read[argument], step,
                       room, room + n, room + 2 * n, room + 3 * n};
  memset(first, 0, 3 * n * sizeof *first);
  status = flesh_system_residual(v.system, v.point, v.middle);
  for (int a = 1; a < (flesh_mesh_order(torn_body->mesh) == 2 ? 10 : 4) && !status; a++) {
    for (size_t c = 0; c < 3 && !status; c++) status = differentiate(&v, (int)c, a, sums + c * n, first + c * n);
    if (!status) status = append_blocks(torn_body, a, sums, &self->by[argument]);
  }
  return status ? status : append_blocks(torn_body, 0, first, &self->by[argument]);
}
