// TEST quick seconds=120
// TEST+ args: balls_collide threads_and_cuts_change_no_bit what_begins_crossed_is_refused what_cannot_be_is_refused
// TEST+ what_begins_too_near_is_refused only_what_is_named_touches what_is_not_named_costs_nothing
// TEST+ a_block_slides_from_the_angle_of_friction_on curved_balls_collide balls_collide_with_a_direct_solver
// TEST name=test_touching_table full seconds=600 builds=plain,memory args: restitution_converges
/* test_touching.c: touching bodies: two balls that collide conserve their momenta and lose no energy to the contact,
 * whatever the method; surfaces never intersect; an interrupted run continues with the same bits, and threads do not
 * change them; scenes in which bodies intersect at the start, and invalid ones, are refused. */
#include "system/proximity.h"
#include "touching.h"

/* x cross y of the nodes, y times the mass, summed. */
static void torque(const touching *m, const double *x, const double *y, double sum[3])
{
  memset(sum, 0, 3 * sizeof *sum);
  for (int i = 0; i < m->n / 3; i++)
    for (int c = 0; c < 3; c++) {
      const int j = (c + 1) % 3, k = (c + 2) % 3;
      sum[c] += m->mass[i] * (x[3 * i + j] * y[3 * i + k] - x[3 * i + k] * y[3 * i + j]);
    }
}

typedef struct collision {
  double restitution, linear, angular, rise, lost; /* momenta: change over the residuals that the solves may leave;
                                                    * energies, J */
  double gained; /* energy, over that of the motion */
  int steps, together, refused; /* 1: ended with FLESH_ERR_ENERGY */
} collision;

/* Returns the mean velocity along x of the second half of the nodes (the right ball) minus that of the first. */
static double parting(const touching *m)
{
  double mean[2] = {0};
  for (int i = 0; i < m->n / 3; i++) mean[i >= m->n / 6] += m->mass[i] * m->state.v[3 * i];
  double half = 0;
  for (int i = 0; i < m->n / 6; i++) half += m->mass[i];
  return (mean[1] - mean[0]) / half;
}

static double kinetic(const touching *m)
{
  double sum = 0;
  for (int d = 0; d < m->n; d++) sum += 0.5 * m->mass[d / 3] * m->state.v[d] * m->state.v[d];
  return sum;
}

/* Returns the torque about the origin of the forces that act in a step, at the positions where the method evaluates
 * them. Backward Euler: at the end of the step, v - v0 is h times a there; midpoint: in its middle. */
static double step_torque(const touching *m, flesh_method method, const double *x0, const double *v0)
{
  double *x = malloc((size_t)m->n * sizeof *x), *dv = malloc((size_t)m->n * sizeof *dv), sum[3];
  for (int d = 0; d < m->n; d++) {
    x[d] = method == FLESH_METHOD_MIDPOINT ? 0.5 * (x0[d] + m->state.x[d]) : m->state.x[d];
    dv[d] = m->state.v[d] - v0[d];
  }
  torque(m, x, dv, sum);
  free(x);
  free(dv);
  return sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
}

static int touches(const touching *m)
{
  double contact;
  touching_energy(m, &contact);
  return contact > 0;
}

