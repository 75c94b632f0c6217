/* coupling.c: coloured differences of an effect's residual, and a test that they contain its whole derivative. */
#include "sensitivity/coupling.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/effect.h"
#include "effect/private.h"
#include "linear/block_matrix.h"
#include "math/differences.h"
#include "math/xorshift.h"
#include "system/effect_view.h"
#include "system/one_effect.h"
#include "system/pattern.h"

/* Kinds of coupling, from effects on single nodes to effects that couple all of them. */
enum { ALONE, BY_CELLS, ON_SURFACE, AS_K, ALL };
/* Largest number of nodes that may all be coupled: each takes twelve residuals. */
enum { MOST_COUPLED = 3000 };

/* Step of differences relative to the distance of nodes: contact reaches over a thousandth of that distance, and round-off
 * is a billionth of it. */
static const double step_of_length = 3e-6;
/* Factor on the steps for tets: with clamped eigenvalues some tet is always near a kink. */
static const double shorter = 1e-2;

int flesh_couplings_create(const flesh_system *system, flesh_couplings *self)
{
  const flesh_mesh *mesh = flesh_system_mesh(system);
  const double *volumes = flesh_mesh_tet_volumes(mesh);
  const int n = flesh_system_unknowns(system), tets = flesh_mesh_tet_count(mesh);
  double volume = 0;
  for (int e = 0; e < tets; e++) volume += volumes[e];
  *self = (flesh_couplings){.system = system, .n = n, .nodes = n / 3, .length = cbrt(6 * volume / (tets > 0 ? tets : 1))};
  self->room = flesh_calloc(7 * (size_t)n + 1, sizeof *self->room);
  self->kinds = flesh_calloc((size_t)flesh_system_effect_count(system) * FLESH_ARGUMENTS + 1, 1);
  return self->room && self->kinds ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for the sensitivities of %d unknowns", n);
}

static void clear_colouring(flesh_colouring *colouring)
{
  flesh_free(colouring->starts);
  flesh_free(colouring->neighbours);
  flesh_free(colouring->colour);
  *colouring = (flesh_colouring){0};
}

void flesh_couplings_clear(flesh_couplings *self)
{
  if (self->system) flesh_torn_body_clear(flesh_system_effect_count(self->system), &self->torn_body);
  for (int k = 0; k < FLESH_COLOURINGS; k++) clear_colouring(&self->colourings[k]);
  for (int k = 0; k < FLESH_ARGUMENTS; k++) {
    flesh_free(self->by[k].nodes);
    flesh_free(self->by[k].blocks);
  }
  flesh_free(self->room);
  flesh_free(self->kinds);
  *self = (flesh_couplings){0};
}

/* Lists the neighbours of the chosen nodes: themselves alone, or the nodes that K couples, or all. */
static void neighbours_of(const flesh_couplings *self, int kind, const flesh_block_matrix *K, const int *chosen,
                          flesh_colouring *to)
{
  int *place = to->colour; /* work space, for now */
  for (int pass = 0; pass < 2; pass++) {
    memset(place, 0, (size_t)self->nodes * sizeof *place);
    for (int i = 0; i < self->nodes; i++) {
      if (!chosen[i]) continue;
      const int from = pass ? to->starts[i] : 0;
      if (kind == ALONE && pass) to->neighbours[from] = i;
      if (kind == ALONE) place[i] = 1;
      for (int j = 0; kind == ALL && j < self->nodes; j++) {
        if (!chosen[j]) continue;
        if (pass) to->neighbours[from + place[i]] = j;
        place[i]++;
      }
      for (int k = K->row_start[i]; kind != ALONE && kind != ALL && k < K->row_end[i]; k++) {
        const int j = K->column[k];
        if (!chosen[j]) continue;
        if (pass) to->neighbours[from + place[i]] = j;
        place[i]++;
        if (j == i) continue;
        if (pass) to->neighbours[to->starts[j] + place[j]] = i;
        place[j]++;
      }
    }
    for (int i = 0; i < self->nodes && !pass; i++) to->starts[i + 1] = to->starts[i] + place[i];
  }
}

