// TEST full memory needs=ranks ranks=1,2,3,5
/* test_shared_untangle.c: tangles of a body shared by ranks are found as on one rank, are resolved through softer
 * materials, and stay if that fails, on all ranks alike. */
#include "shared_body.h"

#include "body.h"
#include "time/recovery/lay_out.h"
#include "time/recovery/winding.h"

/* Copies this rank's part of a vector of the whole. */
static void take(const flesh_rank_part *part, const double *whole, double *own)
{
  const int *nodes = flesh_rank_part_nodes(part);
  for (int d = 0; d < 3 * flesh_mesh_node_count(flesh_rank_part_mesh(part)); d++)
    own[d] = whole[3 * nodes[d / 3] + d % 3];
}

static int says(void) { return flesh_communicator_rank(ranks) == 0; }

/* Returns the root mean square distance over all nodes of the body, m. */
static double distance(const bodies *b, const double *wanted)
{
  double *x = malloc((size_t)b->whole.n * sizeof *x);
  CHECK_OK(flesh_rank_part_gather(b->part, b->own.state.x, x));
  for (int d = 0; d < b->whole.n; d++) x[d] -= wanted[d];
  const double far = test_norm(b->whole.n, x) / sqrt(b->whole.n / 3.);
  free(x);
  return far;
}

/* Makes a fan of `count` tets around the z axis, each taking `angle` of it: a closed ring at angle = 2 pi / count. */
static void fan_positions(int count, double angle, double *x)
{
  memcpy(x, (double[]){0, 0, 0, 0, 0, 1}, 6 * sizeof *x);
  for (int k = 0; k < count; k++)
    memcpy(x + 6 + 3 * k, (double[]){cos(angle * k), sin(angle * k), 0.5}, 3 * sizeof *x);
}

static flesh_mesh *fan(int count)
{
  double x[3 * 22];
  int tets[4 * 20];
  flesh_mesh *mesh = NULL;
  fan_positions(count, 2 * M_PI / count, x);
  for (int k = 0; k < count; k++) memcpy(tets + 4 * k, (int[]){0, 2 + k, 2 + (k + 1) % count, 1}, 4 * sizeof *tets);
  CHECK_OK(flesh_mesh_create(count + 2, x, count, tets, NULL, &mesh));
  return mesh;
}

/* A body and the tangles found in it. */
typedef struct search {
  const flesh_mesh *mesh;
  flesh_winding *winding;
  uint8_t *far;
  double *work;
} search;

static void open_search(search *s, const flesh_mesh *mesh, const flesh_team *team)
{
  const size_t nodes = (size_t)flesh_mesh_node_count(mesh);
  *s = (search){.mesh = mesh, .far = malloc(3 * nodes), .work = malloc(nodes * sizeof(double))};
  CHECK_OK(flesh_winding_create(mesh, team, &s->winding));
}

static void close_search(search *s)
{
  flesh_winding_destroy(&s->winding);
  free(s->far);
  free(s->work);
}

/* Counts on this rank, [3]: tangled pieces, far dofs, and those of either that the whole's search judges
 * differently. */
static void compare_searches(const flesh_rank_part *part, const search *whole, const search *own, const double *x,
                             double figures[3])
{
  const flesh_team *team = flesh_rank_part_team(part);
  const uint8_t *tangled, *tangled_here;
  double *x_own = malloc(3 * (size_t)team->nodes * sizeof *x_own);
  const int tets = flesh_mesh_tet_count(own->mesh), pieces = flesh_mesh_order(own->mesh) == 2 ? 8 : 1;
  take(part, x, x_own);
  flesh_winding_find(whole->winding, x, &tangled);
  flesh_winding_find_far(whole->mesh, NULL, tangled, whole->work, whole->far);
  figures[0] = flesh_winding_find(own->winding, x_own, &tangled_here);
  figures[1] = flesh_winding_find_far(own->mesh, team, tangled_here, own->work, own->far);
  figures[2] = 0;
  for (int p = 0; p < pieces * tets; p++)
    figures[2] += tangled_here[p] != tangled[pieces * flesh_rank_part_tets(part)[p / pieces] + p % pieces];
  for (int d = 0; d < 3 * team->nodes; d++)
    figures[2] += own->far[d] != whole->far[3 * flesh_rank_part_nodes(part)[d / 3] + d % 3];
  free(x_own);
}

