// TEST quick seconds=60
/* test_probes.c: reactions balance loads and inertia; strain, stress and energy agree with the effect of elasticity;
 * every row is on disk when its step ends. */
#include "scene_files.h"

#include <math.h>
#include <string.h>

#include "flesh/probe.h"

static const char *const elements[] = {"tet4", "tet10", "tet10-mean"};
enum { ELEMENTS = 3, MOST_ROWS = 64, MOST_COLUMNS = 64 };

/* A probes.csv. */
static char names[MOST_COLUMNS][64];
static double values[MOST_ROWS][MOST_COLUMNS];
static int row_count, column_count;

static void read_table(const char *path)
{
  char *text = read_text(path), *line_end, *word_end;
  row_count = -1;
  CHECK(*text && text[strlen(text) - 1] == '\n');
  for (char *line = strtok_r(text, "\n", &line_end); line; line = strtok_r(NULL, "\n", &line_end), row_count++) {
    int c = 0;
    for (char *word = strtok_r(line, ",", &word_end); word && c < MOST_COLUMNS; word = strtok_r(NULL, ",", &word_end)) {
      if (row_count < 0) snprintf(names[c], sizeof names[c], "%s", word);
      else if (row_count < MOST_ROWS) values[row_count][c] = strtod(word, NULL);
      c++;
    }
    if (row_count < 0) column_count = c;
    CHECK(c == column_count);
  }
  free(text);
}

/* Returns a column's number in a row; NaN if no column has the name. */
static double at(int row, const char *name)
{
  for (int c = 0; c < column_count; c++)
    if (!strcmp(names[c], name)) return values[row][c];
  printf("# no column %s\n", name);
  return NAN;
}

/* "<probe>.<quantity>_<component> [<unit>]". */
static void vector_at(int row, const char *prefix, const char *unit, double value[3])
{
  for (int d = 0; d < 3; d++) {
    char name[160];
    snprintf(name, sizeof name, "%s_%c [%s]", prefix, 'x' + d, unit);
    value[d] = at(row, name);
  }
}

/* Computes sums over nodes [3*n]: of f, and of x times f about the origin. */
static void sum(int n, const double *x, const double *f, double force[3], double moment[3])
{
  for (int d = 0; d < 3; d++) force[d] = moment[d] = 0;
  for (int i = 0; i < n / 3; i++)
    for (int d = 0; d < 3; d++) {
      const int e = (d + 1) % 3, g = (d + 2) % 3;
      force[d] += f[3 * i + d];
      moment[d] += x[3 * i + e] * f[3 * i + g] - x[3 * i + g] * f[3 * i + e];
    }
}

typedef struct watch {
  const flesh_scene *scene;
  int rows;
  double momentum[MOST_ROWS][3], load[MOST_ROWS][3], load_moment[MOST_ROWS][3];
  double rate_moment[MOST_ROWS][3]; /* moment of M (v - previous v) / h */
  double *v_before, *r;
} watch;

/* Computes momenta with the effect of inertia, and minus the loads. */
static int look(void *data, const flesh_step_record *record)
{
  watch *w = data;
  const flesh_state *state = record->state;
  const int n = flesh_system_unknowns(record->system), k = w->rows++;
  double *a = calloc((size_t)n, sizeof *a), unused[3];
  if (!a || k >= MOST_ROWS) abort();
  flesh_point point = flesh_point_at(state->t, state->x, state->v, a);
  CHECK_OK(flesh_system_load(record->system, &point, w->r));
  sum(n, state->x, w->r, w->load[k], w->load_moment[k]);
  for (int e = 0; e < flesh_system_effect_count(record->system); e++) {
    const flesh_effect *inertia = flesh_system_effect(record->system, e);
    if (inertia->operations->role != FLESH_ROLE_INERTIA) continue;
    point.a = state->v;
    memset(w->r, 0, (size_t)n * sizeof *w->r);
    CHECK_OK(inertia->operations->residual(inertia, &point, w->r));
    sum(n, state->x, w->r, w->momentum[k], unused);
    point.a = a;
    for (int d = 0; d < n; d++) a[d] = record->h > 0 ? (state->v[d] - w->v_before[d]) / record->h : 0;
    memset(w->r, 0, (size_t)n * sizeof *w->r);
    CHECK_OK(inertia->operations->residual(inertia, &point, w->r));
    sum(n, state->x, w->r, unused, w->rate_moment[k]);
  }
  memcpy(w->v_before, state->v, (size_t)n * sizeof *a);
  free(a);
  return FLESH_OK;
}

