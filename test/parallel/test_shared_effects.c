// TEST full memory needs=ranks ranks=3,8
/* test_shared_effects.c: every effect that ranks can share against itself on the whole body: forces, potentials,
 * energies, products with the matrix, feasible steps. */
#include "scene_files.h"

#include "ranks.h"

#include "base/memory.h"
#include "body.h"
#include "effect/environment.h"
#include "effect/rank_share.h"
#include "linear/block_matrix.h"
#include "scene/ranks.h"
#include "system/feasible_step.h"
#include "system/proximity.h"
#include "system/ranks.h"
#include "system/system.h"
#include "system/work.h"

/* Effects on the unit cube; obstacles are near it, with friction, and bodies' faces are near the core of a ball. */
static const char *const shared[] = {
    "inertia: {}",
    "elasticity: {}",
    "gravity: {}",
    "damping: {mass: 2, stiffness: 0.01, stiffness_at: current}",
    "viscosity: {shear: 300, bulk: 500}",
    "spring: {point: [0.9, 0.8, 0.3], stiffness: 1000, target: [{time: 0, position: [2, 1, 1]}]}",
    "spring: {point: [0.9, 0.8, 0.3], radius: 0, stiffness: 1000, target: [{time: 0, position: [2, 1, 1]}]}",
    "spring: {point: [1.5, 0.8, 0.3], radius: 0, stiffness: 1000, target: [{time: 0, position: [2, 1, 1]}]}",
    "force: {box: [[0.9, -1, -1], [2, 2, 2]], force: [100, 0, -50]}",
    "traction: {box: [[0.9, -1, -1], [2, 2, 2]], traction: [0, 300, 100]}",
    "drag: {box: [[-1, -1, -1], [2, 2, 2]], density: 1.2, velocity: [-20, 3, 0]}",
    "buoyancy: {level: 0.6}",
    "pressure: {box: [[-1, -1, -1], [2, 2, 2]], pressure: 2000}",
    "pressure: {box: [[0.9, -1, -1], [2, 2, 2]], pressure: 2000}",
    "settling_damping: {rate: 20, speed: 1.5, until: 2}",
    "settling_damping: {rate: 20, until: 2}",
    "muscle: {fibres: {direction: [1, 2, 0.5]}, peak_stress: 30000, optimal_stretch: 0.6}",
    "muscle: {box: [[-1, -1, -1], [0.3, 0.8, 0.8]], fibres: {direction: [1, 2, 0.5]}, peak_stress: 3e4}",
    "contact: {plane: {point: [0, 0, -0.1], normal: [0.02, 0.01, 1]}, friction: 0.3, slip_speed: 1, thickness: 0.4, stiffness: 1e5}",
    "contact: {sphere: {centre: [0.5, 0.5, 1.6], radius: 0.5}, friction: 0.3, slip_speed: 1, thickness: 0.4, stiffness: 1e5}",
    "contact: {sphere: {centre: [0.4167, 0.4167, 1.07], radius: 0.1}, thickness: 0.1, stiffness: 1e5}",
    "contact: {between: all, thickness: 0.2, stiffness: 1e5, friction: 0.3, slip_speed: 1, adaptive: true}",
    "contact: {between: all, thickness: 0.2, stiffness: 1e5, friction: 0.3, slip_speed: 1}",
    "contact: {between: all, thickness: 0.1, stiffness: 1e5, friction: 0.3, slip_speed: 1, intersecting: separate}",
    "weld: {first: {box: [[-1, -1, 0.9], [2, 2, 2]]}, second: {box: [[-1, -1, -1], [2, 2, 0.1]]}, distance: 2}",
    "weld: {first: {box: [[-1, -1, 0.9], [2, 2, 2]]}, second: {box: [[-1, -1, -1], [2, 2, 0.1]]}, distance: 2, breaks_at: 4000}",
    "joint: {first: {box: [[-1, -1, 0.9], [2, 2, 2]]}, second: {box: [[-1, -1, -1], [2, 0.1, 2]]}, point: [0.5, 0, 1], stiffness: 1e4}",
    "joint: {first: {box: [[-1, -1, 0.9], [2, 2, 2]]}, second: {box: [[-1, -1, -1], [2, 0.1, 2]]}, point: [0.5, 0, 1], axis: [0.2, 0, 0], stiffness: 1e4}",
    "joint: {first: {box: [[-1, -1, 0.9], [2, 2, 2]]}, second: {box: [[-1, -1, -1], [2, 0.1, 2]]}, point: [0.5, 0.5, 1], to: [0.2, 0, 0.3], length: 0.7, stiffness: 1e4}",
};
enum { SHARED = sizeof shared / sizeof *shared };

