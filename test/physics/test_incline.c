// TEST full seconds=15
/* test_incline.c: a block slides down an incline, an obstacle or another body, with every method. It starts just above
 * the incline and bounces in the barrier, so that the forces at the ends of steps are not those that move it. Its
 * velocity follows Coulomb's law in impulses, dv_t = g sin(angle) t - mu (g cos(angle) t + dv_n), which is v_t = g
 * (sin(angle) - mu cos(angle)) t if it does not bounce. Under a lid of its own mass, which stays at its place along the
 * incline, it is braked by mu (3 g cos(angle) t + dv_n + 2 dv_n of the lid), however the two bounce. With backward
 * Euler friction uses the normal force of the previous step: it is off by the impulse of one step. Methods of order 2
 * repeat the solves of their steps and keep their order, down to the error by the nodes' individual directions of slip:
 * the block widens while it is pressed. The order is tested without bounces. */
#include "temporary.h"

#include <math.h>

#include "flesh/observer.h"
#include "output/fields.h"
#include "touching.h"

static const double g = 9.81, angle = 0.6, begin = 0.05, end = 0.12; /* m/s, s */
static char folder[4096];

typedef enum ground { PLANE, BODY, BETWEEN } ground; /* the last: a body, and under a lid */

typedef struct incline {
  touching m;
  ground on;
  double friction;
  int first, nodes, steps; /* the block's */
  double mass, v[3];       /* kg; m/s, of the block's centre of mass */
  double pressing, pressed; /* 1, m/s: factor on the weight that surfaces bear, and additional impulse of this speed */
  flesh_fields fields; /* of frames */
  double error;        /* m/s, largest deviation from Coulomb's law */
  double force;        /* N, sum of all steps' normal forces in frames */
} incline;

static int look(void *data, const flesh_step_record *record)
{
  incline *s = data;
  const double t = record->state->t;
  const int last = s->first + s->nodes;
  double lid = 0;
  memset(s->v, 0, sizeof s->v);
  for (int d = 3 * s->first; d < 3 * last; d++) s->v[d % 3] += s->m.mass[d / 3] * record->state->v[d] / s->mass;
  for (int i = last; i < s->m.n / 3; i++) lid += s->m.mass[i] * record->state->v[3 * i + 2] / s->mass;
  s->pressed = s->v[2] + 2 * lid;
  if (record->step == 0) return FLESH_OK;
  s->error = fmax(s->error, fabs(s->v[0] - begin - g * sin(angle) * t +
                                 s->friction * (s->pressing * g * cos(angle) * t + s->pressed)));
  flesh_fields_find(&s->fields, record);
  for (int i = s->first; i < last; i++) s->force += s->fields.forces.contact[3 * i + 2];
  s->steps++;
  return FLESH_OK;
}

static void start(ground on, const char *method, double h, incline *s)
{
  char scene[4096], cube[512], bodies[2048] = "start: {velocity: [0.05, 0, 0]}\n";
  *s = (incline){.on = on, .mass = 1, .friction = on == BETWEEN ? 0.15 : 0.5, .pressing = on == BETWEEN ? 3 : 1};
  snprintf(cube, sizeof cube, "mesh: ../meshes/cube_3x3x3.mesh, density: 1000, material: {energy: S, constants: matched, "
           "young: %s}", on == BETWEEN ? "1e7, poisson: 0.3" : "1e6, poisson: 0.4");
  if (on != PLANE)
    snprintf(bodies, sizeof bodies, "bodies:\n  - {name: block, translation: [0.01, 0.007, 0.1005], velocity: [0.05, 0, 0], "
             "%s}\n%s%s%s", cube, on == BETWEEN ? "  - {name: lid, translation: [0.02, 0.011, 0.201], " : "",
             on == BETWEEN ? cube : "", on == BETWEEN ? "}\n" : "");
  snprintf(scene, sizeof scene,
           "body: {name: track, %s}\n%seffects:\n  - inertia: {}\n  - gravity: {acceleration: [%.17g, 0, %.17g]}\n"
           "  - viscosity: {shear: 200, bulk: 200}\n%s%s"
           "  - contact: {%s, friction: %g, thickness: 5e-4, slip_speed: 1e-4}\n"
           "time: {method: %s, step: %.17g, end: %g}\nsolver: {newton_tolerance: 1e-9}\n"
           "output:\n  probes: [{name: block, %sbox: [[-1, -1, -1], [1, 1, 1]], quantities: [contact_force]}]\n",
           cube, bodies, g * sin(angle), -g * cos(angle),
           on == PLANE ? "" : "  - pin: {body: track}\n", on == BETWEEN ? "  - pin: {body: lid, axes: [x, y]}\n" : "",
           on == PLANE ? "plane: {point: [0, 0, -5e-4]}" : "between: all", s->friction, method, h, end,
           on == PLANE ? "" : "body: block, ");
  CHECK_OK(touching_begin(scene, NULL, 1000, &s->m));
  s->nodes = s->m.n / 3 / (on == PLANE ? 1 : on == BODY ? 2 : 3);
  s->first = on == PLANE ? 0 : s->nodes;
}