/* Runs a scene of that text and reads its probes.csv before it is closed. */
static void run(const char *text, const char *element, watch *w)
{
  char set[64];
  const char *const overrides[] = {set};
  flesh_scene *scene;
  flesh_integrator *integrator;
  flesh_probes *probes;
  int count;
  snprintf(set, sizeof set, "body.element=%s", element);
  CHECK_OK(read_scene("probed.yaml", text, 1, overrides, &scene));
  const flesh_scene_time *time = flesh_scene_times(scene);
  const flesh_system *system = flesh_scene_system(scene);
  const size_t n = (size_t)flesh_system_unknowns(system);
  const flesh_probe *given = flesh_scene_probes(scene, &count);
  *w = (watch){.scene = scene, .v_before = calloc(n, sizeof(double)), .r = calloc(n, sizeof(double))};
  flesh_state state = {.x = calloc(n, sizeof(double)), .v = calloc(n, sizeof(double))};
  flesh_scene_start(scene, &state);
  CHECK_OK(flesh_integrator_create(system, time->method, flesh_scene_solver(scene), &integrator));
  CHECK_OK(flesh_integrator_set_adaptive(integrator, &time->adaptive));
  CHECK_OK(flesh_integrator_set_method_options(integrator, &time->options));
  CHECK_OK(flesh_probes_create(file_path("probes.csv"), flesh_scene_body(scene), system, time->method, count, given,
                               &probes));
  const flesh_observer observers[] = {{flesh_probes_observe, probes}, {look, w}};
  CHECK_OK(flesh_run(system, integrator, &(flesh_run_options){time->step, time->end, 2, observers, NULL, NULL, NULL},
                     &state, NULL));
  read_table(file_path("probes.csv"));
  CHECK(row_count == w->rows);
  CHECK_OK(flesh_probes_close(&probes));
  flesh_integrator_destroy(&integrator);
  flesh_scene_destroy(&scene);
  free(w->v_before);
  free(w->r);
  free(state.x);
  free(state.v);
}

#define BODY(mass)                                                                         \
  "body: {mesh: bar.node, density: 1000, mass: " mass ",\n"                                \
  "       material: {energy: S, constants: matched, young: 4e5, poisson: 0.45}}\n"
#define LOADS                                                                              \
  "  - gravity: {acceleration: [0, 2, -9.81]}\n"                                           \
  "  - force: {force: [300, 0, 100], box: [[3.9, -1, 0.9], [5, 2, 2]]}\n"
#define SOLVER "solver: {newton_tolerance: 1e-11}\n"
#define PROBES                                                                             \
  "output: {probes: [{name: clamp, box: [[-1, -1, -1], [1e-9, 2, 2]], quantities: [reaction], about: [0, 0, 0]}]}\n"

/* Reactions of one pin, and of a pin and a prescribed motion together. */
static void reactions_balance_loads_in_statics(void)
{
  static const char *const scenes[] = {
      BODY("lumped") "effects:\n" LOADS "  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}\n" SOLVER PROBES,
      BODY("lumped") "effects:\n" LOADS "  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]], axes: [x, y, z]}\n"
                     "  - prescribed_motion: {box: [[3.9, -1, -1], [5, 2, 0.1]], axes: [z],\n"
                     "                         motion: [{time: 0}, {time: 1, translation: [0, 0, 0.3]}]}\n"
                     "time: {end: 1, step: 1}\n" SOLVER
                     "output: {probes: [{name: clamp, box: [[-1, -1, -1], [5, 2, 2]], quantities: [reaction],\n"
                     "                   about: [0, 0, 0]}]}\n"};
  for (int s = 0; s < 2; s++)
    for (int e = 0; e < ELEMENTS; e++) {
      watch w;
      double force[3], moment[3];
      run(scenes[s], elements[e], &w);
      const int last = w.rows - 1;
      CHECK(last > 0);
      vector_at(last, "clamp.reaction", "N", force);
      vector_at(last, "clamp.reaction_moment", "N m", moment);
      for (int d = 0; d < 3; d++) {
        CHECK_NEAR(force[d], w.load[last][d], 1e-5); /* of 4e4 N */
        CHECK_NEAR(moment[d], w.load_moment[last][d], 1e-4);
      }
      CHECK_NEAR(w.load[last][2], 4000 * 9.81 - w.load[last][0] / -3, 1e-6);
    }
}

