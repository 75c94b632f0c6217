/* runge_kutta.c: diagonally implicit Runge-Kutta methods whose first stage is explicit (ESDIRK; Kennedy & Carpenter 2016,
 * "Diagonally implicit Runge-Kutta methods for ordinary differential equations, a review", NASA/TM-2016-219173).
 *
 * With g = gamma h, x^ = x_n + h sum_j a_ij V_j and v^ = v_n + h sum_j a_ij A_j over the stages before, stage i is
 *   x = x^ + g V,   V = v^ + g A,   r(t_i, x, V, A) = 0,
 * a step of backward Euler by g from (x^, v^), with the potential |x - x^ - g v^|^2_M / (2 g^2) + Psi(x). The first stage is
 * the state with its acceleration, which is that of the last stage of the step before, as that is the step's end. */
#include <assert.h>
#include <math.h>
#include <string.h>

#include "time/butcher_table.h"
#include "time/method.h"

/* vectors[0] is the acceleration a_n; [1] an earlier one; then V_i and A_i of each implicit stage in turn. */
enum { BEFORE = 1, FIRST = 2 };
static_assert((int)FLESH_METHOD_VECTORS >= FIRST + 2 * (FLESH_TABLE_STAGES - 1), "room for every stage");

static double *V_of(const flesh_method_memory *memory, int i) { return memory->vectors[FIRST + 2 * (i - 1)]; }
static double *A_of(const flesh_method_memory *memory, int i) { return memory->vectors[FIRST + 2 * (i - 1) + 1]; }

/* esdirk325 needs the fewest iterations where steps are easy; where bodies are tangled or collide its long stages with
 * weights of both signs put in energy, and esdirk324 damps more. Where stiff bodies fly the errors of esdirk325 fall more
 * slowly than the tolerance. */
static const flesh_butcher_table *table_of(const flesh_method_memory *memory)
{
  const flesh_table given = memory->options.table;
  if (memory->method == FLESH_METHOD_BACKWARD_EULER) return &flesh_butcher_backward_euler;
  if (given != FLESH_TABLE_AUTO) return flesh_butcher_table_of(given);
  return flesh_butcher_table_of(memory->easy >= FLESH_EASY_STEPS ? FLESH_TABLE_ESDIRK325 : FLESH_TABLE_ESDIRK324);
}

static int runge_kutta_stages(const flesh_method_memory *memory) { return table_of(memory)->stages - 1; }

static void runge_kutta_stage(const flesh_method_memory *memory, const flesh_state *state, double t_end, double h,
                              flesh_stage *stage)
{
  const flesh_butcher_table *table = table_of(memory);
  const int i = memory->at + 1;
  const double *weights = table->a[i], gamma = weights[i], g = gamma * h, *a = memory->vectors[0];
  for (int d = 0; d < memory->n; d++) {
    double dx = weights[0] * state->v[d], dv = weights[0] * a[d];
    for (int j = 1; j < i; j++) {
      dx += weights[j] * V_of(memory, j)[d];
      dv += weights[j] * A_of(memory, j)[d];
    }
    memory->v0[d] = -dx / gamma;
    memory->a0[d] = (memory->v0[d] - state->v[d] - h * dv) / g;
  }
  *stage = (flesh_stage){.t = i == table->stages - 1 ? t_end : state->t + table->c[i] * (t_end - state->t),
                         .load = 1,
                         .prescribed_fraction = 1,
                         .shift = {.x = 1, .v = 1 / g, .a = 1 / (g * g)},
                         .x0 = state->x,
                         .v0 = memory->v0,
                         .a0 = memory->a0};
}

static void runge_kutta_keep(flesh_method_memory *memory, const flesh_stage *stage, const double *u)
{
  double *V = V_of(memory, memory->at + 1), *A = A_of(memory, memory->at + 1);
  for (int d = 0; d < memory->n; d++) {
    V[d] = stage->v0[d] + stage->shift.v * u[d];
    A[d] = stage->a0[d] + stage->shift.a * u[d];
  }
}

/* Returns the two of `count` times that are nearest to t; -1: there is none. */
static void find_nearest(const double *times, int count, double t, int nearest[2])
{
  nearest[0] = nearest[1] = -1;
  for (int j = 0; j < count; j++) {
    if (nearest[0] < 0 || fabs(times[j] - t) < fabs(times[nearest[0]] - t)) {
      nearest[1] = nearest[0];
      nearest[0] = j;
    } else if (nearest[1] < 0 || fabs(times[j] - t) < fabs(times[nearest[1]] - t)) {
      nearest[1] = j;
    }
  }
}

/* Computes the cubic in time through the positions and velocities of the stages `ends`, at stage i: h times a sum of
 * the velocities before. That of the start comes from v0. */
static void follow_cubic(const flesh_method_memory *memory, const flesh_stage *stage, double h, const int ends[2], double *u)
{
  const flesh_butcher_table *table = table_of(memory);
  const int i = memory->at + 1, p = ends[1], q = ends[0];
  const double *c = table->c, *own = table->a[i], width = c[q] - c[p], s = (c[i] - c[p]) / width;
  const double to_q = s * s * (3 - 2 * s);
  double weights[FLESH_TABLE_STAGES] = {0};
  for (int j = 0; j < i; j++) weights[j] = (1 - to_q) * table->a[p][j] + to_q * table->a[q][j];
  weights[p] += width * s * (1 - s) * (1 - s);
  weights[q] += width * s * s * (s - 1);
  const double start = weights[0] / own[0];
  for (int d = 0; d < memory->n; d++) {
    u[d] = -start * own[i] * stage->v0[d];
    for (int j = 1; j < i; j++) u[d] += (weights[j] - start * own[j]) * V_of(memory, j)[d];
    u[d] *= h;
  }
}

