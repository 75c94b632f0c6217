// TEST full memory seconds=90
/* test_separation.c: bodies that intersect at the start and may separate: nothing touches at these places until they
 * are apart, everything else does; then they touch like bodies that never intersected, in any order, with any number of
 * threads, and in resumed runs. */
#include "scene_files.h"

#include "flesh/observer.h"
#include "time/integrator.h"
#include "touching.h"

#define CUBE "mesh: ../meshes/cube_3x3x3.mesh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.3}"

/* Cubes of 0.1 m: the lower one and a neighbour 1.2 mm beside it, within the barrier, both on plates; and the upper
 * one, which a plate holds and moves up and down, starting at `from`, where it intersects the lower one. */
static const char *scene_of(const char *method, double from, double up, double down, int swapped)
{
  static char text[2400];
  const char *const lower = "name: lower, " CUBE, *const side = "name: side, " CUBE ", translation: [0.1012, 0, 0]";
  const double end = strcmp(method, "static") ? 0.3 : 16;
  char upper[400];
  snprintf(upper, sizeof upper, "name: upper, " CUBE ", translation: [-0.02, 0.012, %.17g], rotation: [0, 0, 0.2]", from);
  snprintf(text, sizeof text,
           "body: {%s}\nbodies: [{%s}, {%s}]\neffects:\n  - inertia: {}\n"
           "  - contact: {between: all, intersecting: separate, thickness: 0.002}\n"
           "  - pin: {body: lower, box: [[-1, -1, -1], [1, 1, 1e-4]]}\n"
           "  - pin: {body: side, box: [[-1, -1, -1], [1, 1, 1e-4]]}\n"
           "  - prescribed_motion: {body: upper, box: [[-1, -1, %.17g], [1, 1, 1]],\n"
           "      motion: [{time: 0}, {time: %g, translation: [0, 0, %g]}, {time: %g, translation: [0, 0, %g]}]}\n"
           "time: {method: %s, step: %g, end: %g}\nsolver: {newton_tolerance: 1e-9}\n",
           lower, swapped ? upper : side, swapped ? side : upper, from + 0.0999, end / 2, up, end, down,
           method, end / 16, end);
  return text;
}

static const double inside = 0.067, above = 0.11;

/* Counts the intersections of the edges of one body with the faces of the other, and vice versa. */
static int crossings_between(const touching *m, int body, int other)
{
  const flesh_contact_surface *s = &m->surface;
  int found = 0;
  for (int e = 0; e < s->edge_count; e++)
    for (int f = 0; f < s->face_count; f++) {
      const int of_edge = s->node_body[s->node_place[s->edges[2 * e]]],
                of_face = s->node_body[s->node_place[s->faces[3 * f]]];
      if (!((of_edge == body && of_face == other) || (of_edge == other && of_face == body))) continue;
      crossings_box a, b;
      crossings_bound(2, s->edges + 2 * e, m->state.x, &a);
      crossings_bound(3, s->faces + 3 * f, m->state.x, &b);
      int apart = 0;
      for (int c = 0; c < 3; c++) apart |= a.low[c] > b.high[c] || b.low[c] > a.high[c];
      found += !apart && crossings_meet(s, m->state.x, e, f);
    }
  return found;
}

static int step(touching *m)
{
  flesh_solve_stats stats = {0};
  const int status = flesh_integrator_step(m->integrator, &m->state, m->h, &stats);
  m->newton += stats.newton;
  return status;
}

static flesh_separation separation_of(const touching *m) { return flesh_integrator_separation(m->integrator); }

/* Statics: moved up by 60 mm they come apart, moved down again by 5 mm they touch, and end like cubes that never
 * intersected. The neighbour is pushed away all the time. */
