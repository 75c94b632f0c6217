/* bossak.c: the method of Wood, Bossak & Zienkiewicz (1981), of order 2, with the spectral radius rho_inf of infinitely
 * fast oscillations. Newmark's formulas with gamma = 1/2 - m, beta = (1 - m)^2/4, m = (rho_inf - 1)/(rho_inf + 1), and
 * balance at the step's end with the acceleration (1 - m) a_{n+1} + m a_n. */
#include "time/method.h"

static double mean_of(const flesh_method_memory *memory)
{
  return (memory->options.rho_inf - 1) / (memory->options.rho_inf + 1);
}

/* Computes a_{n+1} for x_{n+1} - x_n = u. */
static double next_of(double m, double u, double h, double v, double a)
{
  const double beta = (1 - m) * (1 - m) / 4;
  return (u / h - v) / (beta * h) - (0.5 / beta - 1) * a;
}

static void bossak_velocity(const flesh_method_memory *memory, const flesh_state *state, const double *u, double h, double *v)
{
  const double m = mean_of(memory), *a = memory->vectors[0];
  for (int d = 0; d < memory->n; d++)
    v[d] = state->v[d] + h * ((0.5 + m) * a[d] + (0.5 - m) * next_of(m, u[d], h, state->v[d], a[d]));
}

static void bossak_stage(const flesh_method_memory *memory, const flesh_state *state, double t_end, double h,
                         flesh_stage *stage)
{
  const double m = mean_of(memory), beta = (1 - m) * (1 - m) / 4, *a = memory->vectors[0];
  for (int d = 0; d < memory->n; d++) {
    const double next = next_of(m, 0, h, state->v[d], a[d]);
    memory->v0[d] = state->v[d] + h * ((0.5 + m) * a[d] + (0.5 - m) * next);
    memory->a0[d] = (1 - m) * next + m * a[d];
  }
  *stage = (flesh_stage){.t = t_end,
                         .load = 1,
                         .prescribed_fraction = 1,
                         .shift = {.x = 1, .v = (0.5 - m) / (beta * h), .a = (1 - m) / (beta * h * h)},
                         .x0 = state->x,
                         .v0 = memory->v0,
                         .a0 = memory->a0};
}

static void bossak_finish(flesh_method_memory *memory, const flesh_state *state, const double *u, double h)
{
  double *a = memory->vectors[0];
  for (int d = 0; d < memory->n; d++) a[d] = next_of(mean_of(memory), u[d], h, state->v[d], a[d]);
}

const flesh_method_row flesh_method_bossak = {
    .vectors = 1, .acceleration = 1, .stage = bossak_stage, .velocity = bossak_velocity, .finish = bossak_finish};