static collision collide(const char *scene, const char *method, const char *step, double end)
{
  char set_method[64], set_step[64];
  snprintf(set_method, sizeof set_method, "time.method=%s", method);
  snprintf(set_step, sizeof set_step, "time.step=%s", step);
  touching m;
  collision c = {0};
  double p0[3], L0[3], p[3], L[3], allowed = 0;
  int wholes = 0;
  CHECK_OK(touching_begin(scene, (const char *[]){set_method, set_step, NULL}, 1000, &m));
  touching_momenta(&m, p0, L0);
  const double start = touching_energy(&m, NULL), came = parting(&m), motion = kinetic(&m);
  double *x0 = malloc((size_t)m.n * sizeof *x0), *v0 = malloc((size_t)m.n * sizeof *v0), before = start,
         least = start;
  const flesh_method number = flesh_scene_times(m.scene)->method;
  while (m.state.t < end - m.h / 2) {
    memcpy(x0, m.state.x, (size_t)m.n * sizeof *x0);
    memcpy(v0, m.state.v, (size_t)m.n * sizeof *v0);
    const int status = touching_step(&m);
    c.refused = status == FLESH_ERR_ENERGY;
    if (c.refused) break;
    CHECK_OK(status);
    const double energy = touching_energy(&m, NULL),
                 left = m.h * sqrt(m.n / 3.) * m.last.residual_target * m.last.solves;
    touching_momenta(&m, p, L);
    for (int k = 0; k < 3; k++) c.linear = fmax(c.linear, fabs(p[k] - p0[k]) / (m.slack + 1e-13 * motion));
    /* The formula is that of a step that was taken as a whole, by its own method. */
    if (number == FLESH_METHOD_BACKWARD_EULER ||
        (number == FLESH_METHOD_MIDPOINT && m.last.steps == 1 && !m.last.impact_steps && !m.last.damped_steps)) {
      wholes++;
      allowed = 0.3 * left + 1e-13 * motion;
      c.angular = fmax(c.angular, step_torque(&m, number, x0, v0) / allowed);
    }
    c.rise = fmax(c.rise, energy - before);
    c.gained = fmax(c.gained, (energy - least) / motion);
    least = fmin(least, energy);
    before = energy;
    c.together += touches(&m);
  }
  c.restitution = -parting(&m) / came;
  c.lost = start - before;
  c.steps = m.steps;
  printf("# %s, %s s: restitution %.4f, energy lost %.4f of that of the motion, rise in a step %.2g, in all %.2g; "
         "%d of %d steps touch; "
         "changes over what solves leave: momentum %.3f, torque %.3f; %.2f Newton iterations a step, "
         "%d impact steps%s\n",
         method, step, c.restitution, c.lost / motion, c.rise / motion, c.gained, c.together, m.steps, c.linear, c.angular,
         (double)m.newton / m.steps, m.impact_steps, c.refused ? "; ended as energy appeared" : "");
  CHECK(m.crossings == 0);
  CHECK(c.together > 3 && (c.refused || !touches(&m)));
  CHECK_BELOW(c.linear, 1);
  CHECK_BELOW(c.angular, 1);
  CHECK((number != FLESH_METHOD_BACKWARD_EULER && number != FLESH_METHOD_MIDPOINT) || 2 * wholes > m.steps);
  free(x0);
  free(v0);
  touching_end(&m);
  return c;
}

static const char *const head_on = TOUCHING_BALLS("0, 0"), *const off_centre = TOUCHING_BALLS("0.03, 0.02");

/* Fast methods in the quick test; the table over step sizes belongs to the full one. */
static void balls_collide(void)
{
  const char *const scenes[] = {head_on, off_centre};
  for (int k = 0; k < 2; k++) {
    const collision euler = collide(scenes[k], "backward-euler", "1/500", 0.05);
    CHECK_BELOW(euler.rise, 1e-9 * euler.lost);
    CHECK(euler.restitution > 0.2 && euler.restitution < 0.9);
    const collision midpoint = collide(scenes[k], "midpoint", "1/1000", 0.05);
    CHECK(midpoint.restitution > euler.restitution);
  }
}

/* Restitution converges to one limit; energy that the balls keep as vibration is lost to the bounce, not to the
 * contact. Backward Euler approaches the limit. If one step meets the barrier and the next leaves it, methods of order
 * 2 with little damping would gain energy, the trapezoidal rule up to half of the motion's; their steps are cut, and
 * may gain a hundredth of it in total. */