static void what_is_apart_touches_again(void)
{
  touching m, other;
  int apart = 0;
  CHECK_OK(touching_begin(scene_of("static", inside, 0.06, 0.028, 0), NULL, 1000, &m));
  CHECK(crossings_between(&m, 0, 2) > 10 && crossings_between(&m, 0, 1) == 0);
  for (int k = 0; k < 16; k++) {
    double contact;
    CHECK_OK(step(&m));
    const flesh_separation at = separation_of(&m);
    const int crossings = crossings_between(&m, 0, 2);
    printf("# step %d: %d places, %d pairs of patches ignored\n", k, crossings, at.ignored);
    CHECK(at.begun == 1 && (at.ignored == 1 || !crossings) && !(apart && at.ignored));
    if (at.ignored) CHECK(isnan(at.t_apart));
    else if (!apart) CHECK(at.t_apart == m.state.t);
    apart = !at.ignored;
    CHECK(crossings_between(&m, 0, 1) == 0);
    touching_energy(&m, &contact);
    CHECK(contact > 0);
  }
  CHECK(apart && !crossings_between(&m, 0, 2));
  CHECK_OK(touching_begin(scene_of("static", above, above - inside, -0.015, 0), NULL, 1000, &other));
  for (int k = 0; k < 16; k++) CHECK_OK(step(&other));
  CHECK(separation_of(&other).begun == 0);
  double most = 0, gap = INFINITY;
  for (int d = 0; d < m.n; d++) most = fmax(most, fabs(m.state.x[d] - other.state.x[d]));
  for (int i = 0; i < m.n / 3; i++)
    if (m.surface.node_body[m.surface.node_place[i] < 0 ? 0 : m.surface.node_place[i]] == 2)
      gap = fmin(gap, m.state.x[3 * i + 2]);
  printf("# the upper cube ends at %.6g m, %.2g m from where it ends when it comes from above\n", gap, most);
  CHECK_BELOW(gap, 0.1); /* both are pressed */
  CHECK_BELOW(most, 1e-8);
  touching_end(&m);
  touching_end(&other);
}

/* In motion; with the upper cube before its neighbour, and with several threads. */
static void order_and_threads_do_not_matter(void)
{
  touching m, swapped, shared;
  const char *const one[] = {"solver.threads=1", NULL}, *const four[] = {"solver.threads=4", NULL};
  CHECK_OK(touching_begin(scene_of("backward-euler", inside, 0.06, 0.028, 0), one, 1000, &m));
  CHECK_OK(touching_begin(scene_of("backward-euler", inside, 0.06, 0.028, 0), four, 1000, &shared));
  CHECK_OK(touching_begin(scene_of("backward-euler", inside, 0.06, 0.028, 1), one, 1000, &swapped));
  const int each = m.n / 3;
  double most = 0;
  CHECK(crossings_between(&swapped, 0, 1) == crossings_between(&m, 0, 2) && !crossings_between(&swapped, 0, 2));
  for (int k = 0; k < 16; k++) {
    CHECK_OK(step(&m));
    CHECK_OK(step(&shared));
    CHECK_OK(step(&swapped));
    CHECK(separation_of(&m).ignored == separation_of(&swapped).ignored);
  }
  CHECK(separation_of(&m).t_apart == separation_of(&swapped).t_apart && !separation_of(&m).ignored);
  CHECK(!memcmp(m.state.x, shared.state.x, (size_t)m.n * sizeof(double)));
  for (int d = 0; d < m.n; d++) {
    const int there = d < each ? d : d < 2 * each ? d + each : d - each;
    most = fmax(most, fabs(m.state.x[d] - swapped.state.x[there]));
  }
  printf("# by %.2g m with the bodies in another order\n", most);
  CHECK_BELOW(most, 1e-7);
  touching_end(&m);
  touching_end(&shared);
  touching_end(&swapped);
}

/* Resumes from step `cut` with the saved data; the end is that of the whole run. */
static void go_on(const touching *whole, int cut, const double *state, const char *saved, size_t size)
{
  touching m;
  CHECK_OK(touching_begin(scene_of("backward-euler", inside, 0.0675, 0.028, 0), NULL, 1000, &m));
  CHECK_OK(flesh_integrator_load(m.integrator, saved, size));
  memcpy(m.state.x, state, (size_t)m.n * sizeof(double));
  memcpy(m.state.v, state + m.n, (size_t)m.n * sizeof(double));
  m.state.t = state[2 * m.n];
  for (int k = cut; k < 16; k++) CHECK_OK(step(&m));
  CHECK(!memcmp(m.state.x, whole->state.x, (size_t)m.n * sizeof(double)));
  CHECK(separation_of(&m).begun == 1 && separation_of(&m).t_apart == separation_of(whole).t_apart);
  touching_end(&m);
}

