// TEST quick needs=drivers
/* test_hardcases_cases.c: files of hard cases are read or refused; the battery's meshes and start states are as hard as
 * they say. */
#include "temporary.h"

#include <stdlib.h>

#include "base/error.h"
#include "hardcases/cases.h"
#include "test.h"

static flesh_hardcases_battery battery;

static const flesh_hardcases_case *row(const char *name)
{
  for (int k = 0; k < battery.count; k++)
    if (!strcmp(battery.cases[k].name, name)) return &battery.cases[k];
  CHECK_TEXT("", name);
  return battery.cases;
}

typedef struct body {
  flesh_mesh *mesh;
  flesh_mesh_info info;
  flesh_state state;
} body;

static body make(const char *name, int seed)
{
  body b = {0};
  CHECK_OK(flesh_hardcases_make_mesh(row(name), 1, &b.mesh));
  flesh_mesh_inspect(b.mesh, &b.info);
  b.state.x = calloc(3 * (size_t)b.info.nodes, sizeof(double));
  b.state.v = calloc(3 * (size_t)b.info.nodes, sizeof(double));
  CHECK_OK(flesh_hardcases_make_start(row(name), b.mesh, seed, 1. / 60, &b.state));
  return b;
}

static void drop(body *b)
{
  flesh_mesh_destroy(&b->mesh);
  free(b->state.x);
  free(b->state.v);
}

static int inverted(const body *b)
{
  int count;
  flesh_mesh_jacobians(b->mesh, b->state.x, NULL, NULL, &count);
  return count;
}

/* Every case of the battery, both sizes: fine meshes, finite states. */
static void every_case_can_be_made(void)
{
  for (const flesh_hardcases_case *r = battery.cases; r < battery.cases + battery.count; r++)
    for (int quick = 0; quick < 2; quick++) {
      flesh_mesh *mesh = NULL;
      CHECK_OK(flesh_hardcases_make_mesh(r, quick, &mesh));
      if (!mesh) continue;
      int n = 3 * flesh_mesh_node_count(mesh), finite = 1;
      flesh_mesh_info info;
      flesh_mesh_inspect(mesh, &info);
      CHECK(info.unused_nodes == 0);
      if (quick) CHECK(info.tets <= 3000);
      if (!quick && r->mesh == FLESH_HARDCASES_LARGE) CHECK(info.tets >= 15000 && info.tets <= 50000);
      flesh_state state = {.t = 0, .x = malloc(sizeof(double) * (size_t)n), .v = malloc(sizeof(double) * (size_t)n)};
      CHECK_OK(flesh_hardcases_make_start(r, mesh, 1, 1. / 60, &state));
      for (int d = 0; d < n; d++) finite &= isfinite(state.x[d]) && isfinite(state.v[d]);
      CHECK(finite);
      free(state.x);
      free(state.v);
      flesh_mesh_destroy(&mesh);
    }
}

static void meshes_are_bad_as_promised(void)
{
  body slivers = make("slivers_stretch", 1), graded = make("graded_stretch", 1),
       fan = make("fan_jitter", 1);
  CHECK_BELOW(slivers.info.radius_ratio_min, 2e-4);
  CHECK(slivers.info.radius_ratio_min > 1e-5);
  CHECK(graded.info.edge_max / graded.info.edge_min > 0.9e4);
  CHECK(graded.info.radius_ratio_min > 0.1); /* graded, but well shaped */
  CHECK_NEAR(graded.info.volume, 1e-3, 1e-15);
  CHECK_NEAR(fan.info.volume, 1e-3, 1e-15);
  int around = 0;
  for (int k = 0; k < 4 * fan.info.tets; k++) around += flesh_mesh_tets(fan.mesh)[k] == 0;
  CHECK(around == fan.info.tets && around >= 200);
  drop(&slivers), drop(&graded), drop(&fan);
}