/* The better guess is the line through the two known accelerations that are nearest in time. Stiff forces, as of
 * contact, have accelerations that tell nothing of the next ones: the safer guess is the cubic between the stages
 * before, at the first stage the present acceleration. */
static int runge_kutta_guess(const flesh_method_memory *memory, const flesh_stage *stage, double h, int which, double *u)
{
  const flesh_butcher_table *table = table_of(memory);
  const int i = memory->at + 1, cubic = which == 1 && i > 1, known = i + (!cubic && memory->before < 0);
  const double t = table->c[i] * h, g2 = 1 / stage->shift.a;
  double times[FLESH_TABLE_STAGES + 1];
  const double *a[FLESH_TABLE_STAGES + 1] = {memory->vectors[0]};
  int nearest[2];
  for (int j = 0; j < i; j++) times[j] = table->c[j] * h;
  for (int j = 1; j < i; j++) a[j] = A_of(memory, j);
  times[i] = memory->before;
  a[i] = memory->vectors[BEFORE];
  find_nearest(times, known, t, nearest);
  if (which == 0 && nearest[1] < 0) return 0;
  if (cubic) {
    follow_cubic(memory, stage, h, nearest, u);
    return 1;
  }
  const double *near = a[nearest[0]], *far = which == 0 ? a[nearest[1]] : near;
  const double share = which == 0 ? (t - times[nearest[0]]) / (times[nearest[1]] - times[nearest[0]]) : 0;
  for (int d = 0; d < memory->n; d++) u[d] = g2 * (near[d] + share * (far[d] - near[d]) - stage->a0[d]); /* A = a0 + u/g^2 */
  return 1;
}

static void runge_kutta_velocity(const flesh_method_memory *memory, const flesh_state *state, const double *u, double h,
                                 double *v)
{
  (void)state, (void)u, (void)h;
  memcpy(v, V_of(memory, table_of(memory)->stages - 1), (size_t)memory->n * sizeof *v);
}

static void runge_kutta_finish(flesh_method_memory *memory, const flesh_state *state, const double *u, double h)
{
  (void)state, (void)u;
  const flesh_butcher_table *table = table_of(memory);
  const size_t bytes = (size_t)memory->n * sizeof(double);
  const int last = table->stages - 1;
  int nearest = 1; /* to the end */
  for (int i = 2; i < last; i++)
    if (table->c[i] > table->c[nearest]) nearest = i;
  memcpy(memory->vectors[0], A_of(memory, last), bytes);
  memcpy(memory->vectors[BEFORE], A_of(memory, nearest), bytes);
  memory->before = (table->c[nearest] - 1) * h;
}

/* Adds g times the error of the velocities, as a filter through (I - g J)^-1 does (error_control.c). */
static int runge_kutta_error(const flesh_method_memory *memory, const flesh_state *state, const double *u, double h,
                             double *e)
{
  (void)u;
  const flesh_butcher_table *table = table_of(memory);
  const int last = table->stages - 1;
  const double g = table->a[1][1] * h, *b = table->a[last];
  double weights[FLESH_TABLE_STAGES];
  for (int i = 0; i <= last; i++) weights[i] = h * (b[i] - table->embedded[i]);
  for (int d = 0; d < memory->n; d++) {
    e[d] = weights[0] * (state->v[d] + g * memory->vectors[0][d]);
    for (int i = 1; i <= last; i++) e[d] += weights[i] * (V_of(memory, i)[d] + g * A_of(memory, i)[d]);
  }
  return 1;
}

/* The positions of a method of order 1 err even if its velocities do not. */
static const double *runge_kutta_momentum(const flesh_method_memory *memory, double h, double *e)
{
  const flesh_butcher_table *table = table_of(memory);
  if (table->order > 1) return NULL;
  const double *before = memory->vectors[0], *after = A_of(memory, 1), weight = table->a[1][1] - table->embedded[1];
  for (int d = 0; d < memory->n; d++) e[d] = weight * h * h * (after[d] - before[d]);
  return e;
}

static double runge_kutta_weight(const flesh_method_memory *memory, int i)
{
  const flesh_butcher_table *table = table_of(memory);
  return table->a[table->stages - 1][i];
}

static int runge_kutta_order(const flesh_method_memory *memory) { return table_of(memory)->order; }

const flesh_method_row flesh_method_runge_kutta = {.vectors = FIRST + 2 * (FLESH_TABLE_STAGES - 1),
                                                   .remembered = 2,
                                                   .acceleration = 1,
                                                   .stages = runge_kutta_stages,
                                                   .stage = runge_kutta_stage,
                                                   .keep = runge_kutta_keep,
                                                   .guess = runge_kutta_guess,
                                                   .velocity = runge_kutta_velocity,
                                                   .finish = runge_kutta_finish,
                                                   .weight = runge_kutta_weight,
                                                   .order = runge_kutta_order,
                                                   .error = runge_kutta_error,
                                                   .momentum = runge_kutta_momentum};
