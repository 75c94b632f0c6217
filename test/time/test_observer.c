// TEST quick
/* test_observer.c: a run ends where it should; its history and frames record what happened and are valid at all
 * times. */
#include "temporary.h"

#include <signal.h>
#include <sys/resource.h>

#include "flesh/flesh.h"
#include "test.h"

static char folder[256];

static const char *in_folder(const char *name)
{
  static char path[512];
  snprintf(path, sizeof path, "%s/%.200s", folder, name);
  return path;
}

/* A bar of 2 x 1 x 1 m with its face x = 0 pinned, under gravity; with `handle`, its other face is moved. */
typedef struct bar {
  flesh_mesh *mesh;
  flesh_material material;
  double *density;
  flesh_body body;
  flesh_system *system;
  flesh_integrator *integrator;
  flesh_state state;
} bar;

enum { WITH_INERTIA = 1, WITH_HANDLE = 2, TWO_GRAVITIES = 4 };

static void open_bar(bar *b, unsigned with, flesh_method method)
{
  static const double size[3] = {2, 1, 1}, origin[3] = {0};
  static const int cells[3] = {2, 1, 1}, held[4] = {0, 3, 6, 9}, moved[4] = {2, 5, 8, 11};
  static const flesh_keyframe keyframes[] = {{.t = 0}, {.t = 1, .translation = {0.2, 0, 0}}};
  *b = (bar){0};
  CHECK_OK(flesh_mesh_box(cells, size, origin, &b->mesh));
  CHECK_OK(
      flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.4, &b->material));
  int tets = flesh_mesh_tet_count(b->mesh), n = 3 * flesh_mesh_node_count(b->mesh);
  b->density = malloc(sizeof(double) * (size_t)tets);
  for (int t = 0; t < tets; t++) b->density[t] = 1000;
  b->body = (flesh_body){.mesh = b->mesh, .density = b->density, .materials = &b->material};
  CHECK_OK(flesh_system_create(b->mesh, &b->system));
  flesh_effect *effect;
  if (with & WITH_INERTIA) {
    CHECK_OK(flesh_effect_inertia(&b->body, &effect));
    CHECK_OK(flesh_system_add_effect(b->system, &effect));
  }
  CHECK_OK(flesh_effect_elasticity(&b->body, &effect));
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
  const double g[3] = {0, 0, -1};
  for (int k = 0; k < (with & TWO_GRAVITIES ? 3 : 1); k++) {
    CHECK_OK(flesh_effect_gravity(&b->body, g, &effect));
    CHECK_OK(flesh_system_add_effect(b->system, &effect));
  }
  CHECK_OK(flesh_system_add_pin(b->system, 4, held, FLESH_AXES_ALL, -INFINITY, INFINITY));
  const flesh_motion motion = {2, keyframes, {0}, 0};
  if (with & WITH_HANDLE)
    CHECK_OK(
        flesh_system_add_prescribed_motion(b->system, 4, moved, FLESH_AXES_ALL, &motion, -INFINITY, INFINITY));
  CHECK_OK(flesh_system_finalize(b->system));
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  options.newton_tolerance = 1e-9;
  CHECK_OK(flesh_integrator_create(b->system, method, &options, &b->integrator));
  b->state.x = malloc(sizeof(double) * (size_t)n);
  b->state.v = calloc((size_t)n, sizeof(double));
  memcpy(b->state.x, flesh_mesh_positions(b->mesh), sizeof(double) * (size_t)n);
}

static void close_bar(bar *b)
{
  flesh_integrator_destroy(&b->integrator);
  flesh_system_destroy(&b->system);
  flesh_mesh_destroy(&b->mesh);
  free(b->density);
  free(b->state.x);
  free(b->state.v);
}

/* The calls that an observer received. */
typedef struct seen {
  int calls, last_calls, stop_after, fail_at;
  double t[64], h[64];
} seen;

static int see(void *data, const flesh_step_record *record)
{
  seen *s = data;
  CHECK(record->step == s->calls);
  s->t[s->calls] = record->state->t;
  s->h[s->calls] = record->h;
  s->calls++;
  s->last_calls += record->last;
  return s->fail_at && record->step == s->fail_at ? FLESH_ERR_FILE : FLESH_OK;
}

static int stop(void *data)
{
  const seen *s = data;
  return s->stop_after && s->calls > s->stop_after - 1 ? FLESH_ERR_BUDGET : FLESH_OK;
}

