// TEST full memory seconds=5
/* test_equilibrium.c: gradients of equilibria, by tangents and adjoints, agree with fourth-order differences of
 * complete solves: for follower loads, contact, muscles, welds, prescribed motions and incompressible bodies. */
#include "body.h"
#include "gradients.h"

#define BAR(poisson, element) \
  "body: {name: bar, mesh: ../meshes/bar_8x2x2.mesh, density: 1000, element: " element ",\n" \
  "  material: {energy: S, constants: matched, young: 1e5, poisson: " poisson "}}\n"
#define CLAMP "  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}\n"
#define SOLVER "time: {method: static, step: 1, end: 1}\nsolver: {newton_tolerance: 1e-13, linear_tolerance: 1e-4}\n"

typedef struct equilibrium_case {
  const char *name, *text;
  int x;                /* the reaction is that of nodes constrained at this x [m] */
  gradient_key keys[6]; /* terminated by one of 0 */
} equilibrium_case;

static const equilibrium_case cases[] = {
    {"follower pressure",
     BAR("0.45", "tet4") "effects:\n" CLAMP "  - gravity: {}\n  - pressure: {box: [[-1, -1, 0.999], [5, 2, 2]], pressure: 400}\n"
     "  - traction: {box: [[3.999, -1, -1], [5, 2, 2]], traction: [100, 200, 0]}\n" SOLVER, 0,
     {{"body.material.young", 1e5, 2e2, 1e2}, {"body.material.poisson", 0.45, 2e-4, 1e-4}, {"body.density", 1000, 2, 1},
      {"effects.pressure.pressure", 400, 1, 1}, {"effects.traction.traction[1]", 200, 1, 1}}},
    /* The lag diverges: repeated solves with K alone do not converge. */
    {"follower pressure on an end",
     BAR("0.45", "tet4") "effects:\n" CLAMP "  - pressure: {box: [[3.9, -1, 0.5], [5, 2, 2]], pressure: 12000}\n" SOLVER, 0,
     {{"body.material.young", 1e5, 1e2, 1e2}, {"effects.pressure.pressure", 12000, 10, 1e3}}},
    {"nearly incompressible",
     BAR("0.4999", "tet10-mean") "effects:\n" CLAMP "  - gravity: {acceleration: [0, 0, -1]}\n"
     "  - pressure: {box: [[-1, -1, 0.999], [5, 2, 2]], pressure: 40}\n" SOLVER, 0,
     {{"body.material.young", 1e5, 2e2, 1e2}, {"body.material.poisson", 0.4999, 2e-6, 1e-6},
      {"effects.gravity.acceleration[2]", -1, 2e-3, 1e-2}}},
    {"contact",
     BAR("0.4", "tet4") "effects:\n" CLAMP "  - gravity: {acceleration: [0, 0, -1]}\n"
     "  - contact: {sphere: {centre: [3, 0.5, -0.6], radius: 0.5}, thickness: 0.05, stiffness: 1e6, friction: 0.3}\n" SOLVER, 0,
     {{"body.material.young", 1e5, 1e2, 1e2}, {"body.density", 1000, 1, 1},
      {"effects.contact.thickness", 0.05, 2e-5, 1e-5}, {"effects.contact.sphere.radius", 0.5, 2e-5, 1e-5}}},
    {"prescribed motion",
     BAR("0.3", "tet4") "effects:\n" CLAMP
     "  - prescribed_motion: {box: [[3.999, -1, -1], [5, 2, 2]], motion: [{time: 0, translation: [0.2, 0, 0.5]}]}\n" SOLVER, 4,
     {{"body.material.young", 1e5, 1e2, 1e2},
      {"effects.prescribed_motion.motion[0].translation[2]", 0.5, 1e-3, 1e-4}}},
    {"incompressible",
     BAR("0.5", "tet10-mean") "effects:\n" CLAMP "  - gravity: {acceleration: [0, 0, -1]}\n"
     "  - pressure: {box: [[-1, -1, 0.999], [5, 2, 2]], pressure: 40}\n"
     "  - prescribed_motion: {box: [[3.999, -1, -1], [5, 2, 2]], motion: [{time: 0, translation: [0.2, 0, 0.5]}]}\n"
     "time: {method: static, step: 1, end: 1}\nsolver: {newton_tolerance: 1e-11, linear_tolerance: 1e-4}\n", 4,
     {{"body.material.young", 1e5, 2e3, 1e2}, {"effects.gravity.acceleration[2]", -1, 2e-2, 1e-2},
      {"effects.pressure.pressure", 40, 1, 1}, {"effects.prescribed_motion.motion[0].translation[2]", 0.5, 3e-3, 1e-4}}},
    {"muscle and weld",
     BAR("0.45", "tet4") "bodies:\n  - {name: upper, mesh: ../meshes/bar_8x2x2.mesh, density: 500, translation: [0, 0, 1],\n"
     "     material: {energy: S, constants: matched, young: 2e5, poisson: 0.4}}\n"
     "effects:\n" CLAMP "  - gravity: {}\n  - weld: {bodies: [bar, upper], stiffness: 1e7}\n"
     "  - muscle: {fibres: {direction: [1, 0, 0]}, peak_stress: 2e4, activation: [{time: 0, value: 0.5}]}\n" SOLVER, 0,
     {{"body.material.young", 1e5, 1e2, 1e2}, {"effects.muscle.peak_stress", 2e4, 40, 20},
      {"effects.muscle.activation[0].value", 0.5, 1e-3, 1e-3}, {"effects.weld.stiffness", 1e7, 2e4, 1e4},
      {"bodies[0].density", 500, 1, 1}}},
};