static void neighbours_differ_in_a_checker(void)
{
  body b = make("checker1e6", 1);
  int ones = 0;
  for (int t = 0; t < b.info.tets; t++) ones += flesh_mesh_regions(b.mesh)[t] == 1;
  CHECK(b.info.regions == 2);
  CHECK(abs(2 * ones - b.info.tets) <= 6);
  CHECK(flesh_mesh_regions(b.mesh)[0] != flesh_mesh_regions(b.mesh)[6]);
  drop(&b);
}

static void two_bodies_share_nothing(void)
{
  body b = make("two_bodies", 1);
  const double *X = flesh_mesh_positions(b.mesh);
  int mixed = 0;
  for (int t = 0; t < b.info.tets; t++) {
    int right = 0;
    for (int a = 0; a < 4; a++) right += X[3 * flesh_mesh_tets(b.mesh)[4 * t + a]] > 0.1;
    mixed += right != 0 && right != 4;
  }
  CHECK(mixed == 0);
  drop(&b);
}

static void exact_starts_are_exact(void)
{
  body plane = make("plane", 1), line = make("line", 1), point = make("point", 1),
       noisy = make("plane_noise", 1);
  double off[4] = {0};
  for (int i = 0; i < plane.info.nodes; i++) {
    off[0] = fmax(off[0], fabs(plane.state.x[3 * i + 2] - plane.state.x[2]));
    for (int c = 1; c < 3; c++)
      off[1] = fmax(off[1], fabs(line.state.x[3 * i + c] - line.state.x[c]));
    for (int c = 0; c < 3; c++)
      off[2] = fmax(off[2], fabs(point.state.x[3 * i + c] - point.state.x[c]));
    off[3] = fmax(off[3], fabs(noisy.state.x[3 * i + 2] - 0.05));
  }
  CHECK(off[0] == 0 && off[1] == 0 && off[2] == 0);
  CHECK(off[3] > 1e-10 && off[3] <= 2e-10);
  drop(&plane), drop(&line), drop(&point), drop(&noisy);
}

static void inversions_are_counted(void)
{
  body one = make("invert_one", 1), all = make("mirrored", 1), rest = make("spin_body", 1);
  CHECK(inverted(&one) == 1);
  CHECK(inverted(&all) == all.info.tets);
  CHECK(inverted(&rest) == 0);
  drop(&one), drop(&all), drop(&rest);
}

/* A full turn over the length: the far face is unrotated, the middle is upside down. */
static void twists_turn(void)
{
  body b = make("twist5", 1);
  const double *X = flesh_mesh_positions(b.mesh);
  double far = 0, largest = 0;
  for (int i = 0; i < b.info.nodes; i++) {
    double d = 0;
    for (int c = 0; c < 3; c++) d += fabs(b.state.x[3 * i + c] - X[3 * i + c]);
    if (X[3 * i] > 0.1999) far = fmax(far, d);
    largest = fmax(largest, d);
  }
  CHECK_BELOW(far, 1e-14);
  CHECK(largest > 0.1);
  /* Less than half a turn per layer, otherwise it would be another twist. */
  int layers = 0;
  for (int i = 0; i < b.info.nodes; i++) layers += X[3 * i + 1] == 0 && X[3 * i + 2] == 0;
  CHECK(5. / (layers - 1) < 0.3);
  drop(&b);
}

static void seeds_differ_and_repeat(void)
{
  body a = make("scramble", 1), b = make("scramble", 2), c = make("scramble", 1);
  int same = 0, outside = 0, n = 3 * a.info.nodes;
  double mean = 0;
  for (int d = 0; d < n; d++) {
    same += a.state.x[d] == b.state.x[d];
    outside += !(a.state.x[d] >= 0 && a.state.x[d] <= (d % 3 ? 0.1 : 0.2));
    mean += a.state.x[d] / (d % 3 ? 0.1 : 0.2) / n;
  }
  CHECK(same == 0 && outside == 0);
  CHECK_NEAR(mean, 0.5, 0.06); /* four standard deviations of 336 uniform numbers */
  CHECK(!memcmp(a.state.x, c.state.x, sizeof(double) * (size_t)n));
  drop(&a), drop(&b), drop(&c);
}

