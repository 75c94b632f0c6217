// TEST quick seconds=120
/* test_contact_adaptive.c: an adaptive contact stiffness: bodies rest at about half of the thickness, with the same
 * forces as at any stiffness; collisions conserve momenta and gain no energy; the stiffness is part of the state. */
#include "touching.h"

#include "effect/effect.h"
#include "geometry/barrier.h"

/* A cube of 0.1 m above another whose base is held. */
static const char cubes[] =
    "body: {name: low, mesh: ../meshes/cube_3x3x3.mesh, density: 1000, " TOUCHING_MATERIAL "}\n"
    "bodies:\n"
    "  - {name: up, mesh: ../meshes/cube_3x3x3.mesh, translation: [0.013, 0.007, 0.1012], density: 1000, " TOUCHING_MATERIAL
    "}\n"
    "effects:\n"
    "  - inertia: {}\n"
    "  - gravity: {}\n"
    "  - viscosity: {shear: 100, bulk: 100}\n"
    "  - pin: {body: low, box: [[-1, -1, -0.001], [1, 1, 0.001]]}\n"
    "  - contact: {between: all, friction: 0.3, thickness: 0.002}\n"
    "time: {method: backward-euler, step: 1/100, end: 1}\n"
    "solver: {newton_tolerance: 1e-7}\n";

/* A state with the stiffness's variable; `internal` must live as long. */
static void begin(const char *text, const char *const *set, double *internal, touching *m)
{
  CHECK_OK(touching_begin(text, set, 1000, m));
  *internal = 0;
  m->state.internal = internal;
  m->state.internal_count = flesh_system_internal_count(flesh_scene_system(m->scene));
  CHECK(m->state.internal_count == 1);
}

typedef struct rest {
  double gap, force, height, newton, stiffness; /* over the thickness; N; m, of the upper one's nodes; Newton
                                                 * iterations a step; Pa, over the initial stiffness */
} rest;

/* The figures that contact reports, and the position of the upper cube. */
static rest look(const touching *m, const double *internal)
{
  const flesh_system *system = flesh_scene_system(m->scene);
  const flesh_effect *contact = flesh_system_effect(system, 0);
  for (int k = 1; strcmp(contact->operations->name, "contact"); k++) contact = flesh_system_effect(system, k);
  flesh_point point = flesh_point_at(m->state.t, m->state.x, m->state.v, m->state.v);
  point.internal = internal;
  double values[3];
  rest r = {.newton = (double)m->newton / m->steps, .stiffness = internal ? exp(*internal) : 1};
  flesh_effect_figures_of(contact)->report(contact, &point, values);
  r.gap = values[0] / 0.002;
  r.force = values[2];
  for (int k = m->n / 6; k < m->n / 3; k++) r.height += m->state.x[3 * k + 2] / (m->n / 6);
  CHECK(m->crossings == 0);
  return r;
}

static rest come_to_rest(const char *adaptive)
{
  const char *const set[] = {adaptive, NULL};
  touching m;
  double internal = 0;
  if (strstr(adaptive, "true")) begin(cubes, set, &internal, &m);
  else CHECK_OK(touching_begin(cubes, set, 1000, &m));
  for (int k = 0; k < 60; k++) CHECK_OK(touching_step(&m));
  const rest r = look(&m, m.state.internal);
  printf("# %s: gap %.3f, force %.5g N, height %.6f m, %.2f Newton a step, stiffness times %.3g\n", adaptive, r.gap, r.force,
         r.height, r.newton, r.stiffness);
  touching_end(&m);
  return r;
}

/* The weight, 9.81 N, is borne at any stiffness. The least gap is that of the most pressed node; the mean pressure is
 * within BAND of that at half of the thickness. */