static void restitution_converges(void)
{
  const char *const methods[] = {"backward-euler", "bdf2", "hht", "midpoint", "newmark", "generalized-alpha"},
             *const steps[] = {"1/500", "1/1000", "1/2000", "1/4000"};
  for (int aside = 0; aside < 2; aside++) {
    collision c[6][4];
    for (int k = 0; k < 6; k++)
      for (int s = 0; s < 4; s++) c[k][s] = collide(aside ? off_centre : head_on, methods[k], steps[s], 0.05);
    for (int s = 0; s < 4; s++) {
      CHECK_BELOW(c[0][s].rise, 1e-9 * c[0][s].lost);
      for (int k = 0; k < 6; k++) CHECK(!c[k][s].refused);
      for (int k = 0; k < 6; k++) CHECK_BELOW(c[k][s].gained, 0.011);
      if (s) CHECK(c[0][s].restitution > c[0][s - 1].restitution);
    }
    CHECK_BELOW(c[0][3].restitution, c[1][3].restitution);
    CHECK_NEAR(c[1][2].restitution, c[1][3].restitution, 0.01);
    /* Backward Euler replaces steps of midpoint and generalized-alpha whose ends an obstacle blocks. */
    for (int k = 2; k < 6; k++)
      for (int s = k % 2; s < 4; s++)
        CHECK_NEAR(c[k][s].restitution, c[1][3].restitution, k % 2 ? 0.02 : 0.01);
  }
}

static void same_bits(const touching *a, const touching *b)
{
  CHECK(a->n == b->n && !memcmp(a->state.x, b->state.x, (size_t)a->n * sizeof(double)));
  CHECK(!memcmp(a->state.v, b->state.v, (size_t)a->n * sizeof(double)));
}

/* The pattern has grown by then, and continues to grow. Friction's lag is part of the saved data. */
static void threads_and_cuts_change_no_bit(void)
{
  const char *const methods[] = {"time.method=backward-euler", "time.method=bdf2", "time.method=midpoint"};
  for (int k = 0; k < TEST_FEWER(3, 1); k++) {
    const char *set[] = {methods[k], "effects.contact.friction=0.4", "solver.threads=1", "time.step=1/500",
                         "solver.newton_tolerance=1e-5", NULL};
    touching whole, other;
    CHECK_OK(touching_begin(off_centre, set, 1000, &whole));
    set[2] = "solver.threads=3";
    CHECK_OK(touching_begin(off_centre, set, 1000, &other));
    for (int s = 0; s < 12; s++) {
      CHECK_OK(touching_step(&whole));
      CHECK_OK(touching_step(&other));
      size_t size;
      CHECK_OK(flesh_integrator_save(other.integrator, 0, NULL, &size));
      void *saved = malloc(size);
      CHECK_OK(flesh_integrator_save(other.integrator, size, saved, &size));
      flesh_integrator_destroy(&other.integrator);
      CHECK_OK(touching_integrator(&other));
      CHECK_OK(flesh_integrator_load(other.integrator, saved, size));
      free(saved);
    }
    CHECK(touches(&whole));
    CHECK(whole.newton == other.newton);
    same_bits(&whole, &other);
    touching_end(&whole);
    touching_end(&other);
  }
}

/* A body inside a body is detected where their surfaces cross; the message says which bodies, which nodes and where. */
static void what_begins_crossed_is_refused(void)
{
  touching m;
  const char *const set[] = {"bodies[0].translation=[0.09, 0, 0]", NULL};
  CHECK_OK(touching_begin(head_on, set, 1000, &m));
  CHECK(flesh_system_check(flesh_scene_system(m.scene), 0, m.state.x) == FLESH_ERR_ARGUMENT);
  CHECK(crossings_count(&m.surface, m.state.x) > 0);
  CHECK_TEXT(flesh_error_text(), "intersect: the edge of the nodes ");
  CHECK_TEXT(flesh_error_text(), " of left");
  CHECK_TEXT(flesh_error_text(), " of right");
  CHECK_TEXT(flesh_error_text(), "must start apart");
  touching_end(&m);
}

/* Between intersecting and separate positions of two balls, they touch up to rounding: the barrier would throw them
 * apart. */
