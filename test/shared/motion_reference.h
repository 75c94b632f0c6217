/* motion_reference.h: motions of a test body integrated by GSL almost to rounding, and runs of flesh's methods. */
#ifndef FLESH_TEST_MOTION_REFERENCE_H
#define FLESH_TEST_MOTION_REFERENCE_H

#include <gsl/gsl_errno.h>
#include <gsl/gsl_fit.h>
#include <gsl/gsl_odeiv2.h>
#include <stdint.h>
#include <stdlib.h>

#include "body.h"
#include "methods.h"
#include "test.h"

typedef struct motion_reference {
  const test_body *body;
  double until; /* the state just before this time counts */
  uint8_t *fixed;
  double *mass, *x, *zeros, *r;
} motion_reference;

/* Computes y' for y = (x, v): x' = v, v' = -M^-1 r(t, x, v, 0) with the lumped mass; constrained dofs follow their
 * motion. */
static int motion_derivative(double t, const double y[], double dydt[], void *data)
{
  motion_reference *self = data;
  int n = self->body->n;
  t = fmin(t, nextafter(self->until, -INFINITY));
  memcpy(self->x, y, (size_t)n * sizeof *y);
  flesh_system_prescribe(self->body->system, t, self->x);
  const flesh_point point = flesh_point_at(t, self->x, y + n, self->zeros);
  if (flesh_system_residual(self->body->system, &point, self->r)) return GSL_EBADFUNC;
  for (int d = 0; d < n; d++) {
    dydt[d] = self->fixed[d] ? 0 : y[n + d];
    dydt[n + d] = self->fixed[d] ? 0 : -self->r[d] / self->mass[d / 3];
  }
  return GSL_SUCCESS;
}

/* Integrates the state to `end` by Runge-Kutta-Prince-Dormand 8(9), restarted at every event. Lumped masses only. The
 * velocities of constrained dofs are not changed. */
static inline void motion_reference_run(const test_body *body, double end, double tolerance, flesh_state *state)
{
  int n = body->n;
  double *y = malloc(2 * (size_t)n * sizeof *y);
  motion_reference self = {.body = body,
                           .fixed = malloc((size_t)n),
                           .mass = malloc((size_t)n * sizeof(double)),
                           .x = malloc((size_t)n * sizeof(double)),
                           .zeros = calloc((size_t)n, sizeof(double)),
                           .r = malloc((size_t)n * sizeof(double))};
  flesh_mesh_lumped_mass(body->mesh, body->density, self.mass);
  memcpy(y, state->x, (size_t)n * sizeof *y);
  memcpy(y + n, state->v, (size_t)n * sizeof *y);
  gsl_odeiv2_system equations = {motion_derivative, NULL, 2 * (size_t)n, &self};
  while (state->t < end) {
    double next = fmin(end, flesh_system_next_event(body->system, state->t));
    self.until = next;
    flesh_system_fixed(body->system, state->t + (next - state->t) / 2, self.fixed);
    gsl_odeiv2_driver *driver =
        gsl_odeiv2_driver_alloc_y_new(&equations, gsl_odeiv2_step_rk8pd, 1e-4, tolerance, 0);
    CHECK(gsl_odeiv2_driver_apply(driver, &state->t, next, y) == GSL_SUCCESS);
    gsl_odeiv2_driver_free(driver);
    state->t = next;
    flesh_system_prescribe(body->system, nextafter(next, -INFINITY), y);
  }
  memcpy(state->x, y, (size_t)n * sizeof *y);
  memcpy(state->v, y + n, (size_t)n * sizeof *y);
  free(y);
  free(self.fixed);
  free(self.mass);
  free(self.x);
  free(self.zeros);
  free(self.r);
}

/* Copies a state of n unknowns; free the copy with state_free. */
static inline flesh_state state_copy(int n, const flesh_state *other)
{
  flesh_state state = {.t = other->t, .x = malloc((size_t)n * sizeof(double)), .v = malloc((size_t)n * sizeof(double))};
  memcpy(state.x, other->x, (size_t)n * sizeof(double));
  memcpy(state.v, other->v, (size_t)n * sizeof(double));
  return state;
}

static inline void state_free(flesh_state *state)
{
  free(state->x);
  free(state->v);
}