/* Partitions the mesh by METIS, or scatters its tets over the ranks one by one or, for `scattered` 2, by sevens, with
 * positions from rest to completely tangled. */
static void compare_places(flesh_mesh *mesh, int scattered, int places, void (*place)(int k, const flesh_mesh *mesh, double *x))
{
  const int tets = flesh_mesh_tet_count(mesh), size = flesh_communicator_size(ranks);
  int *of = malloc((size_t)tets * sizeof *of), some = 0, none = 0;
  double *x = malloc(3 * (size_t)flesh_mesh_node_count(mesh) * sizeof *x), most_far = 0;
  flesh_rank_part *part = NULL;
  search whole, own;
  for (int t = 0; t < tets; t++) of[t] = (scattered == 1 || tets < 7 * size ? t : t / 7) % size;
  CHECK_OK(flesh_rank_part_create(ranks, mesh, scattered ? of : NULL, &part));
  open_search(&whole, mesh, NULL);
  open_search(&own, flesh_rank_part_mesh(part), flesh_rank_part_team(part));
  for (int k = 0; k < places; k++) {
    const uint8_t *tangled;
    double figures[3];
    place(k, mesh, x);
    compare_searches(part, &whole, &own, x, figures);
    flesh_communicator_sum(ranks, 3, figures);
    CHECK(figures[2] == 0);
    CHECK(figures[0] == flesh_winding_find(whole.winding, x, &tangled));
    CHECK(figures[1] == flesh_winding_find_far(mesh, NULL, tangled, whole.work, whole.far));
    none += figures[0] == 0;
    some += figures[0] > 0;
    most_far = figures[0] > 0 ? fmax(most_far, figures[1]) : most_far;
  }
  if (says()) printf("# %d tets, scattered %d: tangled in %d of %d places\n", tets, scattered, some, places);
  CHECK(some > 0 && none > 0);
  CHECK(most_far > 0 || tets < 10);
  close_search(&whole), close_search(&own);
  flesh_rank_part_destroy(&part);
  free(of), free(x);
}

/* Wound once more around its axis with all volumes positive, which no rank can see in its part. */
static void wind(int k, const flesh_mesh *mesh, double *x)
{
  const int count = flesh_mesh_tet_count(mesh);
  fan_positions(count, 2 * (k + 1) * M_PI / count, x);
}

/* More and more of the nodes of one end are moved randomly. */
static void jitter(int k, const flesh_mesh *mesh, double *x)
{
  const int n = 3 * flesh_mesh_node_count(mesh);
  const double *X = flesh_mesh_positions(mesh);
  unsigned long long random = 7;
  for (int d = 0; d < n; d++)
    x[d] = X[d] + (X[d - d % 3] < 0.02 * k ? 0.006 * k * (test_uniform(&random) - 0.5) : 0);
}

static void tangles_are_found_as_on_one_rank(void)
{
  flesh_mesh *mesh = NULL, *ten = NULL;
  for (int scattered = 0; scattered < 3; scattered++) {
    mesh = fan(7);
    compare_places(mesh, scattered, 2, wind);
    flesh_mesh_destroy(&mesh);
    mesh = test_box(9, 3, 3, 1, 1. / 3, 1. / 3);
    compare_places(mesh, scattered, 40, jitter);
    CHECK_OK(flesh_mesh_raise_order(mesh, &ten));
    compare_places(ten, scattered, 10, jitter);
    flesh_mesh_destroy(&mesh), flesh_mesh_destroy(&ten);
  }
}

/* Takes steps of a method with or without untangling, with the callback `stop`. Returns the last status. */
static int run(test_body *b, flesh_method method, int steps, double h, flesh_solver_options options, int untangle,
               int (*stop)(void *data), void *data, flesh_solve_stats *stats)
{
  flesh_integrator *integrator = NULL;
  int status = FLESH_OK;
  *stats = (flesh_solve_stats){0};
  if (!untangle) options.techniques &= ~(unsigned)FLESH_TECHNIQUE_UNTANGLE;
  CHECK_OK(flesh_integrator_create(b->system, method, &options, &integrator));
  flesh_integrator_set_stop(integrator, stop, data);
  for (int k = 0; k < steps && !status; k++) status = flesh_integrator_step(integrator, &b->state, h, stats);
  flesh_integrator_destroy(&integrator);
  return status;
}