/* A scene of one effect, and this rank's share of it. */
typedef struct pair {
  const char *text;
  flesh_scene *scene;
  flesh_scene_share *share;
  const flesh_system *systems[2]; /* systems of the whole and of the part */
  int n[2];
  double *x[2], *v[2], *a[2], *x_lag[2], *v_lag[2];
  double *multipliers[2], *internal; /* all ranks have the internal variables of the whole */
  flesh_point points[2];
} pair;

static double *vector(int n) { return calloc((size_t)n + 1, sizeof(double)); }

/* Fills in random vectors for the whole and for this rank's part of it. */
static void disturb(pair *p, double size, const double *around, unsigned long long seed, double *both[2])
{
  const int *nodes = flesh_rank_part_nodes(flesh_scene_share_part(p->share));
  for (int k = 0; k < 2; k++) both[k] = vector(p->n[k]);
  for (int d = 0; d < p->n[0]; d++) both[0][d] = (around ? around[d] : 0) + size * (test_uniform(&seed) - 0.5);
  for (int d = 0; d < p->n[1]; d++) both[1][d] = both[0][3 * nodes[d / 3] + d % 3];
}

static int open_pair(const char *text, int order, pair *p)
{
  char scene[2000];
  const char *element = order == 2 ? "tet10" : order ? "tet4" : "tet10-mean";
  int length = snprintf(scene, sizeof scene,
                        "body: {mesh: cube.msh, density: 900, element: %s, material: {energy: S, young: 2e4, poisson: %s}}\n"
                        "effects: [%s]\n"
                        "time: {end: 1}\n",
                        element, order ? "0.4" : "0.5", text);
  if (strstr(text, "between")) /* another cube above */
    snprintf(scene + length, sizeof scene - (size_t)length,
             "bodies: [{name: other, mesh: cube.msh, translation: [0.3, 0.2, 1.07], density: 900, element: %s, "
             "material: {energy: S, young: 2e4, poisson: 0.4}}]\n", element);
  *p = (pair){.text = text};
  CHECK_OK(flesh_scene_read_text(scene, file_path("cube.yaml"), 0, NULL, &p->scene));
  if (!p->scene) return FLESH_ERR_ARGUMENT;
  const int status = flesh_scene_share_create(p->scene, ranks, &p->share);
  if (status) return status;
  p->systems[0] = flesh_scene_system(p->scene);
  p->systems[1] = flesh_scene_share_system(p->share);
  for (int k = 0; k < 2; k++) p->n[k] = flesh_system_unknowns(p->systems[k]);
  const double *X = flesh_mesh_positions(flesh_scene_mesh(p->scene));
  disturb(p, 0.02, X, 1, p->x);
  disturb(p, 2, NULL, 2, p->v);
  disturb(p, 9, NULL, 3, p->a);
  disturb(p, 0.02, X, 4, p->x_lag);
  disturb(p, 2, NULL, 5, p->v_lag);
  for (int k = 0; k < 2; k++) p->multipliers[k] = vector(flesh_system_multiplier_count(p->systems[k]));
  for (int e = 0; e < flesh_system_multiplier_count(p->systems[0]); e++) p->multipliers[0][e] = 100 * e;
  for (int e = 0; e < flesh_system_multiplier_count(p->systems[1]); e++)
    p->multipliers[1][e] = 100 * flesh_rank_part_tets(flesh_scene_share_part(p->share))[e];
  const int variables = flesh_system_internal_count(p->systems[0]);
  unsigned long long seed = 6;
  CHECK(variables == flesh_system_internal_count(p->systems[1]));
  p->internal = vector(variables);
  for (int k = 0; k < variables; k++) p->internal[k] = test_uniform(&seed) < 0.3;
  for (int k = 0; k < 2; k++) {
    p->points[k] = flesh_point_at(0.01, p->x[k], p->v[k], p->a[k]);
    p->points[k].lagged = (flesh_lagged){0, p->x_lag[k], p->v_lag[k]};
    p->points[k].multipliers = p->multipliers[k];
    p->points[k].internal = p->internal;
  }
  return FLESH_OK;
}