/* Returns the mean of the column whose name begins so, over all rows but that of the start. */
static double mean_of(const char *path, const char *column)
{
  char line[8192], *word, *place;
  int at = -1, rows = 0;
  double sum = 0;
  FILE *stream = fopen(path, "r");
  for (int row = 0; stream && fgets(line, sizeof line, stream); row++) {
    word = strtok_r(line, ",\n", &place);
    for (int k = 0; word; k++, word = strtok_r(NULL, ",\n", &place)) {
      if (row == 0 && !strncmp(word, column, strlen(column))) at = k;
      if (row > 1 && k == at) sum += atof(word), rows++;
    }
  }
  if (stream) fclose(stream);
  CHECK(rows > 0);
  return sum / rows;
}

/* Returns the largest deviation from Coulomb's law, m/s. Everything written about the contact is the force that moves
 * the block. */
static double slide(ground on, flesh_method method, const char *how, double h)
{
  incline s;
  char history_path[5000], probes_path[5000];
  flesh_history *history = NULL;
  flesh_probes *probes = NULL;
  int count;
  start(on, how, h, &s);
  const flesh_system *system = flesh_scene_system(s.m.scene);
  const flesh_body *body = flesh_scene_body(s.m.scene);
  const flesh_probe *given = flesh_scene_probes(s.m.scene, &count);
  snprintf(history_path, sizeof history_path, "%s/history.csv", folder);
  snprintf(probes_path, sizeof probes_path, "%s/probes.csv", folder);
  CHECK_OK(flesh_history_create(history_path, system, &history));
  CHECK_OK(flesh_probes_create(probes_path, body, system, method, count, given, &probes));
  CHECK_OK(flesh_fields_open(body, system, method, FLESH_FIELD_CONTACT_FORCE, FLESH_AT_NODES, &s.fields));
  const flesh_observer observers[] = {{look, &s}, {flesh_history_observe, history}, {flesh_probes_observe, probes}};
  const flesh_run_options options = {.h = h, .end = end, .observer_count = 3, .observers = observers};
  CHECK_OK(flesh_run(system, s.m.integrator, &options, &s.m.state, NULL));
  CHECK_OK(flesh_history_close(&history));
  CHECK_OK(flesh_probes_close(&probes));
  const double weight = s.mass * g * cos(angle), moves = 1 + s.v[2] / (g * cos(angle) * end),
               all = s.pressing + s.pressed / (g * cos(angle) * end);
  const double forces[] = {s.force / s.steps / weight, mean_of(history_path, "contact_force") / weight * moves / all,
                           mean_of(probes_path, "block.contact_force_z") / weight};
  printf("# %s, %s, 1/%g s: from Coulomb's law by %.2e m/s; force over weight in frames %.4f, histories %.4f, probes %.4f, "
         "by its momentum %.4f\n",
         on == PLANE ? "plane" : on == BODY ? "body" : "between", how, 1 / h, s.error, forces[0], forces[1], forces[2], moves);
  /* Methods weigh the ends differently, and a step in parts has the force of the last part. */
  for (int k = 0; k < 3; k++) CHECK_NEAR(forces[k], moves, 1.5 * s.pressing / s.steps);
  for (int k = 0; k < 3 && h < 1. / 700 && on != BETWEEN; k++) CHECK_NEAR(forces[k], 1, 0.011);
  flesh_fields_clear(&s.fields);
  touching_end(&s.m);
  return s.error;
}

