// TEST quick seconds=60
/* test_incline.c: a block slides down an incline, an obstacle or another body, by every method. It begins just above the
 * incline and bounces in the barrier, so that the forces at the ends of steps are not those that move it. Its velocity
 * obeys Coulomb's law in impulses, dv_t = g sin(angle) t - mu (g cos(angle) t + dv_n), which is
 * v_t = g (sin(angle) - mu cos(angle)) t where it does not bounce. In backward Euler friction goes by the normal force of
 * the step before: it is off by the impulse of one step. Methods of order 2 solve their steps again and keep their order,
 * down to what the nodes' own directions of slip leave: the block widens as it is pressed. */
#include "temporary.h"

#include <math.h>

#include "flesh/observer.h"
#include "output/fields.h"
#include "touching.h"

static const double g = 9.81, angle = 0.6, friction = 0.5, begin = 0.05, end = 0.12; /* m/s, s */
static char folder[4096];

typedef struct incline {
  touching m;
  int first, steps;    /* the block's first node */
  double mass, v[3];   /* kg; m/s, of the block's centre of mass */
  flesh_fields fields; /* of frames */
  double error;        /* m/s, the largest departure from Coulomb's law */
  double force;        /* N, the sum of all steps' normal forces in frames */
} incline;

static int look(void *data, const flesh_step_record *record)
{
  incline *s = data;
  const double t = record->state->t;
  memset(s->v, 0, sizeof s->v);
  for (int d = 3 * s->first; d < s->m.n; d++) s->v[d % 3] += s->m.mass[d / 3] * record->state->v[d] / s->mass;
  if (record->step == 0) return FLESH_OK;
  s->error = fmax(s->error, fabs(s->v[0] - begin - g * (sin(angle) - friction * cos(angle)) * t + friction * s->v[2]));
  flesh_fields_find(&s->fields, record);
  for (int i = s->first; i < s->m.n / 3; i++) s->force += s->fields.forces.contact[3 * i + 2];
  s->steps++;
  return FLESH_OK;
}

static void start(int on_body, const char *method, double h, incline *s)
{
  char scene[2048];
  const char *cube = "mesh: ../meshes/cube_3x3x3.mesh, density: 1000, material: {energy: S, constants: matched, young: "
                     "1e6, poisson: 0.4}";
  snprintf(scene, sizeof scene,
           "body: {name: track, %s}\n%s%s%s\neffects:\n  - inertia: {}\n  - gravity: {acceleration: [%.17g, 0, %.17g]}\n"
           "  - viscosity: {shear: 200, bulk: 200}\n%s"
           "  - contact: {%s, friction: %g, thickness: 5e-4, slip_speed: 1e-4}\n"
           "time: {method: %s, step: %.17g, end: %g}\nsolver: {newton_tolerance: 1e-9}\n"
           "output:\n  probes: [{name: block, %sbox: [[-1, -1, -1], [1, 1, 1]], quantities: [contact_force]}]\n",
           cube, on_body ? "bodies:\n  - {name: block, translation: [0.01, 0.007, 0.1005], velocity: [0.05, 0, 0], " : "",
           on_body ? cube : "start: {velocity: [0.05, 0, 0]}", on_body ? "}" : "", g * sin(angle), -g * cos(angle),
           on_body ? "  - pin: {body: track}\n" : "", on_body ? "between: all" : "plane: {point: [0, 0, -5e-4]}",
           friction, method, h, end, on_body ? "body: block, " : "");
  *s = (incline){.mass = 1};
  CHECK_OK(touching_begin(scene, NULL, 1000, &s->m));
  s->first = on_body ? s->m.n / 6 : 0;
}

/* The mean of the column whose name begins so, over all rows but that of the start. */
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

/* The largest departure from Coulomb's law, m/s. All that is written of the contact is the force that moves the block. */
static double slide(int on_body, flesh_method method, const char *how, double h)
{
  incline s;
  char history_path[5000], probes_path[5000];
  flesh_history *history = NULL;
  flesh_probes *probes = NULL;
  int count;
  start(on_body, how, h, &s);
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
  const double weight = s.mass * g * cos(angle), moves = 1 + s.v[2] / (g * cos(angle) * end);
  const double forces[] = {s.force / s.steps / weight, mean_of(history_path, "contact_force") / weight,
                           mean_of(probes_path, "block.contact_force_z") / weight};
  printf("# %s, %s, 1/%g s: from Coulomb's law by %.2e m/s; force over weight in frames %.4f, histories %.4f, probes %.4f, "
         "by its momentum %.4f\n",
         on_body ? "body" : "plane", how, 1 / h, s.error, forces[0], forces[1], forces[2], moves);
  for (int k = 0; k < 3; k++) CHECK_NEAR(forces[k], moves, 1. / s.steps); /* methods weigh the ends differently */
  for (int k = 0; k < 3 && h < 1. / 700; k++) CHECK_NEAR(forces[k], 1, 0.011);
  flesh_fields_clear(&s.fields);
  touching_end(&s.m);
  return s.error;
}

/* In statics nothing slides; the adaptive methods refuse contact between bodies, and lag nothing. */
static void blocks_slide(int on_body)
{
  const double steps[] = {1. / 200, 1. / 400, 1. / 800};
  for (int k = 0; flesh_method_name((flesh_method)k); k++) {
    const flesh_method method = (flesh_method)k;
    double errors[3];
    const int fixed = flesh_method_order(method) > 0;
    if (method == FLESH_METHOD_STATIC || (on_body && !fixed)) continue;
    for (int level = 0; level < 3; level++) {
      errors[level] = slide(on_body, method, flesh_method_name(method), steps[level]);
      const double h = steps[level], of_order_2 = fmax(260 * h * h, 1.5e-3);
      const int order = flesh_method_order(method);
      CHECK_BELOW(errors[level], order == 1 ? 6 * friction * g * cos(angle) * h : order > 1 ? of_order_2 : 1e-3);
    }
    if (flesh_method_order(method) != 1) continue;
    const double order = log(errors[0] / errors[2]) / log(steps[0] / steps[2]);
    printf("# order %.2f\n", order);
    CHECK(order > 0.8);
  }
}

/* Friction's lag counts as an error of the step: outputs are at most 1/400 s apart, at which a
 * fixed step is off by 1e-2 m/s, and departures fall with the tolerance. */
static void blocks_slide_by_steps_that_errors_choose(void)
{
  static const struct {
    const char *how;
    flesh_method method;
    double most; /* m/s */
  } runs[] = {{"runge-kutta, tolerance: 1e-4", FLESH_METHOD_RUNGE_KUTTA, 4e-3},
              {"runge-kutta, tolerance: 1e-5", FLESH_METHOD_RUNGE_KUTTA, 2.5e-3},
              {"newmark, adaptive: true, tolerance: 1e-3", FLESH_METHOD_NEWMARK, 6e-3}};
  for (int k = 0; k < 6; k++)
    CHECK_BELOW(slide(k % 2, runs[k / 2].method, runs[k / 2].how, 1. / 400), runs[k / 2].most);
}

static void blocks_slide_on_a_plane(void) { blocks_slide(0); }
static void blocks_slide_on_a_body(void) { blocks_slide(1); }

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  const int status = RUN_TESTS(argc, argv, TEST(blocks_slide_on_a_plane), TEST(blocks_slide_on_a_body),
                               TEST(blocks_slide_by_steps_that_errors_choose));
  test_folder_remove(folder);
  return status;
}