static void close_pair(pair *p)
{
  for (int k = 0; k < 2; k++) free(p->x[k]), free(p->v[k]), free(p->a[k]), free(p->x_lag[k]), free(p->v_lag[k]);
  free(p->internal);
  free(p->multipliers[0]), free(p->multipliers[1]);
  flesh_scene_share_destroy(&p->share);
  flesh_scene_destroy(&p->scene);
}

/* Returns the difference of the ranks' own values from the whole's vector, over its largest number. */
static double difference(const pair *p, const double *own, const double *whole)
{
  double *gathered = vector(p->n[0]), most = 0, worst = 0;
  flesh_rank_part_gather(flesh_scene_share_part(p->share), own, gathered);
  for (int d = 0; d < p->n[0]; d++) {
    most = fmax(most, fabs(whole[d]));
    worst = fmax(worst, fabs(gathered[d] - whole[d]));
  }
  free(gathered);
  return most > 0 ? worst / most : worst;
}

static void check_sums(const pair *p)
{
  enum { EFFECTS = 4 };
  static const flesh_shift shifts[] = {{.x = 1, .v = 60, .a = 3600}, {.x = 1}};
  double *r[2] = {vector(p->n[0]), vector(p->n[1])}, phi[2], sizes[2], energies[2][EFFECTS] = {{0}};
  for (int s = 0; s < 2; s++) {
    for (int k = 0; k < 2; k++) {
      sizes[k] = phi[k] = 0;
      CHECK_OK(test_evaluate(p->systems[k], &p->points[k], &shifts[s], r[k], &phi[k], &sizes[k]));
      CHECK_OK(flesh_system_energies(p->systems[k], &p->points[k], energies[k]));
    }
    CHECK_BELOW(difference(p, r[1], r[0]), 1e-12);
    CHECK_NEAR(phi[1], phi[0], 1e-11 * sizes[0]);
    for (int e = 0; e < flesh_system_effect_count(p->systems[0]); e++)
      CHECK_NEAR(energies[1][e], energies[0][e], 1e-11 * fabs(energies[0][e]));
    CHECK_OK(flesh_system_residual(p->systems[1], &p->points[1], r[1]));
    CHECK_BELOW(difference(p, r[1], r[0]), 1e-12);
    CHECK_OK(flesh_system_potential(p->systems[1], &p->points[1], &shifts[s], &phi[1], &sizes[1]));
    CHECK_NEAR(phi[1], phi[0], 1e-11 * sizes[0]);
  }
  for (int k = 0; k < 2; k++) free(r[k]);
}

/* The sum of the ranks' products is that of the whole's matrix. */
static void check_products(const pair *p)
{
  const flesh_shift shift = {.x = 1, .v = 60, .a = 3600};
  double *y[2] = {vector(p->n[0]), vector(p->n[1])};
  for (int k = 0; k < 2; k++) {
    flesh_block_matrix *K = NULL;
    flesh_proximity proximity;
    flesh_point point = p->points[k];
    const int grows = strstr(p->text, "between") != NULL;
    int grown, changed;
    const flesh_environment environment = {.proximity = &proximity};
    point.environment = &environment;
    CHECK_OK(flesh_proximity_create(p->systems[k], NULL, &proximity));
    CHECK_OK(flesh_proximity_follow(&proximity, 0, point.lagged.t, point.lagged.x, &changed));
    CHECK_OK(flesh_system_matrix_create(p->systems[k], &K));
    CHECK_OK(flesh_proximity_cover(&proximity, &point, K, &grown));
    CHECK(grown == grows);
    if (k && flesh_communicator_rank(ranks) > 0) { /* all but the first lack blocks again, and all get them */
      flesh_block_matrix_destroy(&K);
      CHECK_OK(flesh_system_matrix_create(p->systems[k], &K));
    }
    if (k) CHECK_OK(flesh_proximity_cover(&proximity, &point, K, &grown));
    CHECK(grown == grows);
    CHECK_OK(flesh_system_jacobian(p->systems[k], &point, &shift, K));
    flesh_block_multiply(K, p->a[k], y[k]);
    flesh_block_matrix_destroy(&K);
    flesh_proximity_clear(&proximity);
  }
  flesh_team_add_ghosts(flesh_system_team(p->systems[1]), y[1]);
  CHECK_BELOW(difference(p, y[1], y[0]), 1e-12);
  for (int k = 0; k < 2; k++) free(y[k]);
}

