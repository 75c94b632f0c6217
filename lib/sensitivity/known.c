/* known.c: the known vectors at the beginning of parts, copied for the first part of a group and recomputed for the others
 * by the method's own map; and the stages that follow from them. */
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "sensitivity/trajectory.h"

/* Number of dofs that are advanced together. */
enum { SOME = 64 };

void flesh_known_clear(double **known)
{
  for (int k = 0; k < FLESH_KNOWN; k++) {
    flesh_free(known[k]);
    known[k] = NULL;
  }
}

double *flesh_trajectory_copy(const double *from, int count)
{
  double *to = from && count ? flesh_malloc((size_t)count * sizeof *to) : NULL;
  if (to) memcpy(to, from, (size_t)count * sizeof *to);
  return to;
}

/* Whether a stage of the part reads the method's vector. */
static int is_read(const flesh_taken_part *taken, const flesh_method_map *map, int vector)
{
  const int column = FLESH_KNOWN_VECTORS + vector;
  int read = vector == 0 && taken->acceleration;
  for (int s = 0; s < map->stages; s++) read |= map->x0[s][column] != 0 || map->v0[s][column] != 0 || map->a0[s][column] != 0;
  return read;
}

/* Finds the known vectors that a part reads; NULL: it does not. */
static void find_known(const flesh_taken_part *taken, const flesh_recorded_part *part, const double *known[FLESH_KNOWN])
{
  flesh_method_map map;
  flesh_trajectory_map(part, &map);
  memset(known, 0, FLESH_KNOWN * sizeof *known);
  known[FLESH_KNOWN_X] = taken->from->x;
  known[FLESH_KNOWN_V] = taken->from->v;
  for (int k = 0; k < part->vectors; k++)
    if (is_read(taken, &map, k)) known[FLESH_KNOWN_VECTORS + k] = taken->memory->vectors[k];
  if (taken->lagged == taken->from) return;
  known[FLESH_KNOWN_LAGGED_X] = taken->lagged->x;
  known[FLESH_KNOWN_LAGGED_V] = taken->lagged->v;
}

/* Whether the numbers [n] equal the recomputed ones, up to round-off, which short steps magnify in accelerations. */
static int are_found(int n, const double *known, const double *found)
{
  double off = 0, size = 0;
  for (int d = 0; d < n && found; d++) {
    const double difference = known[d] - found[d];
    off += difference * difference;
    size += known[d] * known[d];
  }
  return found && off <= 1e-20 * size;
}

int flesh_trajectory_take_known(flesh_trajectory *self, const flesh_taken_part *taken, flesh_recorded_part *part)
{
  const size_t bytes = (size_t)self->n * sizeof(double);
  const double *known[FLESH_KNOWN];
  find_known(taken, part, known);
  part->follows = (self->now.at - self->now.block) % FLESH_GROUP != 0 && !taken->anew;
  for (int k = 0; k < FLESH_KNOWN; k++) {
    part->reads |= (unsigned)(known[k] != NULL) << k;
    if (known[k] && part->follows) part->follows = are_found(self->n, known[k], self->reached[k]);
  }
  /* An equilibrium whose load was only partly raised when its solve failed is not followed by another. */
  const int rests = self->integrator->memory.method == FLESH_METHOD_STATIC;
  if (self->total && self->now.limit < 0 && rests && self->reached[FLESH_KNOWN_X] &&
      !are_found(self->n, known[FLESH_KNOWN_X], self->reached[FLESH_KNOWN_X]))
    return self->tape.moved(self);
  if (part->follows) return FLESH_OK;
  flesh_known_clear(self->reached);
  for (int k = 0; k < FLESH_KNOWN; k++) {
    if (!known[k]) continue;
    part->known[k] = flesh_trajectory_copy(known[k], self->n);
    self->reached[k] = flesh_trajectory_copy(known[k], self->n);
    if (!part->known[k] || !self->reached[k])
      return flesh_fail(FLESH_ERR_MEMORY, "no memory for what is known to a part of a step of %d unknowns", self->n);
    part->bytes += bytes;
  }
  return FLESH_OK;
}

void flesh_trajectory_map(const flesh_recorded_part *part, flesh_method_map *map)
{
  const int takes_over = !part->taken.own && part->taken.acceleration;
  flesh_method_map_find(part->taken.row, &part->memory, part->vectors, part->taken.h, takes_over, map);
}