/* Backward Euler solves for M (v_1 - v_0)/h at the end of its step: the balance is exact there. */
static void reactions_balance_inertia_in_motion(void)
{
  static const char *const scenes[] = {
      BODY("lumped") "effects:\n  - inertia: {}\n" LOADS "  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}\n"
                     "time: {method: backward-euler, step: 1/50, end: 1/10}\n" SOLVER PROBES,
      BODY("consistent") "effects:\n  - inertia: {}\n" LOADS "  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}\n"
                         "time: {method: backward-euler, step: 1/50, end: 1/10}\n" SOLVER PROBES};
  for (int s = 0; s < 2; s++)
    for (int e = 0; e < ELEMENTS; e++) {
      watch w;
      run(scenes[s], elements[e], &w);
      CHECK(w.rows == 6);
      for (int k = 1; k < w.rows; k++) {
        double force[3], moment[3];
        vector_at(k, "clamp.reaction", "N", force);
        vector_at(k, "clamp.reaction_moment", "N m", moment);
        for (int d = 0; d < 3; d++) {
          CHECK_NEAR(force[d], w.load[k][d] + 50 * (w.momentum[k][d] - w.momentum[k - 1][d]), 1e-5);
          CHECK_NEAR(moment[d], w.load_moment[k][d] + w.rate_moment[k][d], 1e-4);
        }
      }
    }
}

/* The trapezoidal sum of forces agrees with the momentum: exactly for the trapezoidal rule (newmark), and to second
 * order for the others. */
static void reactions_balance_momentum_for_every_method(void)
{
  static const struct {
    const char *time;
    double tolerance; /* N s, of 3e3 */
  } methods[] = {{"newmark", 1e-7}, {"midpoint", 0.05}, {"bdf2", 0.3}, {"hht", 0.1}, {"ida", 0.1}};
  for (size_t m = 0; m < sizeof methods / sizeof *methods; m++)
    for (int consistent = 0; consistent < 2; consistent++) {
      char text[2000];
      watch w;
      double change[3] = {0};
      snprintf(text, sizeof text,
               "%seffects:\n  - inertia: {}\n" LOADS "  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}\n"
               "time: {method: %s, step: 1/400, end: 1/10}\n" SOLVER PROBES,
               consistent ? BODY("consistent") : BODY("lumped"), methods[m].time);
      run(text, elements[m % ELEMENTS], &w);
      CHECK(w.rows == 41);
      for (int k = 0; k < w.rows; k++) {
        double force[3];
        vector_at(k, "clamp.reaction", "N", force);
        for (int d = 0; d < 3; d++)
          change[d] += (force[d] - w.load[k][d]) / 400 * (k && k < w.rows - 1 ? 1 : 0.5);
      }
      for (int d = 0; d < 3; d++) {
        const double momentum = w.momentum[w.rows - 1][d];
        printf("# %s %d: %g of %g\n", methods[m].time, d, change[d] - momentum, momentum);
        CHECK_NEAR(change[d], momentum, methods[m].tolerance);
      }
    }
}

/* Returns the largest difference of reactions and loads with inertia, N, by backward Euler with a tension that depends
 * on the speed; *largest: the largest reaction, N. */
static double departure_of(int steps, double *largest)
{
  char text[2000];
  watch w;
  double departure = 0;
  snprintf(text, sizeof text,
           BODY("lumped") "effects:\n  - inertia: {}\n" LOADS "  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}\n"
           "  - muscle: {fibres: {direction: [1, 0.2, 0]}, peak_stress: 1e5, max_shortening_velocity: 4}\n"
           "time: {method: backward-euler, step: 1/%d, end: 1/10}\n" SOLVER PROBES, 10 * steps);
  run(text, "tet4", &w);
  *largest = 0;
  for (int k = 1; k < w.rows; k++) {
    double force[3];
    vector_at(k, "clamp.reaction", "N", force);
    for (int d = 0; d < 3; d++) {
      const double rate = 10 * steps * (w.momentum[k][d] - w.momentum[k - 1][d]);
      departure = fmax(departure, fabs(force[d] - w.load[k][d] - rate));
      *largest = fmax(*largest, fabs(force[d]));
    }
  }
  printf("# %d steps: off by %.4g of %.4g N\n", steps, departure, *largest);
  return departure;
}