/* Half-way to the obstacles and beyond. */
static void check_steps(const pair *p)
{
  double *to[2], steps[2];
  for (int k = 0; k < 2; k++) {
    to[k] = vector(p->n[k]);
    for (int d = 0; d < p->n[k]; d++) to[k][d] = p->x_lag[k][d] + (d % 3 == 2 ? (p->x_lag[k][d] < 0.5 ? -0.5 : 0.9) : 0.1);
    steps[k] = flesh_system_max_feasible_step(p->systems[k], NULL, NULL, 0, p->x_lag[k], 0.01, to[k]);
    flesh_system_push_out(p->systems[k], 0, p->x_lag[k], 0.01, to[k]);
    CHECK_OK(flesh_system_check(p->systems[k], 0, p->x_lag[k]));
  }
  CHECK_NEAR(steps[1], steps[0], 1e-12);
  const int *nodes = flesh_rank_part_nodes(flesh_scene_share_part(p->share));
  for (int d = 0; d < p->n[1]; d++) CHECK_NEAR(to[1][d], to[0][3 * nodes[d / 3] + d % 3], 1e-14); /* ghosts, too */
  for (int k = 0; k < 2; k++) free(to[k]);
}

/* Every rank finds the same as one rank, bit for bit. */
static void check_internal(const pair *p)
{
  const int count = flesh_system_internal_count(p->systems[0]);
  double *next[2] = {vector(count), vector(count)}, *most = vector(count);
  int changed[2] = {0};
  for (int k = 0; k < 2 && count; k++) {
    memcpy(next[k], p->internal, (size_t)count * sizeof(double));
    CHECK_OK(flesh_system_update_internal(p->systems[k], &p->points[k], next[k], &changed[k]));
  }
  CHECK(changed[0] == changed[1]);
  for (int i = 0; i < count; i++) CHECK_NEAR(next[1][i], next[0][i], 1e-12 * fabs(next[0][i]));
  for (int i = 0; i < count; i++) most[i] = next[1][i];
  if (count) flesh_communicator_largest(ranks, count, most);
  for (int i = 0; i < count; i++) CHECK(most[i] == next[1][i]);
  if (strncmp(p->text, "weld", 4) == 0 && count) CHECK(changed[0]);
  for (int k = 0; k < 2; k++) free(next[k]);
  free(most);
}

static void make_cube(int cells)
{
  flesh_mesh *cube = NULL;
  CHECK_OK(flesh_mesh_box((int[]){cells, cells, cells}, (double[]){1, 1, 1}, (double[]){0, 0, 0}, &cube));
  CHECK_OK(flesh_mesh_write(cube, file_path("cube.msh")));
  flesh_mesh_destroy(&cube);
}

/* Contact between bodies takes longer, and is tested once on tets of each kind. */
static int is_there(int k)
{
  return !strstr(shared[k / 2], "between") || k % 2 == (strstr(shared[k / 2], "separate") != NULL);
}

static void check_effects(int cells)
{
  make_cube(cells);
  for (int k = 0; k < 2 * SHARED; k++) {
    pair p;
    const int before = test_failures;
    if (!is_there(k)) continue;
    CHECK_OK(open_pair(shared[k / 2], 1 + k % 2, &p));
    if (p.share) {
      check_sums(&p);
      check_products(&p);
      check_steps(&p);
      check_internal(&p);
    }
    if (test_failures > before) printf("# order %d: %s\n", 1 + k % 2, p.text);
    close_pair(&p);
  }
}

static void what_ranks_have_adds_up_to_the_effect(void) { check_effects(3); }

/* The coarsest mesh has six tets. */
static void so_it_does_on_the_coarsest_mesh(void)
{
  if (flesh_communicator_size(ranks) <= 6) check_effects(1);
}