/* omega x r with a turn per step; 100 m/s from where two steps lead back into place. */
static void moving_starts_move(void)
{
  body spin = make("spin_body", 1), fly = make("crash", 1);
  double worst = 0, omega = 2 * acos(-1) * 60;
  for (int i = 0; i < spin.info.nodes; i++) {
    const double *x = spin.state.x + 3 * i, *v = spin.state.v + 3 * i;
    worst = fmax(worst, fabs(v[0] + omega * (x[1] - 0.05)) + fabs(v[1] - omega * (x[0] - 0.1)) +
                            fabs(v[2]));
    double place = fly.state.x[3 * i] + 2. / 30 * fly.state.v[3 * i];
    CHECK_NEAR(place, flesh_mesh_positions(fly.mesh)[3 * i], 1e-12);
  }
  CHECK_BELOW(worst, 1e-12);
  drop(&spin), drop(&fly);
}

/* The numbers of cases are those stated in drivers/hardcases.md. */
static void the_program_has_its_own_files(void)
{
  static const char *const names[] = {"battery", "shapes", "filters"};
  static const int counts[] = {72, 43, 11};
  for (int k = 0; k < 3; k++) {
    flesh_hardcases_battery b;
    CHECK_OK(flesh_hardcases_open_battery(NULL, names[k], &b));
    CHECK(b.count == counts[k]);
    for (int c = 0; c < b.count; c++) CHECK(b.cases[c].fingerprint == 0);
    flesh_hardcases_close_battery(&b);
  }
}

/* Reads the text as a user's own file. */
static int open_own(const char *text, flesh_hardcases_battery *b)
{
  char folder[200], path[220];
  CHECK(!test_folder_make(folder, sizeof folder));
  snprintf(path, sizeof path, "%s/own.yaml", folder);
  FILE *file = fopen(path, "w");
  CHECK(file && fputs(text, file) >= 0 && !fclose(file));
  const int status = flesh_hardcases_open_battery(path, "battery", b);
  test_folder_remove(folder);
  return status;
}

static void a_file_of_ones_own_is_read(void)
{
  static const char text[] =
      "title: mine\n"
      "cases:\n"
      "  - {name: hit, group: walls, doc: 'into a wall: hard', start: {kind: jitter, amount: 100/15, noise: 0.1},\n"
      "     random: true, held: feet, poisson: 0, step: 1/60, seconds: 2, release: {seconds: 30}, young: 123456.7,\n"
      "     effects: [gravity, contact: {plane: {point: [0.25, 0, 0], normal: [-1, 0, 0]}, friction: 1/3}]}\n"
      "  - {name: still, group: walls, doc: at rest, static: true, expects: equilibrium}\n";
  flesh_hardcases_battery b, again;
  CHECK_OK(open_own(text, &b));
  CHECK(b.count == 2);
  const flesh_hardcases_case *hit = b.cases, *still = b.cases + 1;
  CHECK(hit->start == FLESH_HARDCASES_JITTER && hit->amount == 100. / 15 && hit->noise == 0.1 && hit->step == 1. / 60);
  CHECK(hit->random && !hit->is_static && hit->held == FLESH_HARDCASES_FEET && hit->expects == FLESH_HARDCASES_RECOVERY);
  CHECK(hit->poisson == 0 && hit->release == 30 && isnan(hit->release_step) && hit->young == 123456.7);
  CHECK(!strcmp(hit->effects, "  - gravity: {}\n  - contact: {plane: {point: [0.25, 0, 0], normal: [-1, 0, 0]}, "
                              "friction: 1/3}\n"));
  CHECK(still->is_static && !still->random && still->held == FLESH_HARDCASES_FREE &&
        still->expects == FLESH_HARDCASES_KEPT_EQUILIBRIUM);
  CHECK(isnan(still->poisson) && still->amount == 0 && !*still->effects && still->mesh == FLESH_HARDCASES_BLOCK);
  /* A resumed study reruns a changed case. */
  CHECK_OK(open_own(text, &again));
  CHECK(hit->fingerprint && hit->fingerprint == again.cases->fingerprint && hit->fingerprint != still->fingerprint);
  flesh_hardcases_close_battery(&b), flesh_hardcases_close_battery(&again);
}

