/* apart.c: the derivative of a sum over tets by what it reads, from the residuals of the body torn into its tets: two for
 * each component of each node of a tet but the first, as nothing changes where all move alike; more for tets that have a
 * kink between them, as where an eigenvalue is clamped. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "mesh/pieces.h"
#include "mesh/torn.h"
#include "sensitivity/coupling.h"

enum { ARRAYS = 7 }; /* of a point */
/* The differences of both sides of a smooth tet agree to `kinked`; others have steps a tenth as long, FINER times at most. */
enum { FINER = 2 };
static const double kinked = 1e-5, finer_step = 0.1;

void flesh_apart_clear(int effects, flesh_apart *apart)
{
  for (int e = 0; e < effects && apart->of; e++) flesh_system_destroy(&apart->of[e]);
  flesh_free(apart->of);
  flesh_mesh_destroy(&apart->mesh);
  flesh_free(apart->from);
  flesh_free(apart->room);
  *apart = (flesh_apart){0};
}

static int no_memory(void) { return flesh_fail(FLESH_ERR_MEMORY, "no memory for the sensitivities of single tets"); }

int flesh_apart_open(const flesh_mesh *mesh, flesh_apart *apart)
{
  const int status = flesh_mesh_tear(mesh, &apart->mesh, &apart->from);
  if (status) return status;
  apart->n = 3 * flesh_mesh_node_count(apart->mesh);
  apart->room = flesh_malloc(17 * (size_t)apart->n * sizeof *apart->room);
  return apart->room ? FLESH_OK : no_memory();
}

static int make_mesh(flesh_couplings *self)
{
  flesh_apart *apart = &self->apart;
  const int effects = flesh_system_effect_count(self->system);
  if (apart->of) return FLESH_OK;
  flesh_apart_clear(0, apart); /* of what failed */
  const int status = flesh_apart_open(flesh_system_mesh(self->system), apart);
  if (!status) apart->of = flesh_calloc((size_t)effects, sizeof(flesh_system *));
  return status || apart->of ? status : no_memory();
}

static int make_system(flesh_couplings *self, int e)
{
  const flesh_effect *effect = flesh_system_effect(self->system, e);
  flesh_effect *torn = NULL;
  flesh_system *system = NULL;
  int status = make_mesh(self);
  if (status || self->apart.of[e]) return status;
  status = flesh_effect_private_of(effect)->readings->tear(effect, NULL, self->apart.mesh, &torn);
  if (!status) status = flesh_system_create(self->apart.mesh, &system);
  if (!status) status = flesh_system_add_effect(system, &torn);
  if (!status) status = flesh_system_finalize(system);
  flesh_effect_destroy(&torn);
  if (status) flesh_system_destroy(&system);
  self->apart.of[e] = system;
  return status;
}

flesh_point flesh_apart_point(const flesh_apart *apart, const flesh_point *point)
{
  flesh_point torn = *point;
  const double **arrays[ARRAYS] = {&torn.x, &torn.v, &torn.a, &torn.lagged.x, &torn.lagged.v, &torn.frozen.x, &torn.frozen.v};
  const double *given[ARRAYS];
  for (int k = 0; k < ARRAYS; k++) given[k] = *arrays[k];
  for (int k = 0; k < ARRAYS; k++) {
    double *to = apart->room + (size_t)k * (size_t)apart->n;
    int same = 0;
    while (same < k && given[same] != given[k]) same++;
    if (same < k) *arrays[k] = *arrays[same];
    if (same < k || !given[k]) continue;
    for (int i = 0; i < apart->n / 3; i++) memcpy(to + 3 * (size_t)i, given[k] + 3 * (size_t)apart->from[i], 3 * sizeof *to);
    *arrays[k] = to;
  }
  torn.environment = NULL;
  return torn;
}

/* A torn effect, its point, what is varied of that, and how far. */
typedef struct variation {
  const flesh_apart *apart;
  const flesh_system *system;
  flesh_point *point;
  const double **read;
  double step;
  double *varied, *before, *after, *middle; /* room [n]; the residual at the point */
} variation;