/* In statics nothing slides; the adaptive methods refuse contact between bodies, and lag nothing. */
static void blocks_slide(ground on)
{
  const double steps[] = {1. / 200, 1. / 400, 1. / 800};
  for (int k = 0; flesh_method_name((flesh_method)k); k++) {
    const flesh_method method = (flesh_method)k;
    const int levels = TEST_FEWER(3, 1);
    double errors[3];
    const int fixed = flesh_method_order(method) > 0;
    if (method == FLESH_METHOD_STATIC || (on != PLANE && !fixed)) continue;
    for (int level = 0; level < levels; level++) {
      errors[level] = slide(on, method, flesh_method_name(method), steps[level]);
      const double h = steps[level], of_order_2 = on == BETWEEN ? 5e-4 : fmax(260 * h * h, 1.5e-3);
      const int order = flesh_method_order(method);
      CHECK_BELOW(errors[level], order == 1 ? 6 * 0.5 * g * cos(angle) * h : order > 1 ? of_order_2 : 1e-3);
    }
    if (flesh_method_order(method) != 1 || levels < 3) continue;
    const double order = log(errors[0] / errors[2]) / log(steps[0] / steps[2]);
    printf("# order %.2f\n", order);
    CHECK(order > 0.8);
  }
}

/* A stage is solved again while friction is off by more than its residual may be; free bodies weigh such errors more.
 * Outputs are at most 1/400 s apart, at which a fixed step with one solve is off by 1e-2 m/s. On the plane the nodes'
 * individual directions of slip leave 1.7e-4 m/s, as fixed steps that resolve the bounces show. */
static void blocks_slide_by_steps_that_errors_choose(void)
{
  static const struct {
    const char *how;
    flesh_method method;
    double most, between; /* m/s, deviation from that of short steps; total deviation on another body, whose faces widen */
  } runs[] = {{"runge-kutta, tolerance: 1e-4", FLESH_METHOD_RUNGE_KUTTA, 5e-5, 1.4e-3},
              {"runge-kutta, tolerance: 1e-5", FLESH_METHOD_RUNGE_KUTTA, 2e-5, 1.4e-3},
              {"newmark, adaptive: true, tolerance: 1e-3", FLESH_METHOD_NEWMARK, 3e-4, 2e-3}};
  const double resolved = slide(PLANE, FLESH_METHOD_RUNGE_KUTTA, "runge-kutta, table: esdirk325", 1e-4);
  for (int k = 0; k < 3; k++) {
    CHECK_NEAR(slide(PLANE, runs[k].method, runs[k].how, 1. / 400), resolved, runs[k].most);
    CHECK_BELOW(slide(BODY, runs[k].method, runs[k].how, 1. / 400), runs[k].between);
  }
}

/* Stiff blocks land on the plane within a small part of a step, and slide on. Errors of residuals and friction are
 * momentum, which vibrations do not show: if it counts for at most 20 periods of the block, steps of BDF2 are off by 60
 * tolerances. */