static void what_rests_rests_within_the_barrier(void)
{
  const rest fixed = come_to_rest("effects.contact.adaptive=false"), adaptive = come_to_rest("effects.contact.adaptive=true");
  CHECK(fixed.gap > 0.8 && fixed.gap < 1);
  CHECK(adaptive.gap > 0.1 && adaptive.gap < 0.65);
  CHECK(adaptive.stiffness < 0.1);
  CHECK_NEAR(adaptive.force, fixed.force, 0.02 * fixed.force);
  CHECK_NEAR(adaptive.height, fixed.height, 0.002);
}

/* Statics repeat the equilibrium until the stiffness is constant: the same gaps and forces, under gravity alone. */
static void statics_settle(void)
{
  static const char press[] =
      "body: {name: low, mesh: ../meshes/cube_3x3x3.mesh, density: 1000, " TOUCHING_MATERIAL "}\n"
      "bodies:\n"
      "  - {name: up, mesh: ../meshes/cube_3x3x3.mesh, translation: [0.013, 0.007, 0.1012], density: 1000, " TOUCHING_MATERIAL
      "}\n"
      "effects:\n"
      "  - pin: {body: low, box: [[-1, -1, -0.001], [1, 1, 0.001]]}\n"
      "  - prescribed_motion: {body: up, box: [[-1, -1, 0.2], [1, 1, 0.3]], motion: [{time: 0}, {time: 1, translation: [0, "
      "0, -0.005]}]}\n"
      "  - contact: {between: all, adaptive: true, thickness: 0.002, stiffness: 1e7}\n"
      "time: {method: static, step: 1, end: 1}\n";
  touching m;
  double internal;
  begin(press, NULL, &internal, &m);
  CHECK_OK(touching_step(&m));
  const rest r = look(&m, &internal);
  printf("# gap %.3f, force %.5g N, stiffness times %.3g\n", r.gap, r.force, r.stiffness);
  CHECK(r.gap > 0.1 && r.gap < 0.65 && r.stiffness < 0.1 && r.force > 10);
  touching_end(&m);
}

/* Momenta are conserved up to the residuals of the solves, nothing crosses, and the energy only falls, except for the
 * counted energy of a stiffening barrier. */
static void balls_collide(const char *method, const char *step, int steps)
{
  const char *const set[] = {"effects.contact.adaptive=true", method, "time.tolerance=1e-3", step, NULL};
  touching m;
  double internal, p[2][3], L[3], change = 0;
  begin(TOUCHING_BALLS("0.03, 0"), set, &internal, &m);
  touching_momenta(&m, p[0], L);
  for (int k = 0; k < steps; k++) CHECK_OK(touching_step(&m));
  touching_momenta(&m, p[1], L);
  for (int c = 0; c < 3; c++) change = fmax(change, fabs(p[1][c] - p[0][c]));
  const flesh_energy_balance *balance = flesh_integrator_energy_balance(m.integrator);
  printf("# momentum off by %.1e of %.1e N s, gain %.2g, released %.2g J, stiffness times %.3g\n", change, m.slack,
         balance->gain, balance->released, exp(internal));
  CHECK(internal != 0 && m.crossings == 0);
  CHECK(change <= fmin(m.slack, 1e-3 * hypot(p[0][0], hypot(p[0][1], p[0][2]))) + 1e-12);
  CHECK(balance->gain < 1e-3);
  CHECK(fabs(internal) < steps * log(4) * (1 + 1e-9));
  touching_end(&m);
}

static void balls_collide_in_fixed_steps(void) { balls_collide("time.method=backward-euler", "time.step=1/1000", 40); }

/* Adaptive steps are much shorter than those between which the stiffness changes, by a factor of four at most. */
static void balls_collide_in_steps_of_their_error(void) { balls_collide("time.method=adaptive", "time.step=1/200", 8); }

/* Fixed steps of order 2 gain at most a hundredth of the motion's energy: a barrier that would add more stiffens
 * later. */