/* An equilibrium of a scene. */
typedef struct solved {
  flesh_scene *scene;
  flesh_integrator *integrator;
  int n;
  flesh_state state;
} solved;

static solved solve(const char *text, const char *key, double value)
{
  solved s = {.scene = gradient_scene(text, key, value)};
  const flesh_system *system = flesh_scene_system(s.scene);
  s.n = flesh_system_unknowns(system);
  s.state.x = calloc(2 * (size_t)s.n, sizeof(double));
  s.state.v = s.state.x + s.n;
  s.state.multiplier_count = flesh_system_multiplier_count(system);
  s.state.internal_count = flesh_system_internal_count(system);
  if (s.state.multiplier_count) s.state.multipliers = calloc((size_t)s.state.multiplier_count, sizeof(double));
  if (s.state.internal_count) s.state.internal = calloc((size_t)s.state.internal_count, sizeof(double));
  flesh_scene_start(s.scene, &s.state);
  CHECK_OK(flesh_integrator_create(system, FLESH_METHOD_STATIC, flesh_scene_solver(s.scene), &s.integrator));
  CHECK_OK(flesh_integrator_step(s.integrator, &s.state, 1, NULL));
  return s;
}

static void drop(solved *s)
{
  flesh_integrator_destroy(&s->integrator);
  flesh_scene_destroy(&s->scene);
  free(s->state.x);
  free(s->state.multipliers);
  free(s->state.internal);
}

/* Sets the weights of nodes at this x at rest, in one component. */
static void weigh(const flesh_mesh *mesh, double x, int component, double *weights)
{
  const double *X = flesh_mesh_positions(mesh);
  for (int i = 0; i < flesh_mesh_node_count(mesh); i++)
    if (fabs(X[3 * i] - x) < 1e-6) weights[3 * i + component] = 1;
}

/* Returns the reaction [N] along y on nodes constrained at x. */
static double reaction(const solved *s, double x, int component)
{
  double *r = calloc(2 * (size_t)s->n, sizeof *r), sum = 0, *e = r + s->n;
  flesh_point point = flesh_point_at(s->state.t, s->state.x, s->state.v, s->state.v);
  point.multipliers = s->state.multipliers;
  point.internal = s->state.internal;
  CHECK_OK(flesh_system_residual(flesh_scene_system(s->scene), &point, r));
  weigh(flesh_scene_mesh(s->scene), x, component, e);
  for (int d = 0; d < s->n; d++) sum += e[d] * r[d];
  free(r);
  return sum;
}