static seen run(bar *b, double h, double end, int stop_after, int fail_at, int expected, int *steps)
{
  seen s = {.stop_after = stop_after, .fail_at = fail_at};
  const flesh_observer observer = {see, &s};
  const flesh_run_options options = {h, end, 1, &observer, stop, &s, NULL};
  int status = flesh_run(b->system, b->integrator, &options, &b->state, steps);
  CHECK(status == expected);
  if (status != expected) printf("# %s: %s\n", flesh_status_name(status), flesh_error_text());
  return s;
}

static void steps_end_exactly_at_the_end(void)
{
  static const struct {
    double start, h, end;
    int steps;
    double last_h;
  } cases[] = {{0, 0.1, 0.3, 3, 0.1},
               {0, 1.0 / 60, 0.5, 30, 1.0 / 60},
               {0, 0.1, 0.35, 4, 0.05},
               {0.3, 0.1, 1, 7, 0.1},        /* 0.3 + 7 * 0.1 rounds above 1 */
               {0, 0.1, 0.3 + 1e-9, 3, 0.1}, /* no tiny step of 1e-9 s */
               {0, 0.1, 0.30009, 3, 0.10009},
               {0, 0.1, 0.3 - 1e-9, 3, 0.1},
               {0, 0.5, 0.2, 1, 0.2},
               {1e6, 1.0 / 60, 1e6 + 1, 60, 1.0 / 60}};
  for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
    bar b;
    open_bar(&b, WITH_INERTIA, FLESH_METHOD_BACKWARD_EULER);
    b.state.t = cases[k].start;
    int steps;
    seen s = run(&b, cases[k].h, cases[k].end, 0, 0, FLESH_OK, &steps);
    CHECK(steps == cases[k].steps && s.calls == steps + 1 && s.last_calls == 1);
    CHECK(b.state.t == cases[k].end && s.t[steps] == cases[k].end);
    CHECK(s.t[0] == cases[k].start && s.h[0] == 0);
    for (int i = 1; i < steps; i++) CHECK_NEAR(s.h[i], cases[k].h, 1e-9);
    CHECK_NEAR(s.h[steps], cases[k].last_h, 2e-9);
    close_bar(&b);
  }
}

static void an_empty_run_shows_the_start(void)
{
  bar b;
  open_bar(&b, WITH_INERTIA, FLESH_METHOD_BACKWARD_EULER);
  int steps = -1;
  seen s = run(&b, 0.1, 0, 0, 0, FLESH_OK, &steps);
  CHECK(steps == 0 && s.calls == 1 && s.last_calls == 1);
  close_bar(&b);
}

static void impossible_runs_are_refused(void)
{
  static const struct {
    double h, end;
    const char *text;
  } cases[] = {{0, 1, "the step is 0 s; it must be positive"},
               {NAN, 1, "the step is nan s"},
               {0.1, -1, "the end is -1 s; it must be finite and not before the start at 0 s"},
               {0.1, INFINITY, "the end is inf s; it must be finite and not before"},
               {0.1, 1e300, "1e+300 s in steps of 0.1 s are 1e+301 steps; at most 2147483646"}};
  bar b;
  open_bar(&b, WITH_INERTIA, FLESH_METHOD_BACKWARD_EULER);
  for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
    int steps = -1;
    /* If it were started nevertheless, it would end at once. */
    seen s = run(&b, cases[k].h, cases[k].end, 1, 0, FLESH_ERR_ARGUMENT, &steps);
    CHECK_TEXT(flesh_error_text(), cases[k].text);
    CHECK(steps == 0 && s.calls == 0);
  }
  for (int count = -1; count < 2; count += 2) {
    const flesh_run_options options = {.h = 0.1, .end = 1, .observer_count = count};
    CHECK(flesh_run(b.system, b.integrator, &options, &b.state, NULL) == FLESH_ERR_ARGUMENT);
    CHECK_TEXT(flesh_error_text(), "observers must be an array of as many");
  }
  close_bar(&b);
}

static void a_stopped_run_ends_in_order(void)
{
  bar b;
  open_bar(&b, WITH_INERTIA, FLESH_METHOD_BACKWARD_EULER);
  int steps;
  seen s = run(&b, 0.1, 1, 4, 0, FLESH_ERR_BUDGET, &steps);
  CHECK(steps == 3 && s.calls == 4); /* within the fourth step, which leaves no trace */
  CHECK_NEAR(b.state.t, 0.3, 1e-15);
  s = run(&b, 0.1, 1, 0, 2, FLESH_ERR_FILE, &steps); /* an observer's failure also ends it */
  CHECK(steps == 2 && s.calls == 3);
  close_bar(&b);
}