/* Reactions use the speed at the end of a step, backward Euler the mean speed over the step. */
static void tension_by_the_speed_is_balanced_to_first_order(void)
{
  double off[3], largest;
  for (int k = 0; k < 3; k++) off[k] = departure_of(10 << k, &largest);
  CHECK(off[0] > 1e-4 * largest); /* the tension must matter */
  CHECK(log2(off[0] / off[2]) / 2 > 0.8);
}

static void contact_forces_balance_what_falls(void)
{
  static const char scene[] =
      BODY("lumped") "effects:\n  - inertia: {}\n  - gravity: {}\n  - contact: {plane: {point: [0, 0, -0.01]}}\n"
                     "time: {method: backward-euler, step: 1/50, end: 1/5}\n" SOLVER
                     "output: {probes: [{name: all, box: [[-1, -1, -1], [5, 2, 2]],\n"
                     "                   quantities: [contact_force, reaction], about: [0, 0, 0]}]}\n";
  for (int e = 0; e < ELEMENTS; e++) {
    watch w;
    double largest = 0;
    run(scene, elements[e], &w);
    for (int k = 1; k < w.rows; k++) {
      double force[3], moment[3], reaction[3];
      vector_at(k, "all.contact_force", "N", force);
      vector_at(k, "all.contact_moment", "N m", moment);
      vector_at(k, "all.reaction", "N", reaction);
      for (int d = 0; d < 3; d++) {
        CHECK_NEAR(force[d], w.load[k][d] + 50 * (w.momentum[k][d] - w.momentum[k - 1][d]), 1e-4);
        CHECK_NEAR(moment[d], w.load_moment[k][d] + w.rate_moment[k][d], 1e-3);
        CHECK(reaction[d] == 0);
      }
      largest = fmax(largest, force[2]);
    }
    CHECK(largest > 4000 * 9.81);
  }
}

/* Adds a probe's force and moment to the sums. */
static void add_forces(int row, const char *probe, const char *quantity, const char *moment_name, double sums[6])
{
  char name[96];
  double value[3];
  snprintf(name, sizeof name, "%s.%s", probe, quantity);
  vector_at(row, name, "N", value);
  for (int d = 0; d < 3; d++) sums[d] += value[d];
  snprintf(name, sizeof name, "%s.%s", probe, moment_name);
  vector_at(row, name, "N m", value);
  for (int d = 0; d < 3; d++) sums[3 + d] += value[d];
}

#define HOLDERS                                                                                                       \
  "  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}\n"                                                                   \
  "  - pin: {box: [[-1, -1, -1], [1e-9, 2, 0.1]], axes: [x]}\n"                                                      \
  "  - prescribed_motion: {box: [[3.9, -1, -1], [5, 2, 0.1]], axes: [y, z],\n"                                       \
  "                         motion: [{time: 0}, {time: 1, translation: [0, 0.1, 0.5]}]}\n"
#define TOUCHED                                                                                                       \
  "  - contact: {plane: {point: [0, 0, -0.01]}}\n"                                                                   \
  "  - contact: {sphere: {centre: [2, 0.5, 1.52], radius: 0.5},\n"                                                   \
  "              motion: [{time: 0}, {time: 1, translation: [0, 0, -2]}]}\n"
#define OF_EACH                                                                                                       \
  "output:\n  reactions: true\n"                                                                                     \
  "  probes:\n    - {name: low, box: [[-1, -1, -1], [1e-9, 2, 0.1]], quantities: [reaction], about: [0, 0, 0]}\n"    \
  "    - {name: far, effect: prescribed_motion, quantities: [reaction, position], about: [4, 0, 0]}\n"

/* Reactions of every pin, prescribed motion and contact separately; together they balance loads and inertia, about one
 * point. */