static flesh_solver_options options_of_bar(void)
{
  flesh_solver_options options = test_options(1e-10);
  options.max_newton = 1000;
  return options;
}

/* Makes a clamped bar at rest in a mirrored, tangled state: whole and part are in the same equilibrium. */
static void open_tangled_bar(bodies *b)
{
  flesh_solve_stats stats;
  open_body(b, test_box(9, 3, 3, 1, 1. / 3, 1. / 3), test_material(FLESH_ENERGY_S, 0.49), FLESH_MASS_LUMPED, 0, 1);
  double *x = b->whole.state.x;
  for (int d = 0; d < b->whole.n; d += 3) x[d] = -x[d];
  take(b->part, x, b->own.state.x);
  CHECK_OK(run(&b->own, FLESH_METHOD_BACKWARD_EULER, 60, 1. / 60, options_of_bar(), 0, NULL, NULL, &stats));
  memset(b->own.state.v, 0, (size_t)b->own.n * sizeof *b->own.state.v);
  CHECK_OK(run(&b->own, FLESH_METHOD_STATIC, 1, 0, options_of_bar(), 0, NULL, NULL, &stats));
  CHECK_OK(flesh_rank_part_gather(b->part, b->own.state.x, x));
  CHECK(distance(b, flesh_mesh_positions(b->mesh)) > 0.05);
}

/* All ranks have counted the same. */
static void check_counts(const flesh_solve_stats *stats)
{
  double counts[] = {stats->untanglings, stats->untangled_nodes, -stats->untanglings, -stats->untangled_nodes};
  flesh_communicator_largest(ranks, 4, counts);
  CHECK(counts[0] == -counts[2] && counts[1] == -counts[3]);
}

/* A body at rest in a tangle leaves it, in statics and in steps that are too short to do so by themselves; as on one
 * rank. */
static void tangled_bodies_come_back(void)
{
  for (int moves = 0; moves < 2; moves++) {
    bodies b;
    flesh_solve_stats stats, alone;
    open_tangled_bar(&b);
    const flesh_method method = moves ? FLESH_METHOD_BACKWARD_EULER : FLESH_METHOD_STATIC;
    const int steps = moves ? 12 : 1;
    const double h = moves ? 1e-4 : 0, *X = flesh_mesh_positions(b.mesh);
    for (int untangle = 0; untangle < 2; untangle++) {
      CHECK_OK(run(&b.own, method, steps, h, options_of_bar(), untangle, NULL, NULL, &stats));
      const double far = distance(&b, X);
      if (says()) printf("# moves %d, untangle %d: %.3g m from rest, %d untanglings, %ld nodes\n", moves, untangle, far,
                         stats.untanglings, (long)stats.untangled_nodes);
      CHECK(stats.untanglings == untangle);
      if (untangle) CHECK_BELOW(far, moves ? 1e-3 : 1e-7);
      else CHECK(far > 0.05);
      check_counts(&stats);
    }
    CHECK_OK(run(&b.whole, method, steps, h, options_of_bar(), 1, NULL, NULL, &alone));
    CHECK(alone.untanglings == 1);
    CHECK_NEAR(stats.untangled_nodes, alone.untangled_nodes, 2);
    close_body(&b);
  }
}

/* Makes two boxes that share no node, of `NODES` nodes each, the second one at x = 2. */
enum { NODES = 64 };
static flesh_mesh *two_boxes(void)
{
  flesh_mesh *box = test_box(3, 3, 3, 1, 1, 1), *both = NULL;
  const int tets = flesh_mesh_tet_count(box);
  double X[6 * NODES];
  int *corners = malloc(8 * (size_t)tets * sizeof *corners);
  for (int d = 0; d < 6 * NODES; d++) X[d] = flesh_mesh_positions(box)[d % (3 * NODES)] + (d >= 3 * NODES && d % 3 == 0 ? 2 : 0);
  for (int k = 0; k < 8 * tets; k++) corners[k] = flesh_mesh_tets(box)[k % (4 * tets)] + (k >= 4 * tets ? NODES : 0);
  CHECK_OK(flesh_mesh_create(2 * NODES, X, 2 * tets, corners, NULL, &both));
  flesh_mesh_destroy(&box);
  free(corners);
  return both;
}