static void stiff_blocks_slide_within_the_tolerance(void)
{
  static const struct {
    const char *name;
    double least; /* tolerance */
  } methods[] = {{"runge-kutta", 1e-3}, {"bdf2", 1e-3}, {"newmark", 1e-2}};
  const double slope = 0.4, friction = 0.25, v = 0.1, t = 0.4;
  for (int k = 0; k < 3; k++)
    for (double tolerance = 1e-2; tolerance > 0.9 * methods[k].least; tolerance /= 10)
      for (int steps = 20; steps <= 40; steps += 20) {
        char scene[2048];
        double x = -(v * t + g * (sin(slope) - friction * cos(slope)) * t * t / 2), mass = 0, sum = 0;
        touching m;
        snprintf(scene, sizeof scene,
                 "body: {mesh: ../meshes/cube_3x3x3.mesh, density: 2500, material: {energy: S, young: 1e12, poisson: 0.3}}\n"
                 "effects:\n  - inertia: {}\n  - gravity: {acceleration: [%.17g, 0, %.17g]}\n"
                 "  - contact: {plane: {point: [0, 0, -1.224e-3]}, friction: %g, thickness: 1.2e-3}\n"
                 "start: {velocity: [%g, 0, 0]}\n"
                 "time: {method: %s, adaptive: true, tolerance: %g, step: %.17g, end: %g}\n",
                 g * sin(slope), -g * cos(slope), friction, v, methods[k].name, tolerance, t / steps, t);
        CHECK_OK(touching_begin(scene, NULL, 2500, &m));
        const double *X = flesh_mesh_positions(flesh_scene_mesh(m.scene));
        for (int s = 0; s < steps; s++) CHECK_OK(touching_step(&m));
        for (int i = 0; i < m.n / 3; i++) sum += m.mass[i] * (m.state.x[3 * i] - X[3 * i]), mass += m.mass[i];
        x += sum / mass;
        printf("# %s, tolerance %g, 1/%g s: off by %.2f tolerances\n", methods[k].name, tolerance, steps / t, x / (0.1 * tolerance));
        CHECK_NEAR(x / (0.1 * tolerance), 0, 3);
        touching_end(&m);
      }
}

/* Computes the speeds of a block that slows down on another one, m/s, at LOOKS times. It starts within a soft barrier,
 * which all steps resolve: there are no jolts that would hide the order. */
enum { LOOKS = 25 };
static void slow_down_begin(const char *method, const char *lag, int steps, touching *m)
{
  static const char *const cube =
      "mesh: ../meshes/cube_3x3x3.mesh, density: 1000, material: {energy: S, young: 1e6, poisson: 0.3}";
  char scene[2048];
  snprintf(scene, sizeof scene,
           "body: {name: track, %s}\nbodies:\n  - {name: block, translation: [0.01, 0.007, 0.104], velocity: [0.1, 0, 0], %s}\n"
           "effects:\n  - inertia: {}\n  - gravity: {}\n  - viscosity: {shear: 200, bulk: 200}\n  - pin: {body: track}\n"
           "  - contact: {between: all, friction: 0.5, thickness: 5e-3, stiffness: 2e3, slip_speed: 1e-2}\n"
           "time: {method: %s, step: %.17g, end: 1}\nsolver: {newton_tolerance: 1e-9%s}\n",
           cube, cube, method, 0.05 / steps, lag);
  CHECK_OK(touching_begin(scene, NULL, 1000, m));
}

static void slow_down(const char *method, const char *lag, int steps, double speed[LOOKS])
{
  touching m;
  slow_down_begin(method, lag, steps, &m);
  for (int s = 0; s < steps; s++) {
    double sum = 0, mass = 0;
    CHECK_OK(touching_step(&m));
    for (int i = m.n / 6; i < m.n / 3; i++) sum += m.mass[i] * m.state.v[3 * i], mass += m.mass[i];
    speed[s * LOOKS / steps] = sum / mass; /* the last value before each time is kept */
  }
  touching_end(&m);
}

/* Friction on another body is of order 2; with one solve a step, by normal forces of the previous step, it is of order
 * 1. */