/* Colours node by node with the first colour that no node with a common neighbour has. `taken` [nodes+1] is work space. */
static void colour_nodes(const flesh_couplings *self, const int *chosen, int *taken, flesh_colouring *to)
{
  for (int i = 0; i < self->nodes; i++) to->colour[i] = -1, taken[i] = -1;
  for (int i = 0; i < self->nodes; i++) {
    if (!chosen[i]) continue;
    for (int k = to->starts[i]; k < to->starts[i + 1]; k++) {
      const int row = to->neighbours[k];
      for (int m = to->starts[row]; m < to->starts[row + 1]; m++) {
        const int other = to->colour[to->neighbours[m]];
        if (other >= 0) taken[other] = i;
      }
    }
    int colour = 0;
    while (taken[colour] == i) colour++;
    to->colour[i] = colour;
    if (colour >= to->colours) to->colours = colour + 1;
  }
}

/* Chooses the nodes that a kind of coupling is between; returns their number. */
static int choose(const flesh_couplings *self, int kind, int *chosen)
{
  int triangles, count = 0;
  const int *surface = flesh_mesh_surface(flesh_system_mesh(self->system), &triangles);
  for (int i = 0; i < self->nodes; i++) chosen[i] = kind == ALONE || kind == BY_CELLS || kind == AS_K;
  for (int k = 0; k < 3 * triangles && (kind == ON_SURFACE || kind == ALL); k++) chosen[surface[k]] = 1;
  for (int i = 0; i < self->nodes; i++) count += chosen[i];
  return count;
}

static int make_colouring(flesh_couplings *self, int kind, const flesh_block_matrix *K)
{
  flesh_colouring *to = &self->colourings[kind];
  const size_t nodes = (size_t)self->nodes;
  int *chosen = flesh_calloc(2 * nodes + 2, sizeof *chosen);
  const int count = chosen ? choose(self, kind, chosen) : 0;
  const size_t all = kind == ALL ? (size_t)count * (size_t)count : kind == ALONE ? nodes : 2 * (size_t)K->row_start[K->rows];
  if (kind != ALL || count <= MOST_COUPLED) {
    to->starts = flesh_calloc(nodes + 1, sizeof *to->starts);
    to->neighbours = flesh_calloc(all + 1, sizeof *to->neighbours);
    to->colour = flesh_calloc(nodes + 1, sizeof *to->colour);
    if (!chosen || !to->starts || !to->neighbours || !to->colour) {
      flesh_free(chosen);
      clear_colouring(to);
      return flesh_fail(FLESH_ERR_MEMORY, "no memory for the couplings of %d nodes", self->nodes);
    }
    neighbours_of(self, kind, K, chosen, to);
    colour_nodes(self, chosen, chosen + nodes + 1, to);
  }
  flesh_free(chosen);
  return FLESH_OK;
}

/* Makes the colouring of a kind if it does not exist; that of an effect's cells by the pattern of these cells alone, as
 * other effects may make K dense. Without cells there is none. */
static int ready_colouring(flesh_couplings *self, int effect, int kind, const flesh_block_matrix *K)
{
  const flesh_effect *of = flesh_system_effect(self->system, effect);
  if (kind == BY_CELLS && self->cells_of != effect) clear_colouring(&self->colourings[kind]);
  if (self->colourings[kind].colours) return FLESH_OK;
  if (kind != BY_CELLS) return make_colouring(self, kind, K);
  const flesh_cells *cells = of->operations->cells ? of->operations->cells(of) : NULL;
  if (!cells) return FLESH_OK;
  flesh_pattern pattern;
  int status = flesh_pattern_create(self->nodes, 1, &cells, &pattern);
  if (status) return status;
  const flesh_block_matrix coupled = flesh_pattern_matrix(&pattern, NULL);
  status = make_colouring(self, kind, &coupled);
  flesh_pattern_clear(&pattern);
  self->cells_of = effect;
  return status;
}

/* One effect, and the argument of its point that is varied. */
typedef struct variation {
  flesh_couplings *self;
  const flesh_point *point;
  int effect;
  flesh_argument argument;
  double *varied; /* [n] */
} variation;

static const double *read_at(const flesh_point *point, flesh_argument argument)
{
  const double *const states[] = {point->lagged.x, point->lagged.v, point->frozen.x, point->frozen.v, point->v, point->x};
  return states[argument];
}

static void vary(const variation *v, const double *to, flesh_point *point)
{
  *point = *v->point;
  const double **const states[] = {&point->lagged.x, &point->lagged.v, &point->frozen.x, &point->frozen.v,
                                   &point->v, &point->x};
  *states[v->argument] = to;
}