/* The second of two boxes, partitioned over all ranks, has shrunk to a hundredth near a plane: it is laid out as on one
 * rank, with its farthest corner on the plane. */
static void lay_outs_are_those_of_one_rank(void)
{
  bodies b = {.mesh = two_boxes()};
  double *ends[2];
  const int tets = flesh_mesh_tet_count(b.mesh), size = flesh_communicator_size(ranks);
  int *of = malloc((size_t)tets * sizeof *of);
  for (int t = 0; t < tets; t++) of[t] = t % size;
  CHECK_OK(flesh_rank_part_create(ranks, b.mesh, of, &b.part));
  for (int k = 0; k < 2; k++) {
    test_body *body = k ? &b.own : &b.whole;
    flesh_obstacle *plane = NULL;
    flesh_contact_options contact;
    flesh_effect *effect = NULL;
    flesh_rigid_parts parts;
    flesh_mesh *mesh = k ? (flesh_mesh *)flesh_rank_part_mesh(b.part) : b.mesh;
    CHECK_OK(test_body_create(mesh, test_material(FLESH_ENERGY_E, 0.3), 1000, FLESH_MASS_LUMPED, 1, body));
    flesh_contact_options_default(&contact);
    CHECK_OK(flesh_obstacle_plane((double[]){0, 0, 0}, (double[]){0.1, 0.02, 1}, &plane));
    CHECK_OK(flesh_effect_obstacle_contact(&body->body, &contact, &plane, &effect));
    CHECK_OK(flesh_system_add_effect(body->system, &effect));
    CHECK_OK(flesh_system_finalize(body->system));
    if (k) CHECK_OK(flesh_system_set_part(body->system, b.part));
    double *x = body->state.x, *work = malloc((size_t)body->n * sizeof *work);
    uint8_t *fixed = calloc((size_t)body->n, 1);
    for (int d = 0; d < body->n; d++) {
      const int second = (k ? flesh_rank_part_nodes(b.part)[d / 3] : d / 3) >= NODES;
      x[d] = second ? 0.01 * x[d] + (d % 3 == 2 ? 0.1 : 1) : x[d] + (d % 3 == 2);
    }
    double *from = malloc((size_t)body->n * sizeof *from);
    memcpy(from, x, (size_t)body->n * sizeof *x);
    CHECK_OK(flesh_rigid_parts_create(body->system, FLESH_OK, &parts));
    CHECK(flesh_lay_out(body->system, &parts, fixed, 0, from, work, x) == 1);
    CHECK(flesh_lay_out(body->system, &parts, fixed, 0, from, work, x) == 0);
    flesh_rigid_parts_clear(&parts);
    ends[k] = x;
    free(fixed), free(work), free(from);
  }
  double worst = 0, lowest = INFINITY;
  for (int d = 0; d < b.own.n; d++) worst = fmax(worst, fabs(ends[1][d] - ends[0][3 * flesh_rank_part_nodes(b.part)[d / 3] + d % 3]));
  for (int d = 3 * NODES; d < b.whole.n; d += 3) lowest = fmin(lowest, 0.1 * ends[0][d] + 0.02 * ends[0][d + 1] + ends[0][d + 2]);
  flesh_communicator_largest(ranks, 1, &worst);
  if (says()) printf("# laid out %.3g m above the plane, %.2g m from where one rank does\n", lowest, worst);
  CHECK_BELOW(worst, 1e-12);
  CHECK(lowest > 0 && lowest < 0.1);
  free(of);
  close_body(&b);
}