/* A quantity that is a nonlinear function of the state: a node's squared distance from the origin. */
static double place(const solved *s, int node)
{
  const double *x = s->state.x + 3 * node;
  return x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
}

static void try_case(const equilibrium_case *c)
{
  solved s = solve(c->text, NULL, 0);
  const flesh_mesh *mesh = flesh_scene_mesh(s.scene);
  const int node = gradient_node(mesh, 2, 1, 1);
  double *by_x = calloc(3 * (size_t)s.n, sizeof *by_x), *held = by_x + s.n, *dx = held + s.n;
  flesh_sensitivity *sensitivity = NULL;
  for (int k = 0; k < 3; k++) by_x[3 * node + k] = 2 * s.state.x[3 * node + k];
  weigh(mesh, c->x, 2, held);
  CHECK_OK(flesh_sensitivity_create(flesh_scene_system(s.scene), flesh_scene_solver(s.scene), 1e-11, &sensitivity));
  CHECK_OK(flesh_sensitivity_set(sensitivity, &s.state, NULL));
  for (const gradient_key *key = c->keys; key->key; key++) {
    double by_solves[2] = {0}, by_adjoint[2], by_tangent = 0;
    gradient_parameter p = gradient_parameter_of(c->text, *key);
    const int compared = TEST_FEWER(1, 0);
    for (int k = 0; k < 4 && compared; k++) {
      solved other = solve(c->text, key->key, key->value + gradient_at[k] * key->step);
      by_solves[0] += gradient_weights[k] * place(&other, node) / key->step;
      by_solves[1] += gradient_weights[k] * reaction(&other, c->x, 2) / key->step;
      drop(&other);
    }
    CHECK_OK(flesh_sensitivity_gradient(sensitivity, &(flesh_quantity){.by_x = by_x}, 1, &p.parameter, &by_adjoint[0]));
    CHECK_OK(flesh_sensitivity_gradient(sensitivity, &(flesh_quantity){.of_residual = held}, 1, &p.parameter, &by_adjoint[1]));
    CHECK(flesh_sensitivity_gradient(sensitivity, &(flesh_quantity){0}, -1, &p.parameter, by_adjoint) == FLESH_ERR_ARGUMENT);
    CHECK_TEXT(flesh_error_text(), "the number of parameters is -1");
    CHECK_OK(flesh_sensitivity_tangent(sensitivity, &p.parameter, dx));
    for (int d = 0; d < s.n; d++) by_tangent += by_x[d] * dx[d];
    const double Q[] = {place(&s, node), reaction(&s, c->x, 2)};
    for (int k = 0; k < 2 && compared; k++) { /* differences have the round-off of solves */
      const double off = fabs(by_adjoint[k] - by_solves[k]), noise = 2e-12 * fabs(Q[k]) / key->step;
      printf("# %s, %s: %s %.9g, off by %.1e, of which %.1e may be round-off\n", c->name, key->key,
             k ? "reaction" : "place", by_adjoint[k], off, noise);
      CHECK_BELOW(off, 1e-6 * fabs(by_solves[k]) + noise);
    }
    CHECK_NEAR(by_tangent, by_adjoint[0], 1e-6 * fabs(by_adjoint[0]) + 1e-12 * fabs(Q[0] / key->value));
    gradient_parameter_clear(&p);
  }
  flesh_sensitivity_destroy(&sensitivity);
  free(by_x);
  drop(&s);
}

static void gradients_are_those_of_solves(void)
{
  for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) try_case(&cases[k]);
}

static void what_has_no_solves_is_refused(void)
{
  test_body b;
  flesh_sensitivity *sensitivity = NULL;
  flesh_solver_options options = test_options(1e-8);
  CHECK_OK(test_body_create(test_box(1, 1, 1, 1, 1, 1), test_material(FLESH_ENERGY_S, 0.3), 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK(flesh_sensitivity_create(b.system, &options, 1e-11, &sensitivity) == FLESH_ERR_ARGUMENT && !sensitivity);
  CHECK(strstr(flesh_error_text(), "finalize"));
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(gradients_are_those_of_solves), TEST(what_has_no_solves_is_refused));
}