static void what_begins_too_near_is_refused(void)
{
  touching m;
  CHECK_OK(touching_begin(head_on, NULL, 1000, &m));
  const flesh_system *system = flesh_scene_system(m.scene);
  const int n = flesh_system_unknowns(system);
  double apart = 0, crossed = 0.05, at = 0;
  int refused_for_gap = 0;
  CHECK_OK(flesh_system_check(system, 0, m.state.x));
  for (int k = 0; k < 60 && !refused_for_gap; k++) {
    const double middle = (apart + crossed) / 2;
    for (int d = n / 2; d < n; d++) m.state.x[d] -= d % 3 ? 0 : middle - at;
    at = middle;
    if (flesh_system_check(system, 0, m.state.x) == FLESH_OK) apart = at;
    else if (strstr(flesh_error_text(), "intersect")) crossed = at;
    else refused_for_gap = strstr(flesh_error_text(), "of the thickness: they must start farther apart") != NULL;
  }
  CHECK(refused_for_gap);
  touching_end(&m);
}

static void refused(const char *value, const char *words)
{
  touching m;
  CHECK(touching_begin(head_on, (const char *[]){value, NULL}, 1000, &m) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), words);
  if (m.scene) touching_end(&m);
}

static void what_cannot_be_is_refused(void)
{
  refused("effects.contact.between=none", "between is none; it must be all, self, or a list of pairs of bodies");
  refused("effects.contact.between=[[left, nobody]]",
          "between: body is 'nobody'; the scene has no body of that name, but left, right");
  refused("effects.contact.between=[left, right]", "it must be a list of pairs of bodies, [[a, b], [a, a]]");
  refused("effects.contact.between=[[left, right, left]]", "it must be a list of pairs of bodies, [[a, b], [a, a]]");
  refused("effects.contact.between=[]", "it must be all, self, or a list of pairs of bodies");
  refused("effects.contact.plane={point: [0, 0, -1]}", "one of plane, sphere, capsule or mesh is needed, or between");
  refused("effects.contact.motion=[{time: 0}]", "motion applies to an obstacle; leave it out beside between");
  refused("effects.contact.thickness=-1", "thickness");
  refused("time.method=ida", "contact");
}

/* Bodies that are not paired pass through each other. */
static void only_what_is_named_touches(void)
{
  touching m;
  CHECK_OK(touching_begin(head_on, (const char *[]){"effects.contact.between=self", "time.step=1/200", NULL}, 1000, &m));
  const double came = parting(&m);
  for (int s = 0; s < 10; s++) CHECK_OK(touching_step(&m));
  CHECK_NEAR(parting(&m), came, 1e-6);
  CHECK(m.crossings > 0);
  touching_end(&m);
}

/* Compares a scene without the effect and one with it. */
static void what_is_not_named_costs_nothing(void)
{
  for (int with = 0; with < 2; with++) {
    touching m;
    flesh_proximity proximity;
    CHECK_OK(touching_begin(head_on, (const char *[]){with ? "time.end=1" : "effects.contact=null", NULL}, 1000, &m));
    const flesh_system *system = flesh_scene_system(m.scene);
    CHECK(flesh_system_has_proximity(system) == with);
    CHECK_OK(flesh_proximity_create(system, NULL, &proximity));
    CHECK((proximity.near != NULL) == with);
    flesh_proximity_clear(&proximity);
    touching_end(&m);
  }
}

/* A leaning plate presses a cube with self-contact: one step of statics, which the plate cannot take at once, leads as
 * far as eight. */
static void a_plate_presses_far_in_one_step(void)
{
  touching m[2];
  for (int k = 0; k < 2; k++) {
    CHECK_OK(touching_begin("body: {mesh: ../meshes/cube_3x3x3.mesh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.3}}\n"
                            "effects:\n  - contact: {between: self}\n  - pin: {box: [[-1, -1, -1], [1, 1, 1e-9]]}\n"
                            "  - contact: {plane: {point: [0.05, 0.05, 0.108], normal: [0.1, 0, -1]},\n"
                            "      motion: [{time: 0}, {time: 1, translation: [0, 0, -0.07]}]}\n"
                            "time: {method: static, step: 1, end: 1}\n",
                            (const char *[]){k ? "time.step=1/8" : "time.step=1", NULL}, 1000, &m[k]));
    for (int s = 0; s < (k ? 8 : 1); s++) CHECK_OK(touching_step(&m[k]));
    CHECK(m[k].crossings == 0);
  }
  const double once = touching_energy(&m[0], NULL), often = touching_energy(&m[1], NULL);
  printf("# energy in one step %.9g J, in eight %.9g J\n", once, often);
  CHECK_NEAR(once, often, 1e-6 * fabs(often));
  for (int k = 0; k < 2; k++) touching_end(&m[k]);
}