/* Interrupted soon after the start, at the end, and where the surfaces are apart but nearer than the thickness. */
static void a_run_goes_on_where_it_was_cut(void)
{
  enum { MOST = 8 };
  touching m;
  int cuts[MOST], count = 0, near = 0;
  char *saved[MOST];
  double *states[MOST];
  size_t sizes[MOST];
  CHECK_OK(touching_begin(scene_of("backward-euler", inside, 0.0675, 0.028, 0), NULL, 1000, &m));
  for (int k = 1; k <= 16; k++) {
    CHECK_OK(step(&m));
    const int is_near = separation_of(&m).ignored && !crossings_between(&m, 0, 2);
    near += is_near;
    if ((k != 2 && k != 12 && !is_near) || count == MOST) continue;
    cuts[count] = k;
    CHECK_OK(flesh_integrator_save(m.integrator, 0, NULL, &sizes[count]));
    saved[count] = malloc(sizes[count]);
    CHECK_OK(flesh_integrator_save(m.integrator, sizes[count], saved[count], &sizes[count]));
    states[count] = malloc((2 * (size_t)m.n + 1) * sizeof *states[count]);
    memcpy(states[count], m.state.x, (size_t)m.n * sizeof(double));
    memcpy(states[count] + m.n, m.state.v, (size_t)m.n * sizeof(double));
    states[count++][2 * m.n] = m.state.t;
  }
  CHECK(near > 0 && count > 2 && !separation_of(&m).ignored);
  for (int k = 0; k < count; k++) {
    go_on(&m, cuts[k], states[k], saved[k], sizes[k]);
    free(saved[k]);
    free(states[k]);
  }
  touching_end(&m);
}

/* Returns the text of a file, allocated. */
static char *text_of(const char *path)
{
  FILE *file = fopen(path, "rb");
  char *text = calloc(1, 1 << 16);
  if (file) {
    CHECK(fread(text, 1, (1 << 16) - 1, file) > 0);
    fclose(file);
  }
  return text;
}

/* Returns the last column of the history's row, counted from the start. */
static int ignored_in(const char *history, int row)
{
  const char *line = history;
  for (int k = 0; k <= row && line; k++) line = strchr(line, '\n') ? strchr(line, '\n') + 1 : NULL;
  const char *end = line ? strchr(line, '\n') : NULL;
  while (end && end > line && end[-1] != ',') end--;
  return end ? atoi(end) : -1;
}

/* The history has the run's own figures, although they are evaluated separately. */
static void histories_tell(void)
{
  touching m;
  flesh_history *history = NULL;
  CHECK_OK(touching_begin(scene_of("backward-euler", inside, 0.06, 0.028, 0), NULL, 1000, &m));
  const flesh_system *system = flesh_scene_system(m.scene);
  char *path = strdup(file_path("history.csv"));
  CHECK_OK(flesh_history_create(path, system, &history));
  const flesh_observer observer = {flesh_history_observe, history};
  const flesh_run_options run = {.h = m.h, .end = 0.3, .observer_count = 1, .observers = &observer};
  CHECK_OK(flesh_run(system, m.integrator, &run, &m.state, NULL));
  CHECK_OK(flesh_history_close(&history));
  const double t_apart = separation_of(&m).t_apart;
  char *text = text_of(path);
  CHECK_TEXT(text, "contact_gap,contact_pairs,contact_force,contact_ignored\n");
  for (int k = 0; k <= 16; k++) CHECK(ignored_in(text, k) == (k * m.h < t_apart - m.h / 2));
  free(text);
  free(path);
  touching_end(&m);
}

/* Without the option intersections are refused, and obstacles do not have the option. */
static void without_the_option_they_are_refused(void)
{
  touching m;
  CHECK_OK(touching_begin(scene_of("static", inside, 0.06, 0.028, 0), (const char *[]){"effects.contact.intersecting=refuse",
                          NULL}, 1000, &m));
  CHECK(flesh_system_check(flesh_scene_system(m.scene), 0, m.state.x) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "intersect: the edge of the nodes ");
  CHECK_TEXT(flesh_error_text(), "intersecting: separate");
  touching_end(&m);
  CHECK(touching_begin("body: {" CUBE "}\neffects: [inertia, contact: {plane: {point: [0, 0, -1]}, intersecting: separate}]\n"
                       "time: {method: static, step: 1, end: 1}\n", NULL, 1000, &m) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "intersecting applies to contact between bodies");
  if (m.scene) touching_end(&m);
  CHECK(touching_begin("body: {" CUBE "}\neffects: [inertia, contact: {plane: {point: [0, 0, -1]}, adaptive: true}]\n"
                       "time: {method: static, step: 1, end: 1}\n", NULL, 1000, &m) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "adaptive applies to contact between bodies; leave it out for an obstacle");
  if (m.scene) touching_end(&m);
}