static void statics_make_one_solve_unless_something_moves(void)
{
  bar b;
  int steps;
  open_bar(&b, 0, FLESH_METHOD_STATIC);
  run(&b, 0.1, 1, 0, 0, FLESH_OK, &steps);
  CHECK(steps == 1 && b.state.t == 1);
  close_bar(&b);
  open_bar(&b, WITH_HANDLE, FLESH_METHOD_STATIC);
  run(&b, 0.25, 1, 0, 0, FLESH_OK, &steps);
  CHECK(steps == 4 && b.state.t == 1);
  CHECK_NEAR(b.state.x[6], 2.2, 1e-15);
  close_bar(&b);
}

/* Splits a line into its columns, copied to `text`. */
static int split(char *text, const char **columns, int limit)
{
  int count = 0;
  for (char *word = strtok(text, ",\n"); word && count < limit; word = strtok(NULL, ",\n"))
    columns[count++] = word;
  return count;
}

static void the_history_has_a_row_per_step(void)
{
  bar b;
  open_bar(&b, WITH_INERTIA | TWO_GRAVITIES, FLESH_METHOD_BACKWARD_EULER);
  flesh_history *history;
  CHECK_OK(flesh_history_create(in_folder("history.csv"), b.system, &history));
  const flesh_observer observer = {flesh_history_observe, history};
  const flesh_run_options options = {0.1, 0.5, 1, &observer, NULL, NULL, NULL};
  CHECK_OK(flesh_run(b.system, b.integrator, &options, &b.state, NULL));
  FILE *stream =
      fopen(in_folder("history.csv"), "r"); /* before it is closed: every row is on disk */
  char header[1024], line[1024];
  CHECK(stream && fgets(header, sizeof header, stream));
  CHECK(!strcmp(header,
                "t,step,h,internal_steps,newton,linear,assemblies,projections,backtracks,residual,residual_target,"
                "energy_inertia,energy_elasticity,energy_gravity,energy_gravity_2,energy_gravity_3,"
                "energy_total,volume,volume_ratio,J_min,J_min_tet,J_bound,inverted\n"));
  const char *columns[32];
  int rows = 0;
  double value[32] = {0};
  for (; fgets(line, sizeof line, stream); rows++) {
    CHECK(split(line, columns, 32) == 23);
    for (int c = 0; c < 23; c++) value[c] = strtod(columns[c], NULL);
    if (!rows)
      CHECK_NEAR(value[12], 0, 1e-9); /* elastic energy relative to rest: S is not 0 there */
    CHECK_NEAR(value[16], value[11] + value[12] + value[13] + value[14] + value[15], 1e-9);
    CHECK(value[1] == rows && value[3] == (rows > 0));
  }
  fclose(stream);
  CHECK(rows == 6);
  /* The last row is the final state, to the last bit. */
  CHECK(value[0] == b.state.t && value[0] == 0.5);
  CHECK(value[17] == flesh_mesh_volume(b.mesh, b.state.x));
  CHECK(value[18] == value[17] / flesh_mesh_volume(b.mesh, flesh_mesh_positions(b.mesh)));
  int worst, inverted;
  CHECK(value[19] == flesh_mesh_jacobians(b.mesh, b.state.x, NULL, &worst, &inverted));
  CHECK(value[20] == worst && value[21] == value[19] && value[22] == inverted);
  CHECK(value[4] > 0 && value[9] <= value[10]);
  const double *v = b.state.v;
  double mass[16], kinetic = 0;
  flesh_mesh_lumped_mass(b.mesh, b.density, mass);
  for (int d = 0; d < 3 * flesh_mesh_node_count(b.mesh); d++)
    kinetic += 0.5 * mass[d / 3] * v[d] * v[d];
  CHECK_NEAR(value[11], kinetic, 1e-12 * kinetic);
  CHECK_OK(flesh_history_close(&history));
  CHECK_OK(flesh_history_close(&history));
  close_bar(&b);
}