static void collide_with(const char *const *set, int steps)
{
  touching m;
  double p0[3], p[3], L[3];
  CHECK_OK(touching_begin(off_centre, set, 1000, &m));
  touching_momenta(&m, p0, L);
  int met = 0;
  for (int s = 0; s < steps; s++) {
    CHECK_OK(touching_step(&m));
    met += touches(&m);
  }
  touching_momenta(&m, p, L);
  for (int k = 0; k < 3; k++) CHECK_BELOW(fabs(p[k] - p0[k]), m.slack + 1e-12);
  CHECK(m.crossings == 0 && met > 2);
  touching_end(&m);
}

/* Ten-node tets, whose faces are four triangles each; a direct solver, whose matrix has another pattern when bodies
 * touch. */
static void curved_balls_collide(void)
{
  collide_with((const char *[]){"body.element=tet10", "time.step=1/300", "solver.newton_tolerance=1e-6", NULL}, 5);
}

static void balls_collide_with_a_direct_solver(void)
{
  collide_with((const char *[]){"solver.linear_solver=klu", "time.step=1/300", NULL}, 5);
}

/* A bar on a clamped one under gravity inclined by `slope`, friction 0.5. Returns its position along x and velocity. It
 * moves by less than the spacing of nodes, so that none comes under it or leaves it, which would affect a barrier of
 * nodes. */
static void slide(double slope, int steps, double *place, double *speed)
{
  char scene[2048];
  const double g = 9.81, angle = atan(slope);
  snprintf(scene, sizeof scene,
           "body: {name: track, mesh: ../meshes/bar_8x2x2.mesh, density: 1000, material: {energy: S, constants: "
           "matched, young: 1e7, poisson: 0.3}}\n"
           "bodies:\n  - {name: block, mesh: ../meshes/bar_8x2x2.mesh, translation: [0.05, 0.03, 1.0055]}\n"
           "effects:\n  - inertia: {}\n  - gravity: {acceleration: [%.17g, 0, %.17g]}\n"
           "  - pin: {body: track, box: [[-1, -1, -1], [5, 2, 0.001]]}\n  - viscosity: {shear: 2e4, bulk: 2e4}\n"
           "  - contact: {between: all, friction: 0.5, thickness: 0.006}\n"
           "time: {method: backward-euler, step: 1/100, end: 2}\nsolver: {newton_tolerance: 1e-7}\n",
           g * sin(angle), -g * cos(angle));
  touching m;
  CHECK_OK(touching_begin(scene, NULL, 1000, &m));
  for (int s = 0; s < steps; s++) CHECK_OK(touching_step(&m));
  CHECK(m.crossings == 0);
  *place = *speed = 0;
  for (int i = m.n / 6; i < m.n / 3; i++) {
    *place += m.state.x[3 * i] / (m.n / 6);
    *speed += m.state.v[3 * i] / (m.n / 6);
  }
  touching_end(&m);
}

/* Below the angle of friction it sticks, except for the creep of smooth friction, slower than the slip speed; above, it
 * slides with g (sin - mu cos). */
