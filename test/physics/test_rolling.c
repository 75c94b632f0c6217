// TEST full seconds=300
/* test_rolling.c: friction that turns a body, with every method of fixed steps and with adaptive steps. A sliding ball
 * begins to roll with v = v0 / (1 + I/(m R^2)), 5/7 of its speed for a solid ball, however it got there, because its
 * angular momentum about the line of contact is conserved. A flat strip that turns about the vertical on a plane is
 * braked, while it slips, by mu N r, with r the mean distance of its lower face from the axis, weighted by area. */
#include <math.h>

#include "touching.h"

static const double g = 9.81, friction = 0.3;

typedef struct method {
  const char *how;
  double h; /* s, between looks */
} method;

/* All methods of fixed steps, and two adaptive ones. */
static method method_at(int k)
{
  static const method chosen[] = {{"runge-kutta, tolerance: 1e-3", 1. / 500},
                                  {"newmark, adaptive: true, tolerance: 1e-2", 1. / 500}};
  int fixed = 0;
  for (int m = 0; flesh_method_name((flesh_method)m); m++)
    if (flesh_method_order((flesh_method)m) > 0 && fixed++ == k) return (method){flesh_method_name((flesh_method)m), 1. / 500};
  return k - fixed < 2 ? chosen[k - fixed] : (method){0};
}

static void begin(const char *body, const char *contact, method method, touching *m)
{
  char scene[2048];
  snprintf(scene, sizeof scene,
           "body: {%s, density: 1000, material: {energy: S, constants: matched, young: 1e7, poisson: 0.3}}\n"
           "effects:\n  - inertia: {}\n  - gravity: {}\n  - contact: {%s, friction: %g, slip_speed: 1e-3}\n"
           "time: {method: %s, step: %.17g, end: 1}\nsolver: {newton_tolerance: 1e-6}\n",
           body, contact, friction, method.how, method.h);
  CHECK_OK(touching_begin(scene, NULL, 1000, m));
}

/* The body's mass and its moment of inertia about an axis through its centre, and its present motion. */
typedef struct turning {
  double mass, inertia, centre[3], v[3], spin; /* kg, kg m^2, m, m/s, 1/s */
} turning;

static turning look(const touching *m, int axis)
{
  const int j = (axis + 1) % 3, k = (axis + 2) % 3;
  turning t = {0};
  for (int d = 0; d < m->n; d++) {
    if (d % 3 == 0) t.mass += m->mass[d / 3];
    t.centre[d % 3] += m->mass[d / 3] * m->state.x[d];
    t.v[d % 3] += m->mass[d / 3] * m->state.v[d];
  }
  for (int c = 0; c < 3; c++) t.centre[c] /= t.mass, t.v[c] /= t.mass;
  for (int i = 0; i < m->n / 3; i++) {
    const double *x = m->state.x + 3 * i, *v = m->state.v + 3 * i, y = x[j] - t.centre[j], z = x[k] - t.centre[k];
    t.inertia += m->mass[i] * (y * y + z * z);
    t.spin += m->mass[i] * (y * (v[k] - t.v[k]) - z * (v[j] - t.v[j]));
  }
  t.spin /= t.inertia;
  return t;
}

/* The barrier's width is half the distance of nodes, so that the ball rolls on several, whose distance from its centre
 * is shorter than its radius by up to 4 %: the speed is below the closed form by half a percent. */
static void a_ball_that_slides_begins_to_roll(void)
{
  const double R = 0.05, v0 = 0.4;
  for (int k = 0; method_at(k).how; k++) {
    touching m;
    begin("mesh: ../meshes/ball.msh, element: tet10-mean, refine: 1, curved: [{sphere: {radius: 0.05}}]",
          "plane: {point: [0, 0, -0.0519]}, thickness: 3e-3, stiffness: 2e3", method_at(k), &m);
    for (int d = 0; d < m.n; d += 3) m.state.v[d] = v0;
    const turning first = look(&m, 1);
    double mean = 0, slip = 0;
    int steps = 0, status = 0;
    while (m.state.t < 0.07 - m.h / 2 && !(status = touching_step(&m))) {
      const turning now = look(&m, 1);
      if (m.state.t > 0.045) mean += now.v[0], slip += now.v[0] - R * now.spin, steps++;
    }
    CHECK_OK(status);
    mean /= steps;
    const double rolling = v0 / (1 + first.inertia / (first.mass * R * R));
    printf("# %s: %.4f m/s of %.4f, slip %.4f m/s\n", method_at(k).how, mean, rolling, slip / steps);
    CHECK_NEAR(mean, rolling, 0.01 * rolling);
    CHECK_NEAR(slip / steps, 0, 0.01 * rolling);
    touching_end(&m);
  }
}

/* The impulse of the normal force is m (g t + v_z), whether the block bounces or not. */
static void a_strip_that_turns_is_braked(void)
{
  for (int k = 0; method_at(k).how; k++) {
    touching m;
    begin("mesh: ../meshes/strip.mesh", "plane: {point: [0, 0, -1.68e-3]}, thickness: 2e-3, stiffness: 2e3", method_at(k), &m);
    double *area = calloc((size_t)m.n / 3, sizeof *area), whole = 0, arm = 0, most = 0;
    for (int f = 0; f < m.surface.face_count; f++) {
      const int *node = m.surface.faces + 3 * f;
      const double *a = m.state.x + 3 * node[0], *b = m.state.x + 3 * node[1], *c = m.state.x + 3 * node[2];
      if (a[2] + b[2] + c[2] > 1e-9) continue;
      const double third = fabs((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 6;
      for (int corner = 0; corner < 3; corner++) area[node[corner]] += third, whole += third;
    }
    for (int i = 0; i < m.n / 3; i++) {
      double *v = m.state.v + 3 * i;
      const double x = m.state.x[3 * i] - 0.5, y = m.state.x[3 * i + 1] - 0.05;
      arm += area[i] / whole * hypot(x, y);
      v[0] = -5 * y, v[1] = 5 * x;
    }
    const turning first = look(&m, 2);
    int status = 0;
    while (m.state.t < 0.3 - m.h / 2 && !(status = touching_step(&m))) {
      const turning now = look(&m, 2);
      const double impulse = now.mass * (g * m.state.t + now.v[2]);
      most = fmax(most, fabs(first.inertia * first.spin - now.inertia * now.spin - friction * arm * impulse));
    }
    CHECK_OK(status);
    const double braked = friction * arm * first.mass * g * m.state.t;
    printf("# %s: from %.2f to %.2f 1/s; the torque's impulse is off by %.2f %% at most\n", method_at(k).how, first.spin,
           look(&m, 2).spin, 100 * most / braked);
    CHECK_BELOW(most, 0.02 * braked);
    free(area);
    touching_end(&m);
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(a_ball_that_slides_begins_to_roll), TEST(a_strip_that_turns_is_braked));
}