/* Computes y, the combination of the known vectors and of the unknowns of earlier stages, as left by their last solves. */
static void combine(const flesh_recorded_part *part, const double columns[FLESH_MAP_COLUMNS], int solve, int n, double *y)
{
  memset(y, 0, (size_t)n * sizeof *y);
  for (int k = 0; k < FLESH_KNOWN; k++)
    for (int d = 0; d < n && columns[k] != 0 && part->known[k]; d++) y[d] += columns[k] * part->known[k][d];
  for (int s = 0; s < solve; s++) {
    const int at = part->solves[s].at, last = s + 1 == part->count || part->solves[s + 1].at != at;
    const double weight = columns[FLESH_KNOWN + at];
    for (int d = 0; d < n && last && weight != 0; d++) y[d] += weight * part->solves[s].u[d];
  }
}

/* Makes the stage of a solve; its bases x0, v0 and a0 are stored in `bases` [n] each. */
static void find_bases(flesh_trajectory *self, const flesh_recorded_part *part, const flesh_method_map *map, int solve,
                       double *const bases[3], flesh_stage *stage)
{
  double *x0 = bases[0], *v0 = bases[1], *a0 = bases[2];
  const flesh_recorded_solve *recorded = &part->solves[solve];
  *stage = recorded->stage;
  combine(part, map->x0[recorded->at], solve, self->n, x0);
  combine(part, map->v0[recorded->at], solve, self->n, v0);
  combine(part, map->a0[recorded->at], solve, self->n, a0);
  stage->x0 = x0;
  stage->v0 = recorded->has_v0 ? v0 : NULL;
  stage->a0 = a0;
  if (!part->taken.second || !part->taken.own) return;
  flesh_prescribed_set(&self->prescribed, part->taken.begin, part->taken.end, part->known[FLESH_KNOWN_X]);
  flesh_prescribed_stage(&self->prescribed, stage, v0, a0);
}

/* Finds the lagged state of a solve: the end of the solve before it, in its own stage or in the one before, or the lagged
 * state of the part. Overwrites a0 [n]. */
static void find_lagged(flesh_trajectory *self, const flesh_recorded_part *part, const flesh_method_map *map, int solve,
                        double *x_lag, double *v_lag, double *a0)
{
  const int lags_stage = part->known[FLESH_KNOWN_LAGGED_X] != NULL;
  const size_t bytes = (size_t)self->n * sizeof *x_lag;
  flesh_stage before;
  if (solve == 0) {
    memcpy(x_lag, part->known[lags_stage ? FLESH_KNOWN_LAGGED_X : FLESH_KNOWN_X], bytes);
    memcpy(v_lag, part->known[lags_stage ? FLESH_KNOWN_LAGGED_V : FLESH_KNOWN_V], bytes);
    return;
  }
  const double *u = part->solves[solve - 1].u;
  find_bases(self, part, map, solve - 1, (double *const[]){x_lag, v_lag, a0}, &before);
  if (!before.v0) memset(v_lag, 0, bytes);
  for (int d = 0; d < self->n; d++) {
    x_lag[d] += before.shift.x * u[d];
    v_lag[d] += before.shift.v * u[d];
  }
}

void flesh_trajectory_stage(flesh_trajectory *self, const flesh_recorded_part *part, const flesh_method_map *map, int solve,
                            double *room, flesh_stage *stage)
{
  const size_t n = (size_t)self->n;
  const flesh_stage *recorded = &part->solves[solve].stage;
  double *const bases[] = {room, room + n, room + 2 * n}, *x_lag = room + 3 * n, *v_lag = room + 4 * n;
  find_lagged(self, part, map, solve, x_lag, v_lag, bases[2]);
  find_bases(self, part, map, solve, bases, stage);
  stage->x_lag = recorded->x_lag ? x_lag : NULL; /* if NULL, it is x0 at the same time */
  stage->v_lag = recorded->v_lag ? v_lag : NULL;
  stage->x_from = NULL;
  stage->multipliers = part->solves[solve].multipliers;
  stage->internal = part->internal;
}