static void each_bears_its_own_and_together_they_balance(void)
{
  static const char *const scenes[] = {
      BODY("lumped") "effects:\n" LOADS HOLDERS "time: {end: 1, step: 1}\n" SOLVER OF_EACH,
      BODY("lumped") "effects:\n  - inertia: {}\n" LOADS HOLDERS TOUCHED
                     "time: {method: backward-euler, step: 1/50, end: 1/5}\n" SOLVER OF_EACH};
  for (int s = 0; s < 2; s++)
    for (int e = 0; e < ELEMENTS; e++) {
      watch w;
      double largest[2] = {0};
      run(scenes[s], elements[e], &w);
      /* The prescribed motion begins with a jump of its velocity: an impulse in the first step, which no row shows. */
      for (int k = s ? 2 : 1; k < w.rows; k++) {
        double sums[6] = {0}, far[3], motion[3], far_moment[3], motion_moment[3];
        add_forces(k, "pin", "reaction", "reaction_moment", sums);
        add_forces(k, "pin_2", "reaction", "reaction_moment", sums);
        add_forces(k, "prescribed_motion", "reaction", "reaction_moment", sums);
        if (s) add_forces(k, "contact", "contact_force", "contact_moment", sums);
        if (s) add_forces(k, "contact_2", "contact_force", "contact_moment", sums);
        for (int d = 0; d < 3; d++) {
          const double change = s ? 50 * (w.momentum[k][d] - w.momentum[k - 1][d]) : 0;
          CHECK_NEAR(sums[d], w.load[k][d] + change, 2e-4);
          CHECK_NEAR(sums[3 + d], w.load_moment[k][d] + (s ? w.rate_moment[k][d] : 0), 2e-3);
        }
        /* Components that both hold: the second pin bears only x, and the first the rest. */
        CHECK_NEAR(at(k, "pin_2.reaction_x [N]"), at(k, "low.reaction_x [N]"), 1e-9);
        CHECK(at(k, "pin_2.reaction_y [N]") == 0 && fabs(at(k, "low.reaction_y [N]")) > 1);
        vector_at(k, "far.reaction", "N", far);
        vector_at(k, "prescribed_motion.reaction", "N", motion);
        vector_at(k, "far.reaction_moment", "N m", far_moment);
        vector_at(k, "prescribed_motion.reaction_moment", "N m", motion_moment);
        CHECK(far[0] == 0 && !memcmp(far, motion, sizeof far));
        CHECK_NEAR(far_moment[1], motion_moment[1] + 4 * far[2], 1e-7); /* (y - (4,0,0)) x f */
        CHECK_NEAR(far_moment[2], motion_moment[2] - 4 * far[1], 1e-7);
        if (s) largest[0] = fmax(largest[0], at(k, "contact.contact_force_z [N]"));
        if (s) largest[1] = fmin(largest[1], at(k, "contact_2.contact_force_z [N]"));
      }
      CHECK(!s || (largest[0] > 1e4 && largest[1] < -1e3));
    }
}

/* A fully constrained body moves as prescribed: R = m (a - g). */
static void what_is_wholly_held_needs_the_force_of_its_motion(void)
{
  watch w;
  double force[3];
  run(BODY("consistent") "effects:\n  - inertia: {}\n  - gravity: {}\n"
      "  - prescribed_motion: {box: [[-1, -1, -1], [5, 2, 2]], interpolation: smooth,\n"
      "                         motion: [{time: 0}, {time: 1, translation: [0.5, 0, 0]}]}\n"
      "time: {method: newmark, step: 1/8, end: 1/2}\n" SOLVER
      "output: {probes: [{name: all, box: [[-1, -1, -1], [5, 2, 2]], quantities: [reaction, position]}]}\n",
      "tet4", &w);
  for (int k = 0; k < w.rows; k++) {
    const double t = k / 8.;
    vector_at(k, "all.reaction", "N", force);
    CHECK_NEAR(force[0], 4000 * 0.5 * (6 - 12 * t), 1e-7); /* x = (3 t^2 - 2 t^3)/2 */
    CHECK_NEAR(force[2], 4000 * 9.81, 1e-6);
    CHECK_NEAR(at(k, "all.position_x [m]"), 2 + 0.5 * t * t * (3 - 2 * t), 1e-12);
  }
}

#define STRAIN                                                                                              \
  "effects:\n  - elasticity: {}\n"                                                                           \
  "output:\n  probes:\n"                                                                                     \
  "    - {name: p, point: [1.3, 0.4, 0.7], quantities: [position, velocity, J, stretch, stress, energy]}\n"  \
  "    - {name: all, box: [[-1, -1, -1], [5, 2, 2]], quantities: [position, J, stretch, stress, energy]}\n"