static void soft_cubes_gain_little_in_fixed_steps(void)
{
  static const char *const methods[] = {"time.method=newmark", "time.method=midpoint"};
  static const char cubes[] =
      "body: {name: low, mesh: ../meshes/cube_3x3x3.mesh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.4}}\n"
      "bodies:\n"
      "  - {name: up, mesh: ../meshes/cube_3x3x3.mesh, translation: [0.013, 0.007, 0.103], density: 1000, velocity: [0, 0, -0.3],"
      " material: {energy: S, young: 2e4, poisson: 0.45}}\n"
      "effects:\n"
      "  - inertia: {}\n"
      "  - contact: {between: all, adaptive: true, thickness: 0.0005}\n"
      "time: {step: 1/1000, end: 1}\n";
  for (int k = 0; k < 2; k++) {
    touching m;
    double internal;
    begin(cubes, (const char *const[]){methods[k], NULL}, &internal, &m);
    for (int step = 0; step < 60; step++) CHECK_OK(touching_step(&m));
    const double gain = flesh_integrator_energy_balance(m.integrator)->gain;
    printf("# %s: gain %.2g, stiffness times %.3g\n", methods[k], gain, exp(internal));
    CHECK_BELOW(gain, 0.011);
    CHECK(internal != 0);
    touching_end(&m);
  }
}

/* A run that is interrupted and resumed from its history and its state has the same bits. */
static void cut(const char *text, const char *method, int changes)
{
  const char *const set[] = {"effects.contact.adaptive=true", method, "time.tolerance=1e-2", NULL};
  touching whole, cut;
  double internal[2];
  begin(text, set, &internal[0], &whole);
  begin(text, set, &internal[1], &cut);
  for (int k = 0; k < 12; k++) {
    size_t size;
    CHECK_OK(touching_step(&whole));
    CHECK_OK(touching_step(&cut));
    CHECK_OK(flesh_integrator_save(cut.integrator, 0, NULL, &size));
    void *saved = malloc(size);
    CHECK_OK(flesh_integrator_save(cut.integrator, size, saved, &size));
    flesh_integrator_destroy(&cut.integrator);
    CHECK_OK(touching_integrator(&cut));
    CHECK_OK(flesh_integrator_load(cut.integrator, saved, size));
    free(saved);
  }
  CHECK((internal[0] != 0) == changes && internal[0] == internal[1] && whole.newton == cut.newton);
  CHECK(!memcmp(whole.state.x, cut.state.x, (size_t)whole.n * sizeof(double)));
  touching_end(&whole);
  touching_end(&cut);
}

/* The distance up to which surfaces are known to be apart, which an interruption forgets, does not affect whether they
 * touch. */
static void cuts_change_no_bit(void)
{
  cut(cubes, "time.method=backward-euler", 1);
  cut("body: {mesh: ../meshes/bar_8x2x2.mesh, density: 1000, material: {energy: S, young: 4e6, poisson: 0.3}}\n"
      "effects: [inertia: {}, contact: {between: self}, pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}]\n"
      "start: {velocity: [2, -2, -1]}\n"
      "time: {method: bdf2, step: 1/60, end: 1}\n", "time.adaptive=true", 0);
}

static void what_cannot_be_is_refused(void)
{
  const char *const set[] = {"effects.contact.adaptive=true", NULL};
  touching m;
  CHECK(touching_begin("body: {mesh: ../meshes/cube_3x3x3.mesh, density: 1000, " TOUCHING_MATERIAL "}\n"
                       "effects:\n  - inertia: {}\n  - contact: {plane: {point: [0, 0, -1]}}\n"
                       "time: {method: backward-euler, step: 1, end: 1}\n", set, 1000, &m) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "adaptive applies to contact between bodies");
  touching_end(&m);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(what_rests_rests_within_the_barrier), TEST(statics_settle), TEST(balls_collide_in_fixed_steps),
                   TEST(balls_collide_in_steps_of_their_error), TEST(soft_cubes_gain_little_in_fixed_steps),
                   TEST(cuts_change_no_bit), TEST(what_cannot_be_is_refused));
}
