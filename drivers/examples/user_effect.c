/* user_effect.c: defines an effect of the user's own, a floor.
 *
 * Nodes below z = 0 are pushed up: V = sum of k/2 min(z, 0)^2 over the nodes. An effect gives its residual dV/dx, its
 * Jacobian and its potential; everything else (projection, line search, all integrators, IDA, energies) treats it like
 * the library's own effects. The audit compares its derivatives with differences before it is used. The body falls from
 * 0.2 m.
 *
 * Sample output:
 *   audit: passed
 *   t = 0.1 s: z from 0.1411 m to 0.6411 m
 *   t = 0.5 s: z from -0.0051 m to 0.5056 m
 *   t = 10.0 s: z from -0.0142 m to 0.4829 m
 *   the floor pushes with 4905 N; the body weighs 4905 N
 */
#include "bar.h"

typedef struct floor_data {
  int nodes;
  double stiffness; /* N/m */
} floor_data;

/* r += dV/dx */
static int floor_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const floor_data *self = effect->data;
  for (int i = 0; i < self->nodes; i++) r[3 * i + 2] += self->stiffness * fmin(point->x[3 * i + 2], 0);
  return FLESH_OK;
}

/* K += shift.x d2V/dx2, which has diagonal blocks only, so that the effect needs no cells. */
static int floor_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                          flesh_block_matrix *K, const int *slots)
{
  (void)slots;
  const floor_data *self = effect->data;
  for (int i = 0; i < self->nodes; i++)
    if (point->x[3 * i + 2] < 0) K->values[9 * K->row_start[i] + 8] += shift->x * self->stiffness; /* zz */
  return FLESH_OK;
}

/* phi += V / shift.x */
static int floor_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *phi,
                           double *magnitude)
{
  const floor_data *self = effect->data;
  double V = 0;
  if (shift->x == 0) return FLESH_OK;
  for (int i = 0; i < self->nodes; i++) V += self->stiffness / 2 * pow(fmin(point->x[3 * i + 2], 0), 2);
  *phi += V / shift->x;
  *magnitude += V / shift->x;
  return FLESH_OK;
}

static int floor_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  double magnitude = 0;
  *energy = 0;
  return floor_potential(effect, point, &(flesh_shift){.x = 1}, energy, &magnitude);
}

static const flesh_effect_operations floor_operations = {
    .name = "floor",
    .role = FLESH_ROLE_CONTACT,
    .traits = FLESH_IS_PASSIVE,
    .residual = floor_residual,
    .jacobian = floor_jacobian,
    .potential = floor_potential,
    .energy = floor_energy,
    .destroy = free,
};

int main(void)
{
  /* 1. A free body under gravity. */
  bar b;
  bar_begin(&b, FLESH_ELEMENT_TET4, bar_soft(), 1);
  bar_gravity(&b, -9.81);

  /* 2. The effect. */
  floor_data *data = malloc(sizeof *data);
  *data = (floor_data){b.nodes, 2e4};
  flesh_effect *effect;
  TRY(flesh_effect_create(&floor_operations, b.mesh, data, &effect));

  /* 3. The audit, in a state where the floor acts and nothing is zero by chance. */
  double *x = malloc(3 * (size_t)b.nodes * sizeof(double));
  for (int d = 0; d < 3 * b.nodes; d++) x[d] = b.state.x[d] - 0.3 + 0.01 * sin(7 * d);
  flesh_derivative_report audit;
  TRY(flesh_effect_check_derivatives(effect, b.mesh, 0, x, 1, &audit));
  printf("audit: %s\n", flesh_derivative_report_passes(&audit, 1e-6) ? "passed" : "failed");
  free(x);

  /* 4. The system, without pins. */
  TRY(flesh_system_add_effect(b.system, &effect));
  TRY(flesh_system_finalize(b.system));

  /* 5. The body falls, and comes to rest. */
  for (int i = 0; i < b.nodes; i++) b.state.x[3 * i + 2] += 0.2;
  flesh_solver_options options;
  flesh_integrator *integrator;
  flesh_solver_options_default(&options);
  TRY(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  for (int step = 1; step <= 500; step++) {
    TRY(flesh_integrator_step(integrator, &b.state, 1. / 50, NULL));
    if (step == 5 || step == 25 || step == 500) {
      double lowest = INFINITY, highest = -INFINITY;
      for (int i = 0; i < b.nodes; i++) {
        lowest = fmin(lowest, b.state.x[3 * i + 2]);
        highest = fmax(highest, b.state.x[3 * i + 2]);
      }
      printf("t = %.1f s: z from %.4f m to %.4f m\n", b.state.t, lowest, highest);
    }
  }
  /* The floor carries the body's weight, 500 kg times g. */
  double pushed = 0;
  for (int i = 0; i < b.nodes; i++) pushed -= 2e4 * fmin(b.state.x[3 * i + 2], 0);
  printf("the floor pushes with %.0f N; the body weighs %.0f N\n", pushed, 500 * 9.81);
  flesh_integrator_destroy(&integrator);
  bar_destroy(&b);
  return 0;
}