/* Computes sum [n], the derivative of the effect's residual along a direction [n], by differences of fourth order. */
static int differentiate(const variation *v, double step, const double *direction, double *sum)
{
  flesh_couplings *self = v->self;
  const double *base = read_at(v->point, v->argument);
  double *r = self->room;
  flesh_point point;
  vary(v, v->varied, &point);
  memset(sum, 0, (size_t)self->n * sizeof *sum);
  for (int k = 0; k < FLESH_DIFFERENCES; k++) {
    for (int d = 0; d < self->n; d++) v->varied[d] = (base ? base[d] : 0) + flesh_difference_at[k] * step * direction[d];
    const int status = flesh_system_effect_residual(self->system, v->effect, &point, r);
    if (status) return status;
    for (int d = 0; d < self->n; d++) sum[d] += flesh_difference_weight[k] / step * r[d];
  }
  return FLESH_OK;
}

static int make_room(flesh_coupling *to)
{
  int room = to->room; /* also the room of the blocks */
  if (flesh_grow(&to->nodes, 2 * sizeof *to->nodes, to->count, &room) &&
      flesh_grow(&to->blocks, 9 * sizeof *to->blocks, to->count, &to->room))
    return FLESH_OK;
  return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d couplings", to->count + 1);
}

int flesh_coupling_append(void *coupling, int row, int column, const double block[9])
{
  flesh_coupling *to = coupling;
  double size = 0;
  for (int k = 0; k < 9; k++) size += fabs(block[k]);
  if (size == 0) return FLESH_OK;
  const int status = make_room(to);
  if (status) return status;
  memcpy(to->blocks + 9 * (size_t)to->count, block, 9 * sizeof *block);
  to->nodes[2 * to->count] = row;
  to->nodes[2 * to->count + 1] = column;
  to->count++;
  return FLESH_OK;
}

/* Adds a block; `sums` [3][n] are the derivatives by the column's components. */
static int add_block(const variation *v, int row, int column, const double *sums)
{
  double block[9];
  for (int k = 0; k < 9; k++) block[k] = sums[(size_t)(k % 3) * (size_t)v->self->n + 3 * (size_t)row + (size_t)(k / 3)];
  return flesh_coupling_append(&v->self->by[v->argument], row, column, block);
}

/* Adds the blocks of all nodes of a colour. */
static int take_colour(const variation *v, const flesh_colouring *colouring, int colour, double step)
{
  flesh_couplings *self = v->self;
  const size_t n = (size_t)self->n;
  double *direction = self->room + n, *sums = self->room + 2 * n;
  int status = FLESH_OK;
  for (int component = 0; component < 3 && !status; component++) {
    for (int d = 0; d < self->n; d++) direction[d] = d % 3 == component && colouring->colour[d / 3] == colour;
    status = differentiate(v, step, direction, sums + (size_t)component * n);
  }
  for (int j = 0; j < self->nodes && !status; j++) {
    if (colouring->colour[j] != colour) continue;
    for (int k = colouring->starts[j]; k < colouring->starts[j + 1] && !status; k++)
      status = add_block(v, colouring->neighbours[k], j, sums);
  }
  return status;
}

/* Tests whether the blocks from `first` on give the derivative along a pseudo-random direction: at each node or, if not
 * `strict`, in the norm over all, where large forces hide small ones. */
static int is_whole(const variation *v, int first, double step, int strict, int *whole)
{
  flesh_couplings *self = v->self;
  flesh_coupling *by = &self->by[v->argument];
  double *direction = self->room + self->n, *sum = self->room + 2 * (size_t)self->n, *left = sum + self->n;
  double off = 0, size = 0, forces = 0;
  const double *before = self->room + 6 * (size_t)self->n, rounding = 32 * DBL_EPSILON / step;
  uint32_t random = flesh_xorshift_first;
  for (int d = 0; d < self->n; d++) direction[d] = flesh_xorshift(&random) * 0x1p-31 - 1;
  const int status = differentiate(v, step, direction, sum);
  memcpy(left, sum, (size_t)self->n * sizeof *left);
  const flesh_coupling part = {.count = by->count - first, .nodes = by->nodes + 2 * (size_t)first,
                               .blocks = by->blocks + 9 * (size_t)first};
  for (int k = 0; k < part.count; k++)
    for (int i = 0; i < 3; i++)
      for (int c = 0; c < 3; c++)
        left[3 * part.nodes[2 * k] + i] -= part.blocks[9 * (size_t)k + 3 * (size_t)i + (size_t)c] *
                                           direction[3 * part.nodes[2 * k + 1] + c];
  *whole = 1;
  for (int d = 0; d < self->n; d++) {
    off += left[d] * left[d], size += sum[d] * sum[d], forces += before[d] * before[d];
    if (strict ? d % 3 < 2 : d + 1 < self->n) continue;
    *whole &= !(off > 1e-12 * size + rounding * rounding * forces);
    off = size = forces = 0;
  }
  return status;
}