/* Returns the root mean square distance of the nodes. */
static inline double motion_distance(int n, const double *x, const double *y)
{
  double sum = 0;
  for (int d = 0; d < n; d++) sum += (x[d] - y[d]) * (x[d] - y[d]);
  return sqrt(3 * sum / n);
}

/* Makes an integrator whose residual's tolerance is `tolerance`; motion_run takes `steps` equal steps to `end` with
 * it. */
static inline flesh_integrator *motion_integrator(const test_body *body, flesh_method method, double tolerance)
{
  flesh_solver_options options;
  flesh_integrator *integrator = NULL;
  flesh_solver_options_default(&options);
  options.newton_tolerance = tolerance;
  CHECK_OK(flesh_integrator_create(body->system, method, &options, &integrator));
  /* Methods are measured without safeguards: HHT's first steps of a stiff oscillation overshoot. */
  CHECK_OK(flesh_integrator_set_max_energy_gain(integrator, INFINITY));
  return integrator;
}

/* Makes an integrator whose steps are chosen by their error. */
static inline flesh_integrator *motion_controlled(const test_body *body, flesh_method method, double residual, double tolerance)
{
  flesh_integrator *integrator = motion_integrator(body, method, residual);
  test_control(integrator, tolerance);
  return integrator;
}

static inline void motion_run(const test_body *body, flesh_method method, double tolerance, int steps, double end,
                       flesh_state *state)
{
  flesh_integrator *integrator = motion_integrator(body, method, tolerance);
  double begin = state->t, h = (end - begin) / steps;
  for (int k = 1; k <= steps; k++) {
    CHECK_OK(flesh_integrator_step(integrator, state, h, NULL));
    state->t = begin + k * h;
  }
  flesh_integrator_destroy(&integrator);
}

/* Returns the slope of log(error) over log(h) by least squares. */
static inline double fitted_order(int count, const double *h, const double *error)
{
  double lh[16], le[16], c0, c1, cov00, cov01, cov11, sum;
  for (int k = 0; k < count; k++) lh[k] = log(h[k]), le[k] = log(error[k]);
  gsl_fit_linear(lh, 1, le, 1, (size_t)count, &c0, &c1, &cov00, &cov01, &cov11, &sum);
  return c1;
}

/* Computes the body's motion up to `end`, in a new state: by GSL, whose equations use the lumped mass; with the
 * consistent mass by a fine run of the midpoint rule. */
static inline flesh_state motion_exact(const test_body *b, flesh_mass mass, int steps, double end)
{
  flesh_state exact = state_copy(b->n, &b->state);
  if (mass == FLESH_MASS_LUMPED) motion_reference_run(b, end, 1e-13, &exact);
  else motion_run(b, FLESH_METHOD_MIDPOINT, 1e-12, steps, end, &exact);
  return exact;
}

/* Reads x and v of `nodes` nodes at a time from another code's trajectory, reference/oracle/<name>. */
static inline void motion_read_states(const char *name, double time, int nodes, flesh_state *state)
{
  char path[256], line[512];
  double t = NAN;
  snprintf(path, sizeof path, "reference/oracle/%s", name);
  FILE *file = fopen(path, "r");
  CHECK(file != NULL);
  if (!file) return;
  while (fgets(line, sizeof line, file))
    if (sscanf(line, "t %lf", &t) == 1 && fabs(t - time) < 1e-9) break;
  CHECK_NEAR(t, time, 1e-9);
  for (int i = 0; i < nodes; i++)
    for (int c = 0; c < 6; c++) CHECK(fscanf(file, "%lf", (c < 3 ? state->x : state->v - 3) + 3 * i + c) == 1);
  fclose(file);
}

/* Makes a bar of 3 x 1 x 1 m, clamped at x = 0, that swings from its rest shape under gravity. */
static inline void make_bar(flesh_energy energy, flesh_mass mass, test_body *b)
{
  CHECK_OK(test_body_create(test_box(3, 1, 1, 3, 1, 1), test_material(energy, 0.4), 1000, mass, 1, b));
  CHECK_OK(test_body_gravity(b, 0, 0, -2));
  CHECK_OK(test_body_clamp(b, 1e-9));
  CHECK_OK(flesh_system_finalize(b->system));
  for (int i = 0; i < b->n / 3; i++) {
    double X = flesh_mesh_positions(b->mesh)[3 * i];
    b->state.v[3 * i + 2] = 0.2 * X * X;
  }
}

#endif