static void bad_files_are_refused(void)
{
#define CASE "cases: [{name: a, group: g, doc: d, seconds: 1"
  static const struct {
    const char *text, *words;
  } bad[] = {
      {"", ":1:1: the battery is empty; it must be a mapping of the keys title, cases"},
      {"[]", ":1:1: the battery is an empty list"},
      {"title: none", "cases is missing; it must be a list of mappings"},
      {"cases: []", ":1:8: cases are 0; they must be 1 to 1024"},
      {CASE "}, {name: a, group: g, doc: d, seconds: 1}]", "cases[1].name is a, which is the name of cases[0]"},
      {"cases: [{name: ../a, group: g, doc: d, seconds: 1}]", ":1:16: cases[0].name is ../a; it must be at most 40 let"},
      {"cases: [{name: a, group: 'g,h', doc: d, seconds: 1}]", ":1:26: cases[0].group is \"g,h\"; it must be at most"},
      {"cases: [{name: a, group: g, doc: \"d\\ne\", seconds: 1}]", "cases[0].doc has a control character"},
      {"cases: [{name: a, group: g, doc: d}]", "cases[0].seconds is missing; it must be a number > 0 [s], or the case s"},
      {CASE ", static: true}]", "a static case must have none"},
      {CASE ", density: -1}]", ":1:58: cases[0].density is -1; it must be a number > 0 [kg/m^3]"},
      {CASE ", densty: 1}]", "cases[0].densty is unknown; did you mean density?"},
      {CASE ", start: {kind: jiter}}]", "cases[0].start.kind is jiter; it must be one of rest, scramble"},
      {CASE ", start: {kind: jitter}}]", "cases[0].start.amount is missing; jitter must have one, a number"},
      {CASE ", start: {kind: mirror, amount: 2}}]", "cases[0].start.amount is 2; mirror has none"},
      {CASE ", young_ratio: 2}]", "mesh must be checker or halves"},
      {CASE ", effects: [gravitty]}]", "cases[0].effects[0] is gravitty, which is no effect; did you mean gravity?"},
      {CASE ", effects: [gravity: {acceleration: 3}]}]", "effects[0].gravity.acceleration is 3; it must be three numbers"},
      {CASE ", effects: [contact: {mesh: a.obj}]}]", "names the file a.obj; it must be an absolute path"},
      {CASE ", release: {step: 1}}]", "cases[0].release.seconds is missing; it must be a number > 0 [s]"}};
#undef CASE
  for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
    flesh_hardcases_battery b;
    CHECK(open_own(bad[k].text, &b) == FLESH_ERR_ARGUMENT);
    CHECK_TEXT(flesh_error_text(), bad[k].words);
    flesh_hardcases_close_battery(&b);
  }
}

int main(int argc, char **argv)
{
  CHECK_OK(flesh_hardcases_open_battery(NULL, "battery", &battery));
  const int code = RUN_TESTS(argc, argv, TEST(every_case_can_be_made), TEST(meshes_are_bad_as_promised),
                             TEST(neighbours_differ_in_a_checker), TEST(two_bodies_share_nothing),
                             TEST(exact_starts_are_exact), TEST(inversions_are_counted), TEST(twists_turn),
                             TEST(seeds_differ_and_repeat), TEST(moving_starts_move), TEST(the_program_has_its_own_files),
                             TEST(a_file_of_ones_own_is_read), TEST(bad_files_are_refused));
  flesh_hardcases_close_battery(&battery);
  return code;
}