/* Advances the lagged state to the end of the part's last stage, where the next part needs it. */
static void go_on_lagged(flesh_trajectory *self, const flesh_recorded_part *part, const flesh_method_map *map, double **known)
{
  const int last = part->count - 1;
  double *const bases[] = {self->bases, self->bases + self->n, self->bases + 2 * (size_t)self->n};
  const double *u = part->solves[last].u;
  flesh_recorded_part at = *part;
  flesh_stage stage;
  memcpy(at.known, known, sizeof at.known);
  find_bases(self, &at, map, last, bases, &stage);
  for (int d = 0; d < self->n; d++) {
    known[FLESH_KNOWN_LAGGED_X][d] = bases[0][d] + stage.shift.x * u[d];
    known[FLESH_KNOWN_LAGGED_V][d] = (stage.v0 ? bases[1][d] : 0) + stage.shift.v * u[d];
  }
}

/* Drops known vectors whose values at the end depend on vectors that are not known. */
static void drop_lost(const flesh_method_map *map, double **known)
{
  int lost[FLESH_KNOWN] = {0};
  for (int k = 0; k < FLESH_KNOWN_LAGGED_X; k++)
    for (int c = 0; c < FLESH_KNOWN; c++) lost[k] |= known[k] && !known[c] && map->end[k][c] != 0;
  for (int k = 0; k < FLESH_KNOWN_LAGGED_X; k++) {
    if (!lost[k]) continue;
    flesh_free(known[k]);
    known[k] = NULL;
  }
}

/* Computes the known vectors at the end from those at the beginning and the unknowns u, for `count` dofs from `first` on. */
static void go_on_some(const flesh_method_map *map, double **known, const double *const *u, int first, int count)
{
  double before[FLESH_KNOWN][SOME];
  for (int c = 0; c < FLESH_KNOWN; c++)
    if (known[c]) memcpy(before[c], known[c] + first, (size_t)count * sizeof(double));
  for (int k = 0; k < FLESH_KNOWN_LAGGED_X; k++) {
    double *to = known[k] ? known[k] + first : NULL;
    for (int d = 0; d < count && to; d++) to[d] = 0;
    for (int c = 0; c < FLESH_MAP_COLUMNS && to; c++) {
      const double weight = map->end[k][c], *from = c < FLESH_KNOWN ? before[c] : u[c - FLESH_KNOWN] + first;
      for (int d = 0; d < count && weight != 0; d++) to[d] += weight * from[d];
    }
  }
}

void flesh_known_go_on(flesh_trajectory *self, const flesh_recorded_part *part, double **known)
{
  flesh_method_map map;
  const double *u[FLESH_MAP_STAGES];
  flesh_trajectory_map(part, &map);
  for (int s = 0; s < FLESH_MAP_STAGES; s++) u[s] = part->solves[0].u; /* missing stages have weight 0 */
  for (int s = 0; s < part->count; s++) u[part->solves[s].at] = part->solves[s].u;
  if (known[FLESH_KNOWN_LAGGED_X]) go_on_lagged(self, part, &map, known);
  if (part->taken.second)
    flesh_prescribed_set(&self->prescribed, part->taken.begin, part->taken.end, known[FLESH_KNOWN_X]);
  drop_lost(&map, known);
  for (int d = 0; d < self->n; d += SOME) go_on_some(&map, known, u, d, self->n - d < SOME ? self->n - d : SOME);
  if (part->taken.second) flesh_prescribed_finish(&self->prescribed, known[FLESH_KNOWN_X], known[FLESH_KNOWN_V]);
}

int flesh_trajectory_find_known(flesh_trajectory *self, const flesh_recorded_part *part, const flesh_recorded_part **found)
{
  const size_t bytes = (size_t)self->n * sizeof(double);
  const flesh_recorded_part *first = part;
  double **known = self->found;
  *found = part;
  if (!part->follows) return FLESH_OK;
  while (first->follows) first--;
  for (int k = 0; k < FLESH_KNOWN; k++) {
    if (!first->known[k]) {
      flesh_free(known[k]);
      known[k] = NULL;
      continue;
    }
    if (!known[k]) known[k] = flesh_malloc(bytes);
    if (!known[k]) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a part of a step of %d unknowns", self->n);
    memcpy(known[k], first->known[k], bytes);
  }
  for (const flesh_recorded_part *at = first; at < part; at++) flesh_known_go_on(self, at, known);
  self->view = *part;
  for (int k = 0; k < FLESH_KNOWN; k++) self->view.known[k] = part->reads >> k & 1 ? known[k] : NULL;
  *found = &self->view;
  return FLESH_OK;
}