/* A body with self-contact cannot leave these starts, which are refused: one that intersects itself, and one that is
 * inside out; a tangle inside it is accepted. */
static void tangled_starts_are_refused(void)
{
  touching m;
  unsigned long long state = 5;
  CHECK_OK(touching_begin("body: {" CUBE "}\neffects: [inertia, contact: {between: self}]\n"
                          "time: {method: backward-euler, step: 1/60, end: 1}\n", NULL, 1000, &m));
  const flesh_system *system = flesh_scene_system(m.scene);
  double *x = malloc((size_t)m.n * sizeof *x);
  CHECK_OK(flesh_system_check(system, 0, m.state.x));
  for (int d = 0; d < m.n; d++) x[d] = d % 3 == 0 ? 0.1 - m.state.x[d] : m.state.x[d];
  CHECK(flesh_system_check(system, 0, x) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "the body is inside out at the start, as at the triangle of the nodes ");
  for (int d = 0; d < m.n; d++) x[d] = 0.1 * test_uniform(&state);
  CHECK(flesh_system_check(system, 0, x) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "intersect");
  int inner = -1, inverted = 0;
  for (int i = 0; i < m.n / 3 && inner < 0; i++)
    if (m.surface.node_place[i] < 0) inner = i;
  memcpy(x, m.state.x, (size_t)m.n * sizeof *x);
  for (int c = 0; c < 3; c++) x[3 * inner + c] += x[3 * inner + c] < 0.05 ? 0.05 : -0.05;
  flesh_mesh_jacobians(flesh_scene_mesh(m.scene), x, NULL, NULL, &inverted);
  CHECK(inverted > 0);
  CHECK_OK(flesh_system_check(system, 0, x));
  free(x);
  touching_end(&m);
}

/* A bar stuck obliquely into another is drawn straight out: the intersection wanders over the surface, and nothing
 * holds or strains the bar. */
static void what_is_drawn_out_aslant_is_not_held(void)
{
  touching m;
  int steps = 0;
  CHECK_OK(touching_begin(
      "body: {name: base, mesh: ../meshes/bar_16x4x4.mesh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.3}}\n"
      "bodies: [{name: slant, mesh: ../meshes/bar_16x4x4.mesh, translation: [1.3, 0.1, 0.21], rotation: [0, -0.9, 0]}]\n"
      "effects:\n  - inertia: {}\n  - contact: {between: all, intersecting: separate}\n"
      "  - pin: {body: base, box: [[-1, -1, -1], [9, 9, 1e-4]]}\n"
      "  - prescribed_motion: {body: slant, box: [[-9, -9, 2], [9, 9, 9]], motion: [{time: 0}, {time: 20, translation: [0, "
      "0, 2]}]}\n"
      "time: {method: static, step: 1, end: 20}\nsolver: {newton_tolerance: 1e-8}\n", NULL, 1000, &m));
  CHECK(crossings_count(&m.surface, m.state.x) > 10);
  double *start = malloc((size_t)m.n * sizeof *start);
  memcpy(start, m.state.x, (size_t)m.n * sizeof *start);
  do {
    double most = 0;
    CHECK_OK(step(&m));
    for (int d = 0; d < m.n; d++) {
      const double moved = m.state.x[d] - start[d] - (d >= m.n / 2 && d % 3 == 2 ? 0.1 * m.state.t : 0);
      most = fmax(most, fabs(moved));
    }
    printf("# step %d: %d crossings, strained by %.2g m\n", steps, crossings_count(&m.surface, m.state.x), most);
    CHECK_BELOW(most, 1e-6);
  } while (separation_of(&m).ignored && ++steps < 20);
  CHECK(steps > 5 && !separation_of(&m).ignored && crossings_count(&m.surface, m.state.x) == 0);
  free(start);
  touching_end(&m);
}

/* A bar stuck in another is thrown along it, so far in a step that it meets touching features around its patch: these
 * join the patch, and the energy of their contact is counted as removed. */