static void a_block_slides_from_the_angle_of_friction_on(void)
{
  double at[2], v[2];
  slide(0.4, 50, &at[0], &v[0]);
  slide(0.4, 80, &at[1], &v[1]);
  printf("# slope 0.4: creeps with %.3g m/s\n", (at[1] - at[0]) / 0.3);
  const double creep = 1e-3 * (1 - sqrt(1 - 0.4 / 0.5)); /* where f is 0.4/0.5 */
  CHECK_NEAR(v[1], creep, 0.02 * creep);
  CHECK_NEAR((at[1] - at[0]) / 0.3, creep, 0.01 * creep);
  slide(0.6, 30, &at[0], &v[0]);
  slide(0.6, 60, &at[1], &v[1]);
  const double angle = atan(0.6), expected = 9.81 * (sin(angle) - 0.5 * cos(angle));
  printf("# slope 0.6: accelerates with %.5f m/s^2, expected %.5f\n", (v[1] - v[0]) / 0.3, expected);
  CHECK_NEAR((v[1] - v[0]) / 0.3, expected, 0.01 * expected);
}

/* A bar comes down on another, or on a plane if `plane`, while it slides along it. Computes the largest and the least
 * friction over normal force of steps in which it is hit, 0.3 being the coefficient, both from its change of
 * momentum. */
static void hit(int plane, const char *lag_iterations, double *least, double *most)
{
  char scene[2048];
  const char *bar = "mesh: ../meshes/bar_8x2x2.mesh, density: 1000, material: {energy: S, constants: matched, "
                    "young: 1e6, poisson: 0.3}";
  snprintf(scene, sizeof scene,
           "body: {name: track, %s}\n%s%s%s\neffects:\n  - inertia: {}\n"
           "  - contact: {%s, friction: 0.3, thickness: 0.006}\n"
           "time: {method: backward-euler, step: 1/250, end: 1}\nsolver: {newton_tolerance: 1e-9, lag_iterations: %s}\n",
           bar, plane ? "" : "bodies:\n  - {name: block, translation: [0.05, 0.03, 1.0155], velocity: [6, 0, -2], ",
           plane ? "start: {velocity: [6, 0, -2]}" : bar, plane ? "" : "}",
           plane ? "plane: {point: [0, 0, -0.0155]}" : "between: all", lag_iterations);
  touching m;
  CHECK_OK(touching_begin(scene, NULL, 1000, &m));
  const int first = plane ? 0 : m.n / 2;
  *least = INFINITY, *most = 0;
  for (int s = 0; s < 5; s++) {
    double change[3] = {0};
    for (int d = first; d < m.n; d++) change[d % 3] -= m.mass[d / 3] * m.state.v[d];
    CHECK_OK(touching_step(&m));
    for (int d = first; d < m.n; d++) change[d % 3] += m.mass[d / 3] * m.state.v[d];
    printf("# step %d: momentum changes by %.4g and %.4g N s, %d solves\n", s, change[0], change[2], m.last.solves);
    if (change[2] < 1) continue;
    *least = fmin(*least, -change[0] / change[2]);
    *most = fmax(*most, -change[0] / change[2]);
  }
  CHECK(m.crossings == 0);
  touching_end(&m);
}

/* With normal forces of the step's beginning an impact begins without friction; solved again, the step has its own. */
static void a_blow_rubs_by_its_own_force(void)
{
  for (int plane = 0; plane < 2; plane++) {
    double least, most;
    hit(plane, "1", &least, &most);
    printf("# friction over normal force from %.4f to %.4f\n", least, most);
    CHECK_BELOW(least, 0.1);
    hit(plane, "40", &least, &most);
    printf("# solved again from %.5f to %.5f\n", least, most);
    CHECK_NEAR(least, 0.3, 0.003);
    CHECK_NEAR(most, 0.3, 0.003);
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(balls_collide), TEST(restitution_converges),
                   TEST_OF_THREADS(threads_and_cuts_change_no_bit), TEST(what_begins_crossed_is_refused),
                   TEST(what_begins_too_near_is_refused), TEST(what_cannot_be_is_refused),
                   TEST(only_what_is_named_touches), TEST(what_is_not_named_costs_nothing),
                   TEST(a_block_slides_from_the_angle_of_friction_on), TEST(a_blow_rubs_by_its_own_force),
                   TEST(a_plate_presses_far_in_one_step), TEST(curved_balls_collide),
                   TEST(balls_collide_with_a_direct_solver));
}