/* Two boxes, partitioned over all ranks, collapse to a point each, and recover where they are. */
static void points_come_back(void)
{
  bodies b;
  flesh_solve_stats stats;
  double sizes[2][3] = {{0}};
  open_body(&b, two_boxes(), test_material(FLESH_ENERGY_E, 0.3), FLESH_MASS_LUMPED, 0, 0);
  const int nodes = NODES;
  const double *X = flesh_mesh_positions(b.mesh);
  for (int i = 0; i < 2 * nodes; i++) /* the second one upside down, at x = 12 */
    for (int c = 0; c < 3; c++) {
      const int second = i >= nodes;
      const double middle = second ? (c == 0 ? 12 : -0.5) : 0.5, from = X[3 * i + c] - (second && c == 0 ? 2.5 : 0.5);
      b.whole.state.x[3 * i + c] = middle + 0.01 * (second && c ? -from : from);
    }
  take(b.part, b.whole.state.x, b.own.state.x);
  CHECK_OK(run(&b.own, FLESH_METHOD_BACKWARD_EULER, 80, 0.1, test_options(1e-6), 1, NULL, NULL, &stats));
  CHECK_OK(flesh_rank_part_gather(b.part, b.own.state.x, b.whole.state.x));
  if (says()) printf("# two boxes: %d untanglings\n", stats.untanglings);
  CHECK(stats.untanglings > 0);
  check_counts(&stats);
  for (int body = 0; body < 2; body++) {
    const double *x = b.whole.state.x + 3 * body * nodes, *rest = X + 3 * body * nodes;
    double worst = 0;
    for (int d = 0; d < 3 * nodes; d++) sizes[body][d % 3] += x[d] / nodes;
    for (int i = 1; i < nodes; i++) {
      double now[3], before[3];
      for (int c = 0; c < 3; c++) now[c] = x[3 * i + c] - x[c], before[c] = rest[3 * i + c] - rest[c];
      worst = fmax(worst, fabs(test_norm(3, now) - test_norm(3, before)));
    }
    CHECK_BELOW(worst, 1e-4);
    for (int c = 0; c < 3; c++) CHECK_NEAR(sizes[body][c], body ? (c == 0 ? 12 : -0.5) : 0.5, 1e-6);
  }
  close_body(&b);
}

typedef struct asking {
  int count, at; /* how often the callback was asked, and when the last rank stops; 0: never */
} asking;

static int stop_last_rank(void *data)
{
  asking *a = data;
  const int last = flesh_communicator_rank(ranks) == flesh_communicator_size(ranks) - 1;
  return ++a->count == a->at && last ? FLESH_ERR_INTERRUPTED : FLESH_OK;
}

/* If softer materials fail, because their solve may take only one iteration, all ranks return to the tangle; and a rank
 * that is told to stop on the way stops all. */
static void failures_are_everyones(void)
{
  bodies b;
  flesh_solve_stats stats;
  open_tangled_bar(&b);
  double *x = malloc((size_t)b.own.n * sizeof *x);
  flesh_solver_options options = test_options(1e-3);
  options.max_newton = 1;
  memcpy(x, b.own.state.x, (size_t)b.own.n * sizeof *x);
  CHECK_OK(run(&b.own, FLESH_METHOD_STATIC, 1, 0, options, 0, NULL, NULL, &stats));
  const int newton = stats.newton;
  double *without = malloc((size_t)b.own.n * sizeof *without);
  memcpy(without, b.own.state.x, (size_t)b.own.n * sizeof *x);
  memcpy(b.own.state.x, x, (size_t)b.own.n * sizeof *x);
  CHECK_OK(run(&b.own, FLESH_METHOD_STATIC, 1, 0, options, 1, NULL, NULL, &stats));
  CHECK(stats.untanglings == 0 && stats.newton > newton);
  CHECK(!memcmp(without, b.own.state.x, (size_t)b.own.n * sizeof *x));
  asking questions[2] = {{0}};
  for (int untangle = 0; untangle < 2; untangle++) {
    memcpy(b.own.state.x, x, (size_t)b.own.n * sizeof *x);
    CHECK_OK(run(&b.own, FLESH_METHOD_STATIC, 1, 0, options_of_bar(), untangle, stop_last_rank, &questions[untangle], &stats));
    CHECK(stats.untanglings == untangle);
  }
  CHECK(questions[1].count > questions[0].count + 4);
  asking late = {0, (questions[0].count + questions[1].count) / 2};
  memcpy(b.own.state.x, x, (size_t)b.own.n * sizeof *x);
  CHECK(run(&b.own, FLESH_METHOD_STATIC, 1, 0, options_of_bar(), 1, stop_last_rank, &late, &stats) == FLESH_ERR_INTERRUPTED);
  CHECK(late.count == late.at && stats.untanglings == 0);
  CHECK(distance(&b, flesh_mesh_positions(b.mesh)) > 0.05);
  free(x), free(without);
  close_body(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS_ON_RANKS(argc, argv, TEST(tangles_are_found_as_on_one_rank), TEST(tangled_bodies_come_back),
                            TEST(lay_outs_are_those_of_one_rank), TEST(points_come_back), TEST(failures_are_everyones));
}
