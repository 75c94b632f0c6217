/* newmark.c: Newmark's method (1959) and HHT-alpha (Hilber, Hughes & Taylor 1977), which is Newmark's with
 * gamma = 1/2 - alpha, beta = (1 - alpha)^2/4 and balance at a point shifted back into the step.
 *
 *   x_{n+1} = x_n + h v_n + h^2 ((1/2 - beta) a_n + beta a_{n+1})
 *   v_{n+1} = v_n + h ((1 - gamma) a_n + gamma a_{n+1})
 *   r(t, x, v, a_{n+1}) = 0 at  t = t_{n+1} + alpha h,  x = (1 + alpha) x_{n+1} - alpha x_n,  v likewise.
 *
 * All forces, internal and external, are evaluated once, at the shifted point; for linear forces that is the same as
 * the paper's mean of the forces at both ends. Newmark's has alpha = 0. */
#include <string.h>

#include "time/method.h"

/* vectors[0] is the acceleration a_n, [1] that before it. */
enum { BEFORE = 1 };

/* Everything the formulas need; with u = x_{n+1} - x_n,
 * a_{n+1} = (u - h v_n)/(beta h^2) - (1/(2 beta) - 1) a_n. */
static void formulas_stage(const flesh_method_memory *memory, const flesh_method_options *p,
                           const flesh_state *state, double t_end, double h, flesh_stage *stage)
{
  const double reach = 1 + p->alpha, ratio = p->gamma / p->beta, *a = memory->vectors[0];
  for (int d = 0; d < memory->n; d++) {
    memory->v0[d] =
        state->v[d] + reach * (h * (1 - ratio / 2) * a[d] - ratio * state->v[d]);
    memory->a0[d] = -state->v[d] / (p->beta * h) - (0.5 / p->beta - 1) * a[d];
  }
  *stage = (flesh_stage){
      .t = state->t + reach * (t_end - state->t),
      .load = 1,
      .prescribed_fraction = 1,
      .shift = {.x = reach, .v = reach * ratio / h, .a = 1 / (p->beta * h * h)},
      .x0 = state->x,
      .v0 = memory->v0,
      .a0 = memory->a0};
  if (p->alpha == 0) stage->t = t_end;
}

static void formulas_finish(flesh_method_memory *memory, const flesh_method_options *p,
                            const double *u, double h, flesh_state *state)
{
  double *a = memory->vectors[0];
  memcpy(memory->vectors[BEFORE], a, (size_t)memory->n * sizeof *a);
  memory->before = -h;
  for (int d = 0; d < memory->n; d++) {
    double next = (u[d] / h - state->v[d]) / (p->beta * h) - (0.5 / p->beta - 1) * a[d];
    state->x[d] += u[d];
    state->v[d] += h * ((1 - p->gamma) * a[d] + p->gamma * next);
    a[d] = next;
  }
}

/* Goes on as the last two accelerations did, or keeps the last. */
static int formulas_guess(const flesh_method_memory *memory, const flesh_stage *stage, double h, int which, double *u)
{
  const double *a = memory->vectors[0], *before = memory->vectors[BEFORE];
  const double share = which == 0 && memory->before < 0 ? h / -memory->before : 0;
  if (which == 0 && !(memory->before < 0)) return 0;
  for (int d = 0; d < memory->n; d++) u[d] = (a[d] + share * (a[d] - before[d]) - stage->a0[d]) / stage->shift.a;
  return 1;
}

/* (beta - 1/6) h^2 (a_{n+1} - a_n): Zienkiewicz & Xie 1991, "A simple error estimator and adaptive time stepping procedure
 * for dynamic analysis", Earthquake Engineering and Structural Dynamics 20. */
static int formulas_error(const flesh_method_memory *memory, const flesh_method_options *p, const flesh_state *state,
                          const double *u, double h, double *e)
{
  const double *a = memory->vectors[0];
  for (int d = 0; d < memory->n; d++) {
    const double next = (u[d] / h - state->v[d]) / (p->beta * h) - (0.5 / p->beta - 1) * a[d];
    e[d] = h * h * (p->beta - 1. / 6) * (next - a[d]);
  }
  return 1;
}

static flesh_method_options newmark_parameters(const flesh_method_memory *memory)
{
  return (flesh_method_options){.beta = memory->options.beta, .gamma = memory->options.gamma};
}

static void newmark_stage(const flesh_method_memory *memory, const flesh_state *state, double t_end,
                          double h, flesh_stage *stage)
{
  flesh_method_options p = newmark_parameters(memory);
  formulas_stage(memory, &p, state, t_end, h, stage);
}

static void newmark_finish(flesh_method_memory *memory, const double *u, double h,
                           flesh_state *state)
{
  flesh_method_options p = newmark_parameters(memory);
  formulas_finish(memory, &p, u, h, state);
}

static int newmark_error(const flesh_method_memory *memory, const flesh_state *state, const double *u, double h,
                         double *e)
{
  flesh_method_options p = newmark_parameters(memory);
  return formulas_error(memory, &p, state, u, h, e);
}

static flesh_method_options hht_parameters(const flesh_method_memory *memory)
{
  double alpha = memory->options.alpha;
  return (flesh_method_options){
      .alpha = alpha, .beta = (1 - alpha) * (1 - alpha) / 4, .gamma = 0.5 - alpha};
}

static void hht_stage(const flesh_method_memory *memory, const flesh_state *state, double t_end,
                      double h, flesh_stage *stage)
{
  flesh_method_options p = hht_parameters(memory);
  formulas_stage(memory, &p, state, t_end, h, stage);
}

static void hht_finish(flesh_method_memory *memory, const double *u, double h, flesh_state *state)
{
  flesh_method_options p = hht_parameters(memory);
  formulas_finish(memory, &p, u, h, state);
}

static int hht_error(const flesh_method_memory *memory, const flesh_state *state, const double *u, double h, double *e)
{
  flesh_method_options p = hht_parameters(memory);
  return formulas_error(memory, &p, state, u, h, e);
}

const flesh_method_row flesh_method_newmark = {.vectors = 2,
                                               .acceleration = 1,
                                               .stage = newmark_stage,
                                               .guess = formulas_guess,
                                               .finish = newmark_finish,
                                               .error = newmark_error};
const flesh_method_row flesh_method_hht = {.vectors = 2,
                                           .acceleration = 1,
                                           .stage = hht_stage,
                                           .guess = formulas_guess,
                                           .finish = hht_finish,
                                           .error = hht_error};