/* A limit on file sizes represents a full disk: the run ends and the file has complete rows. */
static void a_full_disk_ends_the_run(void)
{
  bar b;
  open_bar(&b, WITH_INERTIA, FLESH_METHOD_BACKWARD_EULER);
  flesh_history *history;
  CHECK_OK(flesh_history_create(in_folder("full.csv"), b.system, &history));
  struct rlimit before, limit;
  getrlimit(RLIMIT_FSIZE, &before);
  signal(SIGXFSZ, SIG_IGN);
  limit = (struct rlimit){.rlim_cur = 800, .rlim_max = before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &limit);
  const flesh_observer observer = {flesh_history_observe, history};
  const flesh_run_options options = {0.1, 2, 1, &observer, NULL, NULL, NULL};
  int steps, status = flesh_run(b.system, b.integrator, &options, &b.state, &steps);
  setrlimit(RLIMIT_FSIZE, &before);
  CHECK(status == FLESH_ERR_FILE && steps < 20);
  CHECK_TEXT(flesh_error_text(), "full.csv: could not be written completely");
  flesh_history_close(&history);
  FILE *stream = fopen(in_folder("full.csv"), "r");
  int rows = 0;
  for (char line[1024]; stream && fgets(line, sizeof line, stream); rows++)
    CHECK(strchr(line, '\n') != NULL);
  if (stream) fclose(stream);
  CHECK(rows == steps + 1); /* the header, the start and all steps but the last */
  close_bar(&b);
}

static int count_listed(const char *path)
{
  FILE *stream = fopen(path, "r");
  int count = 0, closed = 0;
  for (char line[512]; stream && fgets(line, sizeof line, stream);) {
    char *name = strstr(line, "file=\"");
    closed |= strstr(line, "</VTKFile>") != NULL;
    if (!name) continue;
    name += 6;
    name[strcspn(name, "\"")] = 0;
    char file[128];
    snprintf(file, sizeof file, "frames/%.100s", name);
    CHECK(access(in_folder(file), R_OK) == 0);
    count++;
  }
  if (stream) fclose(stream);
  CHECK(closed);
  return count;
}

/* Observes after the frames: the index must be complete and list the existing frames at any time. */
static int count_frames(void *data, const flesh_step_record *record)
{
  int *expected = data;
  char path[512];
  strcpy(path, in_folder("frames/frames.pvd"));
  if (record->step % 2 == 0 || record->last) (*expected)++;
  CHECK(count_listed(path) == *expected);
  return FLESH_OK;
}

static void frames_are_listed_as_they_come(void)
{
  for (int again = 0; again < 2; again++) { /* the second run is shorter: no old frame may remain */
    bar b;
    open_bar(&b, WITH_INERTIA, FLESH_METHOD_BACKWARD_EULER);
    flesh_frames *frames;
    char directory[512];
    strcpy(directory, in_folder("frames"));
    CHECK_OK(flesh_frames_create(directory, b.mesh, 2, &frames));
    int listed = 0;
    const flesh_observer observers[] = {{flesh_frames_observe, frames}, {count_frames, &listed}};
    const flesh_run_options options = {0.1, again ? 0.3 : 0.7, 2, observers, NULL, NULL, NULL};
    CHECK_OK(flesh_run(b.system, b.integrator, &options, &b.state, NULL));
    CHECK(listed == (again ? 3 : 5)); /* 0 2 3; 0 2 4 6 7 */
    CHECK(access(in_folder("frames/frame_000006.vtu"), F_OK) == (again ? -1 : 0));
    CHECK_OK(flesh_frames_close(&frames));
    close_bar(&b);
  }
}

static void bad_places_are_refused(void)
{
  bar b;
  open_bar(&b, WITH_INERTIA, FLESH_METHOD_BACKWARD_EULER);
  FILE *file = fopen(in_folder("file"), "w");
  fclose(file);
  flesh_frames *frames;
  CHECK(flesh_frames_create(in_folder("file"), b.mesh, 1, &frames) == FLESH_ERR_FILE && !frames);
  CHECK(flesh_frames_create(in_folder("new"), b.mesh, 0, &frames) == FLESH_ERR_ARGUMENT && !frames);
  flesh_history *history;
  CHECK(flesh_history_create(folder, b.system, &history) == FLESH_ERR_FILE && !history);
  struct stat info; /* anything that is no file is not replaced by one */
  CHECK(!mkfifo(in_folder("pipe"), 0600));
  CHECK(flesh_history_create(in_folder("pipe"), b.system, &history) == FLESH_ERR_FILE && !history);
  CHECK(!stat(in_folder("pipe"), &info) && S_ISFIFO(info.st_mode) && !unlink(in_folder("pipe")));
  close_bar(&b);
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  int result = RUN_TESTS(argc, argv, TEST(steps_end_exactly_at_the_end),
                         TEST(an_empty_run_shows_the_start), TEST(impossible_runs_are_refused),
                         TEST(a_stopped_run_ends_in_order),
                         TEST(statics_make_one_solve_unless_something_moves),
                         TEST(the_history_has_a_row_per_step), TEST(a_full_disk_ends_the_run),
                         TEST(frames_are_listed_as_they_come), TEST(bad_places_are_refused));
  test_folder_remove(folder);
  return result;
}
