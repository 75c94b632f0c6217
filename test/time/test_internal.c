// TEST quick seconds=60
/* test_internal.c: internal variables of a user-defined effect: a spring that yields, against the closed form, in
 * statics and in motion; equilibria that never settle. */
#include "flesh/flesh.h"
#include "test.h"

/* Pulls a node along x, by 2 t for t up to 1 and back; beyond the force `yields` it becomes permanently longer. */
typedef struct slider {
  int node;
  double X, stiffness, yields; /* m, at rest; N/m, N */
} slider;

static double target(double t) { return 2 * (t < 1 ? t : 2 - t); }

static double force_of(const slider *s, const flesh_point *point)
{
  const double slip = point->internal ? point->internal[0] : 0;
  return s->stiffness * (s->X + target(point->t) - slip - point->x[3 * s->node]);
}

static int slider_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const slider *s = effect->data;
  r[3 * s->node] -= force_of(s, point);
  return FLESH_OK;
}

static int slider_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                           flesh_block_matrix *K, const int *slots)
{
  const slider *s = effect->data;
  (void)point, (void)slots;
  K->values[9 * (size_t)K->row_start[s->node]] += shift->x * s->stiffness;
  return FLESH_OK;
}

static int slider_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  const slider *s = effect->data;
  const double force = force_of(s, point);
  *energy = force * force / (2 * s->stiffness);
  return FLESH_OK;
}

static int slider_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *phi,
                            double *magnitude)
{
  double energy;
  if (shift->x == 0) return FLESH_OK;
  slider_energy(effect, point, &energy);
  *phi += energy / shift->x;
  *magnitude += energy / shift->x;
  return FLESH_OK;
}

static int slider_count(const flesh_effect *effect)
{
  (void)effect;
  return 1;
}

/* Slips until the force is the yield force. */
static int slider_update(const flesh_effect *effect, const flesh_point *point, double *internal, int *changed)
{
  const slider *s = effect->data;
  const double force = force_of(s, point), beyond = fabs(force) - s->yields;
  if (!(beyond > 1e-9 * s->yields)) return FLESH_OK;
  internal[0] += copysign(beyond, force) / s->stiffness;
  *changed = 1;
  return FLESH_OK;
}

static int restless_update(const flesh_effect *effect, const flesh_point *point, double *internal, int *changed)
{
  (void)effect, (void)point;
  internal[0] += 1e-3;
  *changed = 1;
  return FLESH_OK;
}

#define SLIDER(update_)                                                                                            \
  {.name = "slider", .residual = slider_residual, .jacobian = slider_jacobian, .potential = slider_potential,      \
   .energy = slider_energy, .internal = &(const flesh_effect_internal){.count = slider_count, .update = update_}}
static const flesh_effect_operations yielding = SLIDER(slider_update), restless = SLIDER(restless_update);

static const double anchor = 300; /* N/m, springs that hold both nodes at their rest positions */
enum { SLIDERS = 2 };

typedef struct drawn {
  flesh_mesh *mesh;
  flesh_system *system;
  double density, x[12], v[12], slip[SLIDERS];
  flesh_state state;
} drawn;