/* Finds the derivative of the effect by the argument, with a kind of coupling. */
static int find_by_kind(const variation *v, int kind, double step, int strict, int *whole)
{
  flesh_couplings *self = v->self;
  const flesh_colouring *colouring = &self->colourings[kind];
  const int first = self->by[v->argument].count;
  int status = FLESH_OK;
  for (int colour = 0; colour < colouring->colours && !status; colour++) status = take_colour(v, colouring, colour, step);
  if (!status) status = is_whole(v, first, step, strict, whole);
  if (!status && !*whole) self->by[v->argument].count = first;
  return status;
}

/* Takes the derivative that the effect itself provides, if it is smooth there: wide steps have less round-off, short ones
 * cross fewer kinks. */
static int find_own(const variation *v, const flesh_effect_partials *own, double step, int *whole)
{
  flesh_coupling *by = &v->self->by[v->argument];
  const flesh_effect *effect = flesh_system_effect(v->self->system, v->effect);
  flesh_effect_view view = flesh_effect_view_of(v->self->system, v->point);
  const int first = by->count;
  int status = own->couple(effect, flesh_effect_view_turn(&view, v->effect), v->argument, flesh_coupling_append, by);
  if (status > 0) return FLESH_OK;
  for (int k = 0; k < 2 && !*whole && !status; k++) status = is_whole(v, first, k ? shorter * step : step, 0, whole);
  return status;
}

/* Fails because there is no derivative. */
static int refuse(const variation *v, const char *read)
{
  return flesh_fail(FLESH_ERR_ARGUMENT, "at t = %g s the forces of effect %s have no derivative by the %s state, so that "
                                        "there are no sensitivities; where edges lie exactly above each other, a body "
                                        "that is moved a little has them", v->point->t,
                    flesh_system_effect(v->self->system, v->effect)->operations->name, read);
}

/* Finds the derivative of the effect by the argument, with the narrowest coupling that contains all of it, starting from
 * the last one used. Contact that has just begun is smooth only within shorter steps. */
static int find_reading(const variation *v, double step, const flesh_block_matrix *K)
{
  enum { FINER = 3 };
  flesh_couplings *self = v->self;
  unsigned char *kind = &self->kinds[v->effect * FLESH_ARGUMENTS + (int)v->argument];
  const flesh_effect *effect = flesh_system_effect(self->system, v->effect);
  const flesh_effect_partials *own = flesh_effect_private_of(effect)->partials;
  const char *read = v->argument < FLESH_FROZEN_X ? "lagged" : v->argument < FLESH_OWN_V ? "frozen" : "moving";
  if (own && own->tear) return flesh_couplings_find_torn(self, v->effect, v->point, v->argument, shorter * step);
  if (own && own->couple) {
    int whole = 0;
    const int status = find_own(v, own, step, &whole);
    return status || whole ? status : refuse(v, read);
  }
  for (; *kind < FLESH_COLOURINGS; ++*kind) {
    const flesh_colouring *colouring = &self->colourings[*kind];
    int whole = 0, status = ready_colouring(self, v->effect, *kind, K);
    if (!status && !colouring->colours && *kind == BY_CELLS) continue;
    if (!status && !colouring->colours)
      return flesh_fail(FLESH_ERR_ARGUMENT, "effect %s reads the %s state of more than %d nodes at once, which is too many for "
                                            "sensitivities", effect->operations->name, read, MOST_COUPLED);
    for (int finer = 0; finer < FINER && !whole && !status; finer++)
      status = find_by_kind(v, *kind, step * pow(0.1, finer), finer + 1 < FINER, &whole);
    if (status || whole) return status;
  }
  return refuse(v, read);
}

/* Whether the effect's residual, `before` at the point, changes in any bit when all nodes of the argument are moved. */
static int reads(const variation *v, const double *before, double step, int *yes)
{
  flesh_couplings *self = v->self;
  const double *base = read_at(v->point, v->argument);
  double *after = self->room + 2 * (size_t)self->n;
  uint32_t random = flesh_xorshift_first;
  flesh_point point;
  vary(v, v->varied, &point);
  for (int d = 0; d < self->n; d++)
    v->varied[d] = (base ? base[d] : 0) + step * (flesh_xorshift(&random) * 0x1p-31 - 1);
  const int status = flesh_system_effect_residual(self->system, v->effect, &point, after);
  *yes = !status && memcmp(before, after, (size_t)self->n * sizeof *after) != 0;
  return status;
}

