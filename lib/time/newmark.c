/* newmark.c: Newmark's method (1959) and the family that is Newmark's formulas with balance at a point within the step:
 *
 *   x_{n+1} = x_n + h v_n + h^2 ((1/2 - beta) a_n + beta a_{n+1})
 *   v_{n+1} = v_n + h ((1 - gamma) a_n + gamma a_{n+1})
 *   r(t, x, v, a) = 0 at  t, x, v = reach (.)_{n+1} + (1 - reach) (.)_n,  a = inertia a_{n+1} + (1 - inertia) a_n.
 *
 * Newmark's balances at the end: reach = inertia = 1. With gamma = 1/2 + s, beta = (1 + s)^2/4, s = inertia - reach, the
 * family is of order 2 and damps fast oscillations most: HHT-alpha (Hilber, Hughes & Taylor 1977) has reach = 1 + alpha,
 * inertia = 1; the generalized-alpha method (Chung & Hulbert 1993) reach = 1/(rho + 1), inertia = (2 - rho)/(rho + 1),
 * which leaves of infinitely fast oscillations the share rho in a step, their spectral radius, and damps slower ones least.
 *
 * All forces, internal and external, are evaluated once, at the point between; for linear forces that is the same as
 * the papers' mean of the forces at both ends.
 *
 * Without damping what a velocity has across constraints changes its sign in every step, and the acceleration with it, ever
 * faster the shorter steps are (Cardona & Geradin 1989). Errors, which see that, would make them ever shorter: so where
 * errors choose steps and multipliers hold constraints, all of the family damp at least like HHT-alpha with alpha = -light. */
#include <math.h>
#include <string.h>

#include "time/method.h"

/* vectors[0] is the acceleration a_n, [1] that before it. */
enum { BEFORE = 1 };

static const double light = 0.05;

typedef struct formulas {
  double beta, gamma, reach, inertia;
} formulas;

static formulas formulas_of(const flesh_method_memory *memory)
{
  const flesh_method_options *o = &memory->options;
  const double least = memory->held ? light : 0, rho = fmin(o->spectral_radius, (1 - least) / (1 + least));
  formulas p = {.beta = o->beta, .gamma = o->gamma, .reach = 1, .inertia = 1};
  if (memory->method == FLESH_METHOD_NEWMARK && p.gamma - 0.5 >= least) return p;
  if (memory->method == FLESH_METHOD_GENERALIZED_ALPHA) p.reach = 1 / (rho + 1), p.inertia = (2 - rho) / (rho + 1);
  else p.reach = 1 + fmin(memory->method == FLESH_METHOD_HHT ? o->alpha : 0, -least);
  const double s = p.inertia - p.reach;
  p.gamma = 0.5 + s;
  p.beta = (1 + s) * (1 + s) / 4;
  return p;
}

/* Finds a_{n+1} for x_{n+1} - x_n = u. */
static double next_of(const formulas *p, double u, double h, double v, double a)
{
  return (u / h - v) / (p->beta * h) - (0.5 / p->beta - 1) * a;
}

static void newmark_stage(const flesh_method_memory *memory, const flesh_state *state, double t_end, double h,
                          flesh_stage *stage)
{
  const formulas p = formulas_of(memory);
  const double ratio = p.gamma / p.beta, *a = memory->vectors[0];
  for (int d = 0; d < memory->n; d++) {
    memory->v0[d] =
        state->v[d] + p.reach * (h * (1 - ratio / 2) * a[d] - ratio * state->v[d]);
    memory->a0[d] = p.inertia * next_of(&p, 0, h, state->v[d], a[d]) + (1 - p.inertia) * a[d];
  }
  *stage = (flesh_stage){
      .t = p.reach == 1 ? t_end : state->t + p.reach * (t_end - state->t),
      .load = 1,
      .prescribed_fraction = 1,
      .shift = {.x = p.reach, .v = p.reach * ratio / h, .a = p.inertia / (p.beta * h * h)},
      .x0 = state->x,
      .v0 = memory->v0,
      .a0 = memory->a0};
}

static void newmark_velocity(const flesh_method_memory *memory, const flesh_state *state, const double *u, double h,
                             double *v)
{
  const formulas p = formulas_of(memory);
  const double *a = memory->vectors[0];
  for (int d = 0; d < memory->n; d++)
    v[d] = state->v[d] + h * ((1 - p.gamma) * a[d] + p.gamma * next_of(&p, u[d], h, state->v[d], a[d]));
}

static void newmark_finish(flesh_method_memory *memory, const flesh_state *state, const double *u, double h)
{
  const formulas p = formulas_of(memory);
  double *a = memory->vectors[0];
  memcpy(memory->vectors[BEFORE], a, (size_t)memory->n * sizeof *a);
  memory->before = -h;
  for (int d = 0; d < memory->n; d++) a[d] = next_of(&p, u[d], h, state->v[d], a[d]);
}

static int newmark_guess(const flesh_method_memory *memory, const flesh_stage *stage, double h, int which, double *u)
{
  return flesh_method_guess(memory, stage, memory->vectors[0], memory->vectors[BEFORE], formulas_of(memory).inertia * h,
                            which, u);
}

/* Estimates the error (beta - 1/6) h^2 (a_{n+1} - a_n): Zienkiewicz & Xie 1991, "A simple error estimator and adaptive
 * time stepping procedure for dynamic analysis", Earthquake Engineering and Structural Dynamics 20. */
static int newmark_error(const flesh_method_memory *memory, const flesh_state *state, const double *u, double h,
                         double *e)
{
  const formulas p = formulas_of(memory);
  const double *a = memory->vectors[0];
  for (int d = 0; d < memory->n; d++)
    e[d] = h * h * (p.beta - 1. / 6) * (next_of(&p, u[d], h, state->v[d], a[d]) - a[d]);
  return 1;
}

#define FAMILY(COUNT)                                                                                                  \
  .vectors = COUNT, .acceleration = 1, .stage = newmark_stage, .guess = newmark_guess, .velocity = newmark_velocity,   \
  .finish = newmark_finish, .error = newmark_error, .swings = 1
static const flesh_method_row controlled = {
    FAMILY(FLESH_METHOD_VECTORS), .remembered = BEFORE + 1, .stand_in = &flesh_method_runge_kutta};
const flesh_method_row flesh_method_newmark = {FAMILY(BEFORE + 1), .controlled = &controlled},
                       flesh_method_hht = {FAMILY(BEFORE + 1), .controlled = &controlled},
                       flesh_method_generalized_alpha = {FAMILY(BEFORE + 1), .controlled = &controlled};