static void friction_is_of_the_methods_order(void)
{
  const struct {
    const char *method, *lag;
    int order, first; /* intervals over the longest step */
  } cases[] = {{"midpoint", "", 2, 1}, {"newmark", "", 2, 1}, {"hht", "", 2, 1}, {"generalized-alpha", "", 2, 1},
               {"bdf2", "", 2, 2}, {"newmark", ", lag_iterations: 1", 1, 1}};
  for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
    double speed[2][LOOKS], squares[4] = {0};
    for (int level = 0; level < 4; level++) {
      slow_down(cases[k].method, cases[k].lag, cases[k].first * LOOKS << level, speed[level % 2]);
      for (int s = 0; s < LOOKS && level; s++) squares[level] += pow(speed[0][s] - speed[1][s], 2);
    }
    const double order[] = {log2(squares[1] / squares[2]) / 2, log2(squares[2] / squares[3]) / 2};
    printf("# %s%s: orders %.2f, %.2f, last change %.1e m/s\n", cases[k].method, cases[k].lag, order[0], order[1],
           sqrt(squares[3] / LOOKS));
    CHECK_NEAR(order[1], cases[k].order, 0.2);
  }
}

/* The block's weight as its contact bears it. */
typedef struct weighing {
  touching m;
  flesh_fields fields;
  double force, sum; /* N, upwards: at the last step's end, and over all steps */
} weighing;

static int weigh_step(void *data, const flesh_step_record *record)
{
  weighing *w = data;
  flesh_fields_find(&w->fields, record);
  w->force = 0;
  for (int i = w->m.n / 6; i < w->m.n / 3; i++) w->force += w->fields.forces.contact[3 * i + 2];
  w->sum += record->step ? w->force : w->force / 2;
  return FLESH_OK;
}

/* Returns the mean of the contact force on the block of the last test, over 1/20 s, divided by the block's weight and
 * its change of momentum. */
static double weigh(flesh_method method, int steps)
{
  const double h = 0.05 / steps;
  weighing w = {0};
  slow_down_begin(flesh_method_name(method), "", steps, &w.m);
  const flesh_system *system = flesh_scene_system(w.m.scene);
  CHECK_OK(flesh_fields_open(flesh_scene_body(w.m.scene), system, method, FLESH_FIELD_CONTACT_FORCE, FLESH_AT_NODES, &w.fields));
  const flesh_observer observer = {weigh_step, &w};
  const flesh_run_options options = {.h = h, .end = 0.05, .observer_count = 1, .observers = &observer};
  CHECK_OK(flesh_run(system, w.m.integrator, &options, &w.m.state, NULL));
  double momentum = 0, weight = 0;
  for (int i = w.m.n / 6; i < w.m.n / 3; i++) momentum += w.m.mass[i] * w.m.state.v[3 * i + 2], weight += w.m.mass[i] * g;
  const double trapezoid = (w.sum - w.force / 2) / steps;
  flesh_fields_clear(&w.fields);
  touching_end(&w.m);
  return trapezoid / (weight + momentum / 0.05);
}

static void contact_bears_the_weight(void)
{
  for (int k = 0; flesh_method_name((flesh_method)k); k++) {
    if (flesh_method_order((flesh_method)k) <= 0) continue;
    const double coarse = weigh((flesh_method)k, 50) - 1, fine = weigh((flesh_method)k, 100) - 1;
    printf("# %s: contact force over weight and momentum less 1: %.1e and %.1e\n", flesh_method_name((flesh_method)k), coarse, fine);
    CHECK_BELOW(fabs(coarse), 1e-3);
    CHECK_BELOW(fabs(fine), 5e-4);
  }
}

static void blocks_slide_on_a_plane(void) { blocks_slide(PLANE); }
static void blocks_slide_on_a_body(void) { blocks_slide(BODY); }
static void a_block_slides_between_bodies(void) { blocks_slide(BETWEEN); }

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  const int status = RUN_TESTS(argc, argv, TEST(blocks_slide_on_a_plane), TEST(blocks_slide_on_a_body),
                               TEST_LONG(a_block_slides_between_bodies), TEST_LONG(friction_is_of_the_methods_order), TEST(contact_bears_the_weight),
                               TEST(blocks_slide_by_steps_that_errors_choose), TEST(stiff_blocks_slide_within_the_tolerance));
  test_folder_remove(folder);
  return status;
}