/* Finds the derivatives of an effect by its arguments. */
static int find_effect(flesh_couplings *self, int effect, const flesh_point *point, unsigned arguments, const double steps[2],
                       const flesh_block_matrix *K)
{
  double *before = self->room + 6 * (size_t)self->n;
  const flesh_effect_partials *own = flesh_effect_private_of(flesh_system_effect(self->system, effect))->partials;
  for (int k = 0; k < FLESH_ARGUMENTS && own && own->multiply; k++) self->own[k] |= (arguments & own->reads) >> k & 1;
  if (own && own->multiply) return FLESH_OK;
  int status = flesh_system_effect_residual(self->system, effect, point, before);
  for (int k = 0; k < FLESH_ARGUMENTS && !status; k++) {
    const variation v = {self, point, effect, (flesh_argument)k, self->room + 5 * (size_t)self->n};
    const double step = steps[flesh_argument_is_of_v((flesh_argument)k)];
    int yes = 0;
    const int freezes = flesh_system_effect(self->system, effect)->operations->traits & FLESH_FREEZES;
    if (!(arguments >> k & 1) || (k >= FLESH_OWN_V && !freezes)) continue;
    status = reads(&v, before, step, &yes);
    if (yes) status = find_reading(&v, step, K);
  }
  return status;
}

/* Whether the effect may read more than the point's own state: a function of x does not, nor do M a and C v. */
static int may_read(const flesh_effect *effect)
{
  if (flesh_effect_private_of(effect)->linear_in_v && !flesh_effect_has_trait(effect, FLESH_IS_FOLLOWER_LOAD)) return 0;
  return effect->operations->residual && effect->operations->role != FLESH_ROLE_INERTIA &&
         !flesh_effect_has_trait(effect, FLESH_DEPENDS_ON_POSITION_ONLY);
}

/* Returns the largest speed among the arguments. */
static double find_fastest(const flesh_couplings *self, const flesh_point *point)
{
  const double *const speeds[] = {point->v, point->lagged.v, point->frozen.v};
  double fastest = 0;
  for (int k = 0; k < 3; k++)
    for (int d = 0; d < self->n && speeds[k]; d++)
      if (fabs(speeds[k][d]) > fastest) fastest = fabs(speeds[k][d]);
  return fastest;
}

int flesh_couplings_find(flesh_couplings *self, const flesh_point *point, unsigned arguments, const flesh_block_matrix *K)
{
  const double length = step_of_length * self->length, fastest = find_fastest(self, point),
               steps[] = {length, fastest > 0 ? step_of_length * fastest : length};
  const int blocks = K->row_start[K->rows];
  for (int k = 0; k < FLESH_COLOURINGS && blocks != self->blocks; k++) clear_colouring(&self->colourings[k]);
  self->blocks = blocks;
  self->point = *point;
  for (int k = 0; k < FLESH_ARGUMENTS; k++) self->by[k].count = 0, self->own[k] = 0;
  int status = FLESH_OK;
  for (int e = 0; e < flesh_system_effect_count(self->system) && !status && arguments; e++)
    if (may_read(flesh_system_effect(self->system, e)) && !flesh_couplings_leave(self, e))
      status = find_effect(self, e, point, arguments, steps, K);
  return status;
}

void flesh_couplings_add(const flesh_couplings *self, flesh_argument argument, int transposed, double scale,
                         const double *x, double *y)
{
  const flesh_coupling *by = &self->by[argument];
  for (int k = 0; k < by->count; k++) {
    const int row = 3 * by->nodes[2 * k], column = 3 * by->nodes[2 * k + 1];
    const double *block = by->blocks + 9 * (size_t)k;
    for (int i = 0; i < 3; i++)
      for (int c = 0; c < 3; c++) {
        if (transposed) y[column + c] += scale * block[3 * i + c] * x[row + i];
        else y[row + i] += scale * block[3 * i + c] * x[column + c];
      }
  }
  flesh_effect_view view = flesh_effect_view_of(self->system, &self->point);
  for (int e = 0; e < flesh_system_effect_count(self->system) && self->own[argument]; e++) {
    const flesh_effect *effect = flesh_system_effect(self->system, e);
    const flesh_effect_partials *own = flesh_effect_private_of(effect)->partials;
    if (own && own->multiply && !flesh_couplings_leave(self, e))
      own->multiply(effect, flesh_effect_view_turn(&view, e), argument, transposed, scale, x, y);
  }
}