/* A tetrahedron of which two nodes are pulled and two are held; without a density it has no inertia. */
static void begin(slider s[SLIDERS], const flesh_effect_operations *operations, double density, drawn *d)
{
  static const double X[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  *d = (drawn){.density = density};
  CHECK_OK(flesh_mesh_create(4, X, 1, (int[]){0, 1, 2, 3}, NULL, &d->mesh));
  CHECK_OK(flesh_system_create(d->mesh, &d->system));
  const flesh_body body = {.mesh = d->mesh, .density = &d->density, .mass = FLESH_MASS_LUMPED};
  flesh_effect *effect = NULL;
  for (int k = 0; k < SLIDERS; k++) {
    flesh_keyframe rest = {0};
    rest.translation[0] = X[3 * k];
    s[k].node = k;
    s[k].X = X[3 * k];
    CHECK_OK(flesh_effect_create(operations, d->mesh, &s[k], &effect));
    CHECK_OK(flesh_system_add_effect(d->system, &effect));
    CHECK_OK(flesh_effect_spring(&body, rest.translation, anchor, &(flesh_motion){.count = 1, .keyframes = &rest}, -INFINITY,
                                 INFINITY, &effect));
    CHECK_OK(flesh_system_add_effect(d->system, &effect));
  }
  if (density > 0) CHECK_OK(flesh_effect_inertia(&body, &effect));
  if (density > 0) CHECK_OK(flesh_system_add_effect(d->system, &effect));
  CHECK_OK(flesh_system_add_pin(d->system, 2, (int[]){2, 3}, FLESH_AXES_ALL, -INFINITY, INFINITY));
  CHECK_OK(flesh_system_finalize(d->system));
  CHECK(flesh_system_internal_count(d->system) == SLIDERS);
  memcpy(d->x, X, sizeof X);
  d->state = (flesh_state){.x = d->x, .v = d->v, .internal = d->slip, .internal_count = SLIDERS};
}

static void end(drawn *d)
{
  flesh_system_destroy(&d->system);
  flesh_mesh_destroy(&d->mesh);
}

static flesh_integrator *integrator_of(const drawn *d, flesh_method method)
{
  flesh_solver_options options;
  flesh_integrator *integrator = NULL;
  flesh_solver_options_default(&options);
  options.newton_tolerance = 1e-12;
  CHECK_OK(flesh_integrator_create(d->system, method, &options, &integrator));
  return integrator;
}

/* Returns the force on a node by the time its slider has slipped by `slip` m, N. */
static double force_at(const slider *s, double drawn_by, double slip)
{
  const double series = s->stiffness * anchor / (s->stiffness + anchor);
  return fmax(fmin(series * (drawn_by - slip), s->yields), -s->yields);
}

/* Pulled out by 2 m and let back: an anchor never bears more than its slider's yield force, the slip is permanent, and
 * it dissipates that force times the slip, to first order in the steps. */
static void sliders_yield_and_keep_their_slip(void)
{
  double missing[2];
  for (int run = 0; run < 2; run++) {
    slider s[SLIDERS] = {{.stiffness = 700, .yields = 90}, {.stiffness = 400, .yields = 250}};
    drawn d;
    begin(s, &yielding, 0, &d);
    flesh_integrator *integrator = integrator_of(&d, FLESH_METHOD_STATIC);
    const int steps = run ? 160 : 80;
    double spent = 0;
    for (int k = 0; k < steps; k++) {
      CHECK_OK(flesh_integrator_step(integrator, &d.state, 2. / steps, NULL));
      for (int j = 0; j < SLIDERS; j++) {
        const double slipped = fmax(2 - s[j].yields / (s[j].stiffness * anchor / (s[j].stiffness + anchor)), 0);
        CHECK_NEAR(anchor * (d.x[3 * j] - s[j].X), force_at(&s[j], target(d.state.t), k >= steps / 2 ? slipped : 0),
                   1e-6 * s[j].yields);
      }
    }
    for (int j = 0; j < SLIDERS; j++) { /* out, and on the way back until the force reaches -yields */
      const double series = s[j].stiffness * anchor / (s[j].stiffness + anchor);
      const double out = fmax(2 - s[j].yields / series, 0), back = fmax(out - s[j].yields / series, 0);
      CHECK_NEAR(d.slip[j], out - back, 1e-6);
      spent += s[j].yields * (out + back);
    }
    missing[run] = flesh_integrator_energy_balance(integrator)->released - spent;
    printf("# %d steps: slips %.9g, %.9g m; released %.6g J more than %.6g J\n", steps, d.slip[0], d.slip[1], missing[run],
           spent);
    flesh_integrator_destroy(&integrator);
    end(&d);
  }
  CHECK(missing[1] > 0);
  CHECK_NEAR(missing[0] / missing[1], 2, 0.1);
}

/* Under the midpoint rule all potentials are quadratic within a step, so that energy, released energy and the work of
 * the moving position balance to rounding. */
static void energy_and_work_balance(void)
{
  slider s[SLIDERS] = {{.stiffness = 700, .yields = 90}, {.stiffness = 400, .yields = 250}};
  drawn d;
  begin(s, &yielding, 6, &d);
  flesh_integrator *integrator = integrator_of(&d, FLESH_METHOD_MIDPOINT);
  const flesh_energy_balance *balance = flesh_integrator_energy_balance(integrator);
  double worst = 0, most = 0;
  for (int k = 0; k < 200; k++) {
    double energies[5], sum = 0;
    CHECK_OK(flesh_integrator_step(integrator, &d.state, 0.01, NULL));
    flesh_point point = flesh_point_at(d.state.t, d.x, d.v, d.v);
    point.internal = d.slip;
    CHECK_OK(flesh_system_energies(d.system, &point, energies));
    for (int e = 0; e < 5; e++) sum += energies[e];
    worst = fmax(worst, fabs(sum + balance->released - balance->supplied));
    most = fmax(most, sum);
  }
  printf("# %.6g J put in, %.6g J released, at most %.6g J at a time; off by %.2g J\n", balance->supplied,
         balance->released, most, worst);
  CHECK(balance->released > most);
  CHECK_BELOW(balance->gain, 1e-10);
  CHECK_BELOW(worst, 1e-10 * most);
  flesh_integrator_destroy(&integrator);
  end(&d);
}

/* If a variable changes in every equilibrium, statics give up, and the state is unchanged. */
static void what_never_settles_is_said(void)
{
  slider s[SLIDERS] = {{.stiffness = 700, .yields = 90}, {.stiffness = 400, .yields = 250}};
  drawn d;
  begin(s, &restless, 0, &d);
  flesh_integrator *integrator = integrator_of(&d, FLESH_METHOD_STATIC);
  CHECK(flesh_integrator_step(integrator, &d.state, 0.1, NULL) == FLESH_ERR_SOLVE);
  CHECK_TEXT(flesh_error_text(), "something still broke in the last of 1000 equilibria at t = 0.1 s");
  CHECK(d.slip[0] == 0 && d.slip[1] == 0 && d.x[0] == 0 && d.state.t == 0);
  flesh_integrator_destroy(&integrator);
  end(&d);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(sliders_yield_and_keep_their_slip), TEST(energy_and_work_balance),
                   TEST(what_never_settles_is_said));
}