/* Opens a scene, lets the probes see x = move(X), v = 2 x, and reads the row. */
typedef struct seen {
  flesh_scene *scene;
  const flesh_system *system;
  int n;
  double *x, *v, *r, *multipliers, energy, rest_energy;
} seen;

static void see(const char *text, const char *element, void (*move)(const double X[3], double x[3]), seen *s)
{
  char set[64];
  const char *const overrides[] = {set};
  flesh_probes *probes;
  int count;
  snprintf(set, sizeof set, "body.element=%s", element);
  CHECK_OK(read_scene("seen.yaml", text, 1, overrides, &s->scene));
  s->system = flesh_scene_system(s->scene);
  s->n = flesh_system_unknowns(s->system);
  const size_t n = (size_t)s->n;
  const double *X = flesh_mesh_positions(flesh_scene_mesh(s->scene));
  const int held = flesh_system_multiplier_count(s->system);
  s->x = calloc(n, sizeof(double)), s->v = calloc(n, sizeof(double)), s->r = calloc(n, sizeof(double));
  s->multipliers = held ? calloc((size_t)held, sizeof(double)) : NULL;
  for (int i = 0; i < s->n; i += 3) move(X + i, s->x + i);
  for (int d = 0; d < s->n; d++) s->v[d] = 2 * s->x[d];
  for (int k = 0; k < held; k++) s->multipliers[k] = 1e4 * sin(k);
  const flesh_state state = {.x = s->x, .v = s->v, .multipliers = s->multipliers, .multiplier_count = held};
  const flesh_step_record record = {.system = s->system, .state = &state, .stage = &state};
  const flesh_probe *given = flesh_scene_probes(s->scene, &count);
  CHECK(count == 2);
  CHECK_OK(flesh_probes_create(file_path("seen.csv"), flesh_scene_body(s->scene), s->system, FLESH_METHOD_STATIC, count,
                               given, &probes));
  CHECK_OK(flesh_probes_observe(probes, &record));
  CHECK_OK(flesh_probes_close(&probes));
  read_table(file_path("seen.csv"));
  flesh_point point = flesh_point_at(0, s->x, s->v, s->v);
  point.multipliers = s->multipliers;
  CHECK_OK(flesh_system_residual(s->system, &point, s->r));
  CHECK_OK(flesh_system_energies(s->system, &point, &s->energy));
  point = flesh_point_at(0, X, s->v, s->v);
  CHECK_OK(flesh_system_energies(s->system, &point, &s->rest_energy));
}

static void forget(seen *s)
{
  flesh_scene_destroy(&s->scene);
  free(s->x);
  free(s->v);
  free(s->r);
  free(s->multipliers);
}

static const double A[9] = {1.2, 0.3, -0.1, 0.05, 0.9, 0.2, 0.1, -0.15, 1.1};

static void affine(const double X[3], double x[3])
{
  for (int i = 0; i < 3; i++) x[i] = 0.5 * i + A[3 * i] * X[0] + A[3 * i + 1] * X[1] + A[3 * i + 2] * X[2];
}

static void bent(const double X[3], double x[3])
{
  affine(X, x);
  x[0] += 0.06 * sin(2 * X[1]) * X[0], x[1] += 0.05 * cos(3 * X[2]) * X[0], x[2] += 0.04 * X[0] * X[0];
}

static const char *const stresses[] = {"xx", "yy", "zz", "xy", "yz", "xz"};
static const int stress_row[] = {0, 1, 2, 0, 1, 0}, stress_column[] = {0, 1, 2, 1, 2, 2};