/* r [n] = the residual with a component of each tet's node `a` moved by a distance. */
static int move(const variation *v, int component, int a, double by, double *r)
{
  const flesh_apart *apart = v->apart;
  const double *base = *v->read;
  for (int d = 0; d < apart->n; d++) v->varied[d] = base ? base[d] : 0;
  for (int t = 0, i = 0, nodes[10]; t < flesh_mesh_tet_count(apart->mesh); t++) {
    const int has = flesh_mesh_tet_nodes(apart->mesh, t, nodes);
    if (a < has) v->varied[3 * (i + a) + component] += by;
    i += has;
  }
  *v->read = v->varied;
  const int status = flesh_system_residual(v->system, v->point, r);
  *v->read = base;
  return status;
}

/* Takes the differences of the `count` forces of a tet from `first` on, whose sum over a step is `step`. Returns whether there
 * is a kink between them, and not only round-off. */
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
  return bent > kinked * size + 256 * DBL_EPSILON * forces;
}

/* Takes the tets whose `sum` is not known, NAN at its first number. Returns how many of them have a kink, and are taken
 * again unless this was the last time. */
static int take_tets(const variation *v, double step, int last, double *sum)
{
  const flesh_mesh *mesh = v->apart->mesh;
  int bent = 0;
  for (int t = 0, first = 0, nodes[10]; t < flesh_mesh_tet_count(mesh); t++) {
    const int numbers = 3 * flesh_mesh_tet_nodes(mesh, t, nodes);
    if (isnan(sum[first]) && take_tet(v, first, numbers, step, sum) && !last) sum[first] = NAN, bent++;
    first += numbers;
  }
  return bent;
}

/* sum [n] = the derivative by a component of each tet's node `a`, which is taken from that of the first, `first` [n]. */
static int differentiate(const variation *v, int component, int a, double *sum, double *first)
{
  double step = v->step;
  int status = FLESH_OK, some = 1;
  for (int d = 0; d < v->apart->n; d++) sum[d] = NAN;
  for (int finer = 0; finer <= FINER && some && !status; finer++, step *= finer_step) {
    status = move(v, component, a, -step, v->before);
    if (!status) status = move(v, component, a, step, v->after);
    if (!status) some = take_tets(v, step, finer == FINER, sum);
  }
  for (int d = 0; d < v->apart->n; d++) first[d] -= sum[d];
  return status;
}

/* The blocks of each tet's node `a`, of whose components sums [3][n] are the derivatives. */
static int append_blocks(const flesh_apart *apart, int a, const double *sums, flesh_coupling *to)
{
  int status = FLESH_OK;
  for (int t = 0, first = 0, nodes[10]; t < flesh_mesh_tet_count(apart->mesh) && !status; t++) {
    const int has = flesh_mesh_tet_nodes(apart->mesh, t, nodes);
    for (int b = 0; b < has && a < has && !status; b++) {
      double block[9];
      for (int k = 0; k < 9; k++) block[k] = sums[(size_t)(k % 3) * (size_t)apart->n + (size_t)(3 * (first + b) + k / 3)];
      status = flesh_coupling_append(to, apart->from[first + b], apart->from[first + a], block);
    }
    first += has;
  }
  return status;
}

int flesh_couplings_find_apart(flesh_couplings *self, int effect, const flesh_point *given, flesh_reading reading, double step)
{
  int status = make_system(self, effect);
  if (status) return status;
  const flesh_apart *apart = &self->apart;
  flesh_point point = flesh_apart_point(apart, given);
  const double **const read[FLESH_READINGS] = {&point.lagged.x, &point.lagged.v, &point.frozen.x, &point.frozen.v,
                                               &point.v,        &point.x};
  const size_t n = (size_t)apart->n;
  double *room = apart->room + ARRAYS * n, *sums = room + 4 * n, *first = sums + 3 * n;
  const variation v = {apart, apart->of[effect], &point, read[reading], step, room, room + n, room + 2 * n, room + 3 * n};
  memset(first, 0, 3 * n * sizeof *first);
  status = flesh_system_residual(v.system, v.point, v.middle);
  for (int a = 1; a < (flesh_mesh_order(apart->mesh) == 2 ? 10 : 4) && !status; a++) {
    for (size_t c = 0; c < 3 && !status; c++) status = differentiate(&v, (int)c, a, sums + c * n, first + c * n);
    if (!status) status = append_blocks(apart, a, sums, &self->by[reading]);
  }
  return status ? status : append_blocks(apart, 0, first, &self->by[reading]);
}