/* Also if ranks have all corners of faces that are not theirs. */
static void a_face_is_of_one_rank(void)
{
  flesh_mesh *cube = NULL;
  flesh_rank_part *part = NULL;
  int total, found = 0, *kept = NULL, *local = NULL, of[48];
  CHECK_OK(flesh_mesh_box((int[]){2, 2, 2}, (double[]){1, 1, 1}, (double[]){0, 0, 0}, &cube));
  for (int t = 0; t < 48; t++) of[t] = t % flesh_communicator_size(ranks);
  CHECK_OK(flesh_rank_part_create(ranks, cube, of, &part));
  const int *surface = flesh_mesh_surface(cube, &total);
  CHECK_OK(flesh_rank_share_faces(part, total, surface, &found, &kept, &local));
  for (int k = 0; k < found; k++) {
    CHECK(of[flesh_mesh_surface_tets(cube)[kept[k]]] == flesh_communicator_rank(ranks));
    for (int a = 0; a < 3; a++) CHECK(flesh_rank_part_nodes(part)[local[3 * k + a]] == surface[3 * kept[k] + a]);
  }
  double all = found;
  flesh_communicator_sum(ranks, 1, &all);
  CHECK(all == total);
  flesh_free(kept);
  flesh_free(local);
  flesh_rank_part_destroy(&part);
  flesh_mesh_destroy(&cube);
}

/* Incompressible tets have a pressure each, which is that on one rank. */
static void pressures_of_incompressible_tets_are_shared_out(void)
{
  pair p;
  make_cube(3);
  CHECK_OK(open_pair("elasticity: {}", 0, &p));
  if (p.share) {
    double sum = flesh_system_multiplier_count(p.systems[1]);
    flesh_communicator_sum(ranks, 1, &sum);
    CHECK(sum == flesh_system_multiplier_count(p.systems[0]) && sum == 162);
    check_sums(&p);
    check_products(&p);
  }
  close_pair(&p);
}

/* A belt that moves at the first rank and pushes with 1 N along x there. */
static int belt_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  (void)effect, (void)point;
  r[0] -= 1;
  return FLESH_OK;
}

static int belt_carry(const flesh_effect *effect, const flesh_point *point, double t_from, double t_to, double *dx)
{
  (void)effect, (void)point;
  if (flesh_communicator_rank(ranks) > 0) return 0;
  dx[0] = 3 * (t_to - t_from);
  return 1;
}

static const flesh_effect_operations belt = {.name = "belt",
                                             .role = FLESH_ROLE_LOAD,
                                             .residual = belt_residual,
                                             .time = &(const flesh_effect_time){.carry = belt_carry}};

/* A prescribed motion that acts on one rank and not on the others does work; all ranks know how much. */
static void what_stands_still_on_some_ranks_works_on_others(void)
{
  pair p;
  flesh_effect *effect = NULL;
  make_cube(3);
  CHECK_OK(open_pair("elasticity: {}", 1, &p));
  flesh_system *system = NULL;
  const flesh_rank_part *part = flesh_scene_share_part(p.share);
  CHECK_OK(flesh_system_create(flesh_rank_part_mesh(part), &system));
  CHECK_OK(flesh_effect_create(&belt, flesh_rank_part_mesh(part), NULL, &effect));
  CHECK_OK(flesh_system_add_effect(system, &effect));
  CHECK_OK(flesh_system_finalize(system));
  CHECK_OK(flesh_system_set_part(system, part));
  double *scratch = vector(2 * p.n[1]), *u = vector(p.n[1]), work = NAN;
  CHECK_OK(flesh_system_work_of_forces(system, &p.points[1], 0, 0.5, u, scratch, &work));
  CHECK(work == 1.5);
  free(scratch);
  free(u);
  flesh_system_destroy(&system);
  close_pair(&p);
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  const int failed = RUN_TESTS_ON_RANKS(argc, argv, TEST(what_ranks_have_adds_up_to_the_effect),
                                        TEST(so_it_does_on_the_coarsest_mesh), TEST(a_face_is_of_one_rank),
                                        TEST(pressures_of_incompressible_tets_are_shared_out),
                                        TEST(what_stands_still_on_some_ranks_works_on_others));
  test_folder_remove(folder);
  return failed;
}