static void a_uniform_strain_is_what_the_material_says(void)
{
  for (int e = 0; e < ELEMENTS; e++) {
    seen s = {0};
    see(BODY("lumped") STRAIN, elements[e], affine, &s);
    const flesh_material *material = flesh_scene_body(s.scene)->materials;
    const double p[3] = {1.3, 0.4, 0.7}, unit[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    double P[9], psi, rest, where[3], trace = 0, norm = 0;
    const double J = A[0] * (A[4] * A[8] - A[5] * A[7]) - A[1] * (A[3] * A[8] - A[5] * A[6]) +
                     A[2] * (A[3] * A[7] - A[4] * A[6]);
    CHECK_OK(flesh_material_stress(material, A, P));
    CHECK_OK(flesh_material_energy(material, A, &psi));
    CHECK_OK(flesh_material_energy(material, unit, &rest));
    affine(p, where);
    for (int d = 0; d < 9; d++) norm += A[d] * A[d];
    for (int k = 0; k < 3; k++) {
      char name[64];
      snprintf(name, sizeof name, "p.position_%c [m]", 'x' + k);
      CHECK_NEAR(at(0, name), where[k], 1e-13);
      snprintf(name, sizeof name, "p.velocity_%c [m/s]", 'x' + k);
      CHECK_NEAR(at(0, name), 2 * where[k], 1e-13);
      snprintf(name, sizeof name, "p.stretch_%d [1]", k + 1);
      trace += at(0, name) * at(0, name);
    }
    CHECK_NEAR(trace, norm, 1e-12);
    CHECK_NEAR(at(0, "p.stretch_1 [1]") * at(0, "p.stretch_2 [1]") * at(0, "p.stretch_3 [1]"), J, 1e-12);
    CHECK_NEAR(at(0, "p.J [1]"), J, 1e-12);
    CHECK_NEAR(at(0, "all.J_mean [1]"), J, 1e-12);
    CHECK_NEAR(at(0, "p.energy [J/m^3]"), psi - rest, 1e-8);
    CHECK_NEAR(at(0, "all.energy [J]"), 4 * (psi - rest), 1e-8);
    for (int k = 0; k < 6; k++) {
      const int i = stress_row[k], j = stress_column[k];
      const double sigma = (P[3 * i] * A[3 * j] + P[3 * i + 1] * A[3 * j + 1] + P[3 * i + 2] * A[3 * j + 2]) / J;
      char name[64];
      snprintf(name, sizeof name, "p.stress_%s [Pa]", stresses[k]);
      CHECK_NEAR(at(0, name), sigma, 1e-6);
      snprintf(name, sizeof name, "all.stress_%s [Pa]", stresses[k]);
      CHECK_NEAR(at(0, name), sigma, 1e-6);
    }
    forget(&s);
  }
}

/* For any strain, the energy is the effect's, and the mean stress is that of its forces, integral of sigma dV = sum of
 * r_i x_i^T (Gauss). */
static void energy_and_mean_stress_are_those_of_the_forces(void)
{
  static const char *const bodies[] = {
      BODY("lumped") STRAIN,
      "body: {mesh: bar.node, density: 1000, material: {energy: Neo, young: 4e5, poisson: 0.49}}\n" STRAIN,
      "body: {mesh: bar.node, density: 1000, material: {energy: StVK, young: 4e5, poisson: 0.3}}\n" STRAIN,
      "body: {mesh: bar.node, density: 1000, material: {energy: B, young: 4e5, poisson: 0.5}}\n" STRAIN};
  for (int b = 0; b < 4; b++)
    for (int e = b == 3 ? 2 : 0; e < ELEMENTS; e++) {
      seen s = {0};
      see(bodies[b], elements[e], bent, &s);
      CHECK_NEAR(at(0, "all.energy [J]"), s.energy - s.rest_energy, 1e-7);
      for (int k = 0; k < 6; k++) {
        double total = 0;
        char name[64];
        for (int i = 0; i < s.n; i += 3) total += s.r[i + stress_row[k]] * s.x[i + stress_column[k]];
        snprintf(name, sizeof name, "all.stress_%s [Pa]", stresses[k]);
        CHECK_NEAR(at(0, name) * at(0, "all.J_mean [1]") * 4, total, 1e-4);
      }
      forget(&s);
    }
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  write_bar();
  int failed = RUN_TESTS(
      argc, argv, TEST(reactions_balance_loads_in_statics), TEST(reactions_balance_inertia_in_motion),
      TEST(reactions_balance_momentum_for_every_method), TEST(tension_by_the_speed_is_balanced_to_first_order),
      TEST(contact_forces_balance_what_falls),
      TEST(each_bears_its_own_and_together_they_balance),
      TEST(what_is_wholly_held_needs_the_force_of_its_motion), TEST(a_uniform_strain_is_what_the_material_says),
      TEST(energy_and_mean_stress_are_those_of_the_forces));
  test_folder_remove(folder);
  return failed;
}