static void what_a_patch_takes_in_is_booked(void)
{
  touching m;
  double taken = 0;
  CHECK_OK(touching_begin(
      "body: {name: base, mesh: ../meshes/bar_16x4x4.mesh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.3}}\n"
      "bodies: [{name: thrown, mesh: ../meshes/bar_8x2x2.mesh, translation: [0.2, 0.1, 0.6], rotation: [0, -1.4, 0],\n"
      "          velocity: [40, 0, 0]}]\n"
      "effects:\n  - inertia: {}\n  - contact: {between: all, intersecting: separate}\n"
      "  - pin: {body: base, box: [[-1, -1, -1], [9, 9, 1e-4]]}\n"
      "time: {method: backward-euler, step: 1/60, end: 1}\nsolver: {newton_tolerance: 1e-6}\n", NULL, 1000, &m));
  const flesh_system *system = flesh_scene_system(m.scene);
  for (int k = 0; k < 6; k++) {
    double energies[8];
    CHECK_OK(step(&m));
    flesh_point point = flesh_point_at(m.state.t, m.state.x, m.state.v, m.state.v);
    point.environment = &m.integrator->evaluation->environment;
    CHECK_OK(flesh_system_energies(system, &point, energies));
    const double *told = flesh_integrator_energies(m.integrator, &m.state);
    const flesh_energy_balance *balance = flesh_integrator_energy_balance(m.integrator);
    for (int e = 0; told && e < m.effects; e++) CHECK_NEAR(told[e], energies[e], 1e-9 * balance->scale);
    CHECK(told != NULL);
    printf("# step %d: %.4g J of contact, %.4g J put in\n", k, energies[1], balance->supplied);
    taken = fmin(taken, balance->supplied);
  }
  CHECK(taken < 0);
  touching_end(&m);
}

/* A strip, curled so far that its ends intersect, springs open: they come apart, and touch from then on. */
static void a_curled_strip_springs_open(void)
{
  const double length = 2.4, turns = 2.2 * 3.14159265358979;
  char text[1000];
  flesh_mesh *mesh = NULL;
  touching m;
  CHECK_OK(flesh_mesh_box((int[]){24, 3, 1}, (double[]){length, 0.3, 0.1}, (double[]){0, 0, 0}, &mesh));
  CHECK_OK(flesh_mesh_write(mesh, file_path("strip.node")));
  flesh_mesh_destroy(&mesh);
  snprintf(text, sizeof text,
           "body: {mesh: %s, density: 1000, material: {energy: S, young: 1e5, poisson: 0.3}}\n"
           "effects: [inertia, contact: {between: self, intersecting: separate}]\n"
           "time: {method: backward-euler, step: 1/100, end: 1}\nsolver: {newton_tolerance: 1e-6}\n",
           file_path("strip.node"));
  CHECK_OK(touching_begin(text, NULL, 1000, &m));
  for (int i = 0; i < m.n / 3; i++) {
    double *x = m.state.x + 3 * i;
    const double angle = turns * x[0] / length, r = length / turns + 0.005 * angle + x[2] - 0.05;
    x[0] = r * cos(angle), x[2] = r * sin(angle), x[1] += 0.011 * angle;
  }
  CHECK(crossings_count(&m.surface, m.state.x) > 10);
  int steps = 0;
  do CHECK_OK(step(&m));
  while (separation_of(&m).ignored && ++steps < 40);
  const flesh_separation at = separation_of(&m);
  printf("# %d pairs of patches, apart at %g s\n", at.begun, at.t_apart);
  CHECK(at.begun > 0 && !at.ignored && at.t_apart == m.state.t);
  for (int k = 0; k < 3; k++) {
    CHECK(crossings_count(&m.surface, m.state.x) == 0);
    CHECK_OK(step(&m));
  }
  touching_end(&m);
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  const int failed =
      RUN_TESTS(argc, argv, TEST(what_is_apart_touches_again), TEST_OF_THREADS(order_and_threads_do_not_matter),
                TEST(a_run_goes_on_where_it_was_cut), TEST(histories_tell), TEST(without_the_option_they_are_refused), TEST(tangled_starts_are_refused),
                TEST(what_is_drawn_out_aslant_is_not_held), TEST(what_a_patch_takes_in_is_booked),
                TEST(a_curled_strip_springs_open));
  test_folder_remove(folder);
  return failed;
}
