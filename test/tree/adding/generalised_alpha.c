/* generalised_alpha.c: the generalised-alpha method (Chung & Hulbert 1993), of order 2 with the spectral radius rho_inf
 * at infinite frequency. Newmark's formulas with gamma = 1/2 - alpha_m + alpha_f, beta = (1 - alpha_m + alpha_f)^2/4, and
 *
 *   r(t, x, v, a) = 0  at  t, x, v = (1 - alpha_f) (.)_{n+1} + alpha_f (.)_n,  a = (1 - alpha_m) a_{n+1} + alpha_m a_n,
 *   alpha_m = (2 rho_inf - 1)/(rho_inf + 1),  alpha_f = rho_inf/(rho_inf + 1).
 *
 * As in newmark.c all forces are evaluated once, at the point between. */
#include "time/method.h"

typedef struct formulas {
  double alpha_m, alpha_f, beta, gamma;
} formulas;

static formulas formulas_of(const flesh_method_memory *memory)
{
  double rho = memory->options.rho_inf, m = (2 * rho - 1) / (rho + 1), f = rho / (rho + 1);
  return (formulas){m, f, (1 - m + f) * (1 - m + f) / 4, 0.5 - m + f};
}

static void generalised_alpha_stage(const flesh_method_memory *memory, const flesh_state *state, double t_end, double h,
                                    flesh_stage *stage)
{
  const formulas p = formulas_of(memory);
  const double reach = 1 - p.alpha_f, ratio = p.gamma / p.beta, *a = memory->vectors[0];
  for (int d = 0; d < memory->n; d++) {
    double next = -state->v[d] / (p.beta * h) - (0.5 / p.beta - 1) * a[d]; /* a_{n+1} for u = 0 */
    memory->v0[d] = state->v[d] + reach * h * ((1 - p.gamma) * a[d] + p.gamma * next);
    memory->a0[d] = (1 - p.alpha_m) * next + p.alpha_m * a[d];
  }
  *stage = (flesh_stage){.t = state->t + reach * (t_end - state->t),
                         .load = 1,
                         .prescribed_fraction = 1,
                         .shift = {.x = reach, .v = reach * ratio / h, .a = (1 - p.alpha_m) / (p.beta * h * h)},
                         .x0 = state->x,
                         .v0 = memory->v0,
                         .a0 = memory->a0};
}

static void generalised_alpha_finish(flesh_method_memory *memory, const double *u, double h, flesh_state *state)
{
  const formulas p = formulas_of(memory);
  double *a = memory->vectors[0];
  for (int d = 0; d < memory->n; d++) {
    double next = (u[d] / h - state->v[d]) / (p.beta * h) - (0.5 / p.beta - 1) * a[d];
    state->x[d] += u[d];
    state->v[d] += h * ((1 - p.gamma) * a[d] + p.gamma * next);
    a[d] = next;
  }
}

const flesh_method_row flesh_method_generalised_alpha = {
    .vectors = 1, .acceleration = 1, .stage = generalised_alpha_stage, .finish = generalised_alpha_finish};
