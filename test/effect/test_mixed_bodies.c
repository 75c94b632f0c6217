// TEST quick seconds=60
/* test_mixed_bodies.c: bodies of four-node and of ten-node tets in one scene each behave as alone: forces, energies and
 * stiffness of every effect, statics and motion, probes, frames. */
#include "scene_files.h"
#include "effect/private.h"

#include <math.h>
#include <stdlib.h>

#include "flesh/effect.h"
#include "flesh/effects.h"
#include "flesh/integrator.h"
#include "flesh/system.h"
#include "output/fields.h"
#include "output/tet_stress.h"
#include "output/vtu.h"

#define MATERIAL "{energy: S, young: 4e5, poisson: 0.45}"

/* Each body's own loads; the arguments are the selection, four times, and then the springs' positions. */
static const char loads[] =
    "  - traction: {%sbox: [[3.9, -99, -1], [9, 99, 9]], traction: [300, 0, -900]}\n"
    "  - pressure: {%sbox: [[-1, -99, 0.99], [9, 99, 9]], pressure: 700}\n"
    "  - pressure: {%sbox: [[-99, -99, -99], [99, 99, 99]], pressure: 400}\n"
    "  - force: {%sbox: [[-99, -99, -99], [99, 99, 99]], force: [50, 20, 10]}\n"
    "  - spring: {point: [3.4, %g, 0.6], stiffness: 900, target: [{time: 0, position: [4, %g, 2]}]}\n"
    "  - spring: {point: [2.3, %g, 0.7], radius: 0.8, stiffness: 700, target: [{time: 0, position: [3, %g, 1.5]}]}\n";
static const char shared[] = "  - inertia: {}\n  - gravity: {}\n  - viscosity: {shear: 200, bulk: 300}\n"
                             "  - damping: {mass: 0.3, stiffness: 0.01}\n"
                             "  - damping: {mass: 0.1, stiffness: 0.02, stiffness_at: current}\n"
                             "  - contact: {plane: {point: [0, 0, -0.02]}, thickness: 0.3, stiffness: 1e5,\n"
                             "              friction: 0.4}\n";
static const char solver[] = "solver: {newton_tolerance: 1e-11, linear_tolerance: 1e-4}\n";

static const char *const elements[3] = {"tet10-mean", "tet4", "tet10"};
enum { BODIES = 3 };

static void add_loads(char *text, size_t size, const char *of, double y)
{
  size_t used = strlen(text);
  snprintf(text + used, size - used, loads, of, of, of, of, y + 0.4, y + 0.5, y + 0.5, y + 0.5);
}

/* The bodies of a scene: all of them at y = 0, 5, 10, or a single one at 0. */
static void begin(char *text, size_t size, int alone, const char *mass)
{
  if (alone >= 0) {
    snprintf(text, size, "body: {element: %s, mass: %s, mesh: bar.node, material: " MATERIAL "}\n",
             elements[alone], mass);
    return;
  }
  snprintf(text, size,
           "body: {name: a, element: tet10-mean, mass: %s, mesh: bar.node, material: " MATERIAL "}\n"
           "bodies: [{name: b, element: tet4, mesh: bar.node, translation: [0, 5, 0], material: " MATERIAL "},\n"
           "         {name: c, element: tet10, mesh: bar.node, translation: [0, 10, 0]}]\n", mass);
}

static flesh_scene *open_scene(int alone, const char *mass, const char *effects, int with_loads, const char *rest)
{
  char text[9000];
  flesh_scene *scene = NULL;
  begin(text, sizeof text, alone, mass);
  strcat(text, "effects:\n");
  strcat(text, effects);
  for (int k = 0; with_loads && k < BODIES; k++)
    if (alone < 0) add_loads(text, sizeof text, k == 0 ? "body: a, " : k == 1 ? "body: b, " : "body: c, ", 5 * k);
  if (with_loads && alone >= 0) add_loads(text, sizeof text, "", 0);
  strcat(text, rest);
  CHECK_OK(read_scene("scene.yaml", text, 0, NULL, &scene));
  return scene;
}

static double chance(unsigned *seed)
{
  *seed = *seed * 1664525u + 1013904223u;
  return *seed / 4294967296. - 0.5;
}

/* Positions and motions of the nodes as functions of their rest positions without the translation in y. */
static void shake(const flesh_mesh *mesh, double *x, double *v, double *a)
{
  const double *X = flesh_mesh_positions(mesh);
  for (int i = 0; i < flesh_mesh_node_count(mesh); i++) {
    const double y = X[3 * i + 1] - 5 * floor((X[3 * i + 1] + 0.01) / 5);
    unsigned seed = (unsigned)(lround(8 * X[3 * i]) + 97 * lround(8 * y) + 997 * lround(8 * X[3 * i + 2]) + 5);
    for (int k = 0; k < 3; k++) chance(&seed);
    for (int c = 0; c < 3; c++) {
      x[3 * i + c] = X[3 * i + c] + 0.06 * chance(&seed) + (c == 2 ? 0.05 : 0);
      v[3 * i + c] = chance(&seed);
      a[3 * i + c] = chance(&seed);
    }
  }
}

/* A system at a disturbed state: residual, energies, potential and the product of its Jacobian with `v`. */
typedef struct values {
  int n;
  double *x, *v, *a, *r, *Kv, energy[32], phi;
} values;

static void multiply(const flesh_block_matrix *K, const double *v, double *y)
{
  for (int i = 0; i < K->rows; i++)
    for (int k = K->row_start[i]; k < K->row_end[i]; k++)
      for (int p = 0; p < 9; p++) {
        const int j = K->column[k];
        y[3 * i + p / 3] += K->values[9 * (size_t)k + p] * v[3 * j + p % 3];
        if (i != j) y[3 * j + p % 3] += K->values[9 * (size_t)k + p] * v[3 * i + p / 3];
      }
}

static values evaluate(const flesh_scene *scene)
{
  const flesh_system *system = flesh_scene_system(scene);
  const size_t n = (size_t)flesh_system_unknowns(system);
  double *all = calloc(5 * n, sizeof *all), magnitude;
  values o = {.n = (int)n, .x = all, .v = all + n, .a = all + 2 * n, .r = all + 3 * n, .Kv = all + 4 * n};
  const flesh_shift shift = {1, 60, 3600, FLESH_FILTER_CLAMP};
  flesh_block_matrix *K = NULL;
  shake(flesh_scene_mesh(scene), o.x, o.v, o.a);
  const flesh_point point = flesh_point_at(0.1, o.x, o.v, o.a);
  CHECK_OK(flesh_system_residual(system, &point, o.r));
  CHECK_OK(flesh_system_energies(system, &point, o.energy));
  CHECK_OK(flesh_system_potential(system, &point, &shift, &o.phi, &magnitude));
  CHECK_OK(flesh_system_matrix_create(system, &K));
  CHECK_OK(flesh_system_jacobian(system, &point, &shift, K));
  multiply(K, o.v, o.Kv);
  flesh_block_matrix_destroy(&K);
  return o;
}

static double largest(int n, const double *x)
{
  double most = 0;
  for (int d = 0; d < n; d++) most = fmax(most, fabs(x[d]));
  return most;
}

static void compare(const char *what, int n, const double *whole, const double *own, double tolerance)
{
  double most = largest(n, own), off = 0;
  for (int d = 0; d < n; d++) off = fmax(off, fabs(whole[d] - own[d]));
  printf("# %s: off by %.2g of %.3g\n", what, off, most);
  CHECK(most > 0 && off <= tolerance * most);
}

/* Compares forces and stiffness of all effects together, and the sums of energies and potentials. */
static void effects_are_those_of_each_body(void)
{
  static const char *const masses[] = {"lumped", "consistent"};
  static const char rest[] = "time: {end: 1}\n";
  for (int m = 0; m < 2; m++) {
    char effects[2000];
    snprintf(effects, sizeof effects, "%s", shared);
    flesh_scene *scene = open_scene(-1, masses[m], effects, 1, rest);
    values all = evaluate(scene);
    double phi = 0, energy = 0, sum = 0;
    const int count = flesh_system_effect_count(flesh_scene_system(scene));
    for (int e = 0; e < count; e++) energy += isnan(all.energy[e]) ? 0 : all.energy[e];
    for (int k = 0, at = 0; k < BODIES; k++) {
      flesh_scene *alone = open_scene(k, masses[m], effects, 1, rest);
      values own = evaluate(alone);
      const int own_count = flesh_system_effect_count(flesh_scene_system(alone));
      compare("r", own.n, all.r + at, own.r, 1e-11);
      compare("K v", own.n, all.Kv + at, own.Kv, 1e-11);
      for (int e = 0; e < own_count; e++) sum += isnan(own.energy[e]) ? 0 : own.energy[e];
      phi += own.phi;
      at += own.n;
      CHECK(k < BODIES - 1 || at == all.n);
      free(own.x);
      flesh_scene_destroy(&alone);
    }
    printf("# energy %.12g of %.12g J, potential %.12g of %.12g J\n", energy, sum, all.phi, phi);
    CHECK_NEAR(energy, sum, 1e-10 * fabs(sum));
    CHECK_NEAR(all.phi, phi, 1e-10 * fabs(phi));
    free(all.x);
    flesh_scene_destroy(&scene);
  }
}

static void derivatives_are_consistent(void)
{
  flesh_scene *scene = open_scene(-1, "consistent", shared, 1, "time: {end: 1}\n");
  const flesh_system *system = flesh_scene_system(scene);
  const size_t n = (size_t)flesh_system_unknowns(system);
  double *x = malloc(3 * n * sizeof *x);
  shake(flesh_scene_mesh(scene), x, x + n, x + 2 * n);
  for (int e = 0; e < flesh_system_effect_count(system); e++) {
    const flesh_effect *effect = flesh_system_effect(system, e);
    flesh_derivative_report report;
    CHECK_OK(flesh_effect_check_derivatives(effect, flesh_scene_mesh(scene), 0.1, x, 7, &report));
    CHECK(flesh_derivative_report_passes(&report, 1e-6));
  }
  free(x);
  flesh_scene_destroy(&scene);
}

/* Takes steps of a method; state.x is allocated. */
static flesh_state go(const flesh_scene *scene, flesh_method method, int steps, double h)
{
  const size_t n = (size_t)flesh_system_unknowns(flesh_scene_system(scene));
  flesh_state state = {.x = malloc(2 * n * sizeof(double))};
  flesh_integrator *integrator = NULL;
  state.v = state.x + n;
  flesh_scene_start(scene, &state);
  CHECK_OK(flesh_integrator_create(flesh_scene_system(scene), method, flesh_scene_solver(scene), &integrator));
  CHECK_OK(flesh_integrator_set_max_energy_gain(integrator, INFINITY)); /* steps must not be cut because of the energy
                                                                         * of all bodies */
  for (int k = 0; k < steps; k++) CHECK_OK(flesh_integrator_step(integrator, &state, h, NULL));
  flesh_integrator_destroy(&integrator);
  return state;
}

/* Compares the displacements of each body with those it has alone. */
static void check_bodies(const flesh_scene *scene, const flesh_state *state, const char *effects, int with_loads,
                         const char *rest, flesh_method method, int steps, double h, double tolerance)
{
  const double *X = flesh_mesh_positions(flesh_scene_mesh(scene));
  for (int k = 0, at = 0; k < BODIES; k++) {
    flesh_scene *alone = open_scene(k, "lumped", effects, with_loads, rest);
    flesh_state own = go(alone, method, steps, h);
    const int n = flesh_system_unknowns(flesh_scene_system(alone));
    double *u = malloc(2 * (size_t)n * sizeof *u), *u_own = u + n;
    for (int d = 0; d < n; d++) {
      u[d] = state->x[at + d] - X[at + d];
      u_own[d] = own.x[d] - flesh_mesh_positions(flesh_scene_mesh(alone))[d];
    }
    compare(elements[k], n, u, u_own, tolerance);
    at += n;
    free(u);
    free(own.x);
    flesh_scene_destroy(&alone);
  }
}

static const char pins[] = "  - pin: {box: [[-1, -99, -1], [1e-9, 99, 9]]}\n";

static void equilibria_are_those_of_each_body(void)
{
  char effects[500], rest[500];
  snprintf(effects, sizeof effects, "%s  - gravity: {}\n", pins);
  snprintf(rest, sizeof rest, "%s", solver);
  flesh_scene *scene = open_scene(-1, "lumped", effects, 1, rest);
  flesh_state state = go(scene, FLESH_METHOD_STATIC, 1, 0);
  check_bodies(scene, &state, effects, 1, rest, FLESH_METHOD_STATIC, 1, 0, 1e-7);
  free(state.x);
  flesh_scene_destroy(&scene);
}

static void motions_are_those_of_each_body(void)
{
  static const flesh_method methods[] = {FLESH_METHOD_BACKWARD_EULER, FLESH_METHOD_MIDPOINT, FLESH_METHOD_BDF2};
  char effects[2000], rest[500];
  snprintf(effects, sizeof effects, "%s%s", pins, shared);
  snprintf(rest, sizeof rest, "time: {end: 1}\n%s", solver);
  flesh_scene *scene = open_scene(-1, "lumped", effects, 1, rest);
  for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
    flesh_state state = go(scene, methods[m], 3, 1. / 60);
    check_bodies(scene, &state, effects, 1, rest, methods[m], 3, 1. / 60, 1e-6);
    free(state.x);
  }
  flesh_scene_destroy(&scene);
}

/* Computes the momentum of one body, kg m/s. */
static void momentum_of(const flesh_scene *scene, int body, const double *v, double p[3])
{
  const flesh_body *of = flesh_scene_body(scene);
  const size_t n = (size_t)flesh_mesh_node_count(of->mesh);
  double *density = calloc((size_t)flesh_mesh_tet_count(of->mesh), sizeof *density), *mass = malloc(n * sizeof *mass);
  for (int t = 0; t < of->parts[body].tets; t++) density[of->parts[body].first_tet + t] = 1000;
  flesh_mesh_lumped_mass(of->mesh, density, mass);
  p[0] = p[1] = p[2] = 0;
  for (size_t d = 0; d < 3 * n; d++) p[d % 3] += mass[d / 3] * v[d];
  free(density);
  free(mass);
}

/* Free bodies that fall on a plane without friction keep their horizontal momentum and bounce back. */
static void momentum_is_kept_in_a_collision(void)
{
  static const char effects[] = "  - inertia: {}\n"
                                "  - contact: {plane: {point: [0, 0, -0.05]}, thickness: 0.04, stiffness: 1e6}\n";
  char rest[500];
  snprintf(rest, sizeof rest, "start: {velocity: [0.3, 0.2, -2]}\ntime: {end: 1}\n%s", solver);
  flesh_scene *scene = open_scene(-1, "lumped", effects, 0, rest);
  flesh_state state = go(scene, FLESH_METHOD_NEWMARK, 40, 1. / 240);
  for (int k = 0; k < BODIES; k++) {
    double p[3];
    momentum_of(scene, k, state.v, p);
    printf("# %s: %.12g %.12g %.12g kg m/s\n", elements[k], p[0], p[1], p[2]);
    CHECK_NEAR(p[0], 0.3 * 4000, 1e-6 * 4000);
    CHECK_NEAR(p[1], 0.2 * 4000, 1e-6 * 4000);
    CHECK(p[2] > 0); /* it arrived with -8000 */
  }
  check_bodies(scene, &state, effects, 0, rest, FLESH_METHOD_NEWMARK, 40, 1. / 240, 1e-6);
  free(state.x);
  flesh_scene_destroy(&scene);
}

/* Four-node tets must not share an edge with ten-node tets. */
static void meshes_are_checked(void)
{
  flesh_scene *scene = open_scene(-1, "lumped", "  - inertia: {}\n", 0, "time: {end: 1}\n");
  const flesh_mesh *mesh = flesh_scene_mesh(scene);
  const int *edges = flesh_mesh_tet_edges(mesh), tets = flesh_mesh_tet_count(mesh), nodes = flesh_mesh_node_count(mesh);
  int *ten = malloc(10 * (size_t)tets * sizeof *ten), triangles;
  flesh_mesh_info info;
  flesh_mesh *made = NULL, *lowered = NULL, *none = NULL;
  flesh_mesh_inspect(mesh, &info);
  CHECK(info.order == 2 && info.quadratic == 48 && info.tets == 72 && info.unused_nodes == 0);
  CHECK_NEAR(info.volume, 12, 1e-12);
  (void)flesh_mesh_surface(mesh, &triangles);
  CHECK(triangles == 36 * (4 + 1 + 4));
  for (int t = 0; t < tets; t++) {
    memcpy(ten + 10 * t, flesh_mesh_tets(mesh) + 4 * t, 4 * sizeof *ten);
    memcpy(ten + 10 * t + 4, edges + 6 * t, 6 * sizeof *ten);
    CHECK((edges[6 * t] < 0) == (t >= 24 && t < 48));
  }
  CHECK_OK(flesh_mesh_create_quadratic(nodes, flesh_mesh_positions(mesh), tets, ten, NULL, &made));
  CHECK(!memcmp(flesh_mesh_tet_edges(made), edges, 6 * (size_t)tets * sizeof *edges));
  CHECK_OK(flesh_mesh_lower_order(made, &lowered));
  CHECK(flesh_mesh_order(lowered) == 1 && flesh_mesh_node_count(lowered) == 60);
  CHECK(flesh_mesh_write(made, file_path("mixed.msh")) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "tets of four nodes and of ten");
  CHECK(flesh_mesh_refine(made, &none) == FLESH_ERR_ARGUMENT && !none);
  for (int k = 4; k < 10; k++) ten[k] = -1;
  CHECK(flesh_mesh_create_quadratic(nodes, flesh_mesh_positions(mesh), tets, ten, NULL, &none) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "a tet of four nodes has that edge too");
  ten[4] = 1;
  CHECK(flesh_mesh_create_quadratic(nodes, flesh_mesh_positions(mesh), tets, ten, NULL, &none) == FLESH_ERR_ARGUMENT);
  for (int t = 0; t < tets; t++)
    for (int k = 4; k < 10; k++) ten[10 * t + k] = -1;
  CHECK_OK(flesh_mesh_create_quadratic(nodes, flesh_mesh_positions(mesh), tets, ten, NULL, &none));
  CHECK(flesh_mesh_order(none) == 1);
  flesh_mesh_destroy(&none);
  flesh_mesh_destroy(&lowered);
  flesh_mesh_destroy(&made);
  free(ten);
  flesh_scene_destroy(&scene);
}

/* A four-node tet and a ten-node tet that share a corner: their contributions there are added. */
static void groups_may_share_a_corner(void)
{
  static const double X[33] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, -1, 0, 0, 0, -1, 0, 0, 0, -1};
  static const int ends[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
  double x[39];
  int nodes[20] = {0, 4, 5, 6, -1, -1, -1, -1, -1, -1, 0, 1, 2, 3, 7, 8, 9, 10, 11, 12};
  unsigned seed = 3;
  flesh_mesh *mesh = NULL;
  flesh_material material;
  flesh_effect *effect = NULL;
  flesh_derivative_report report;
  memcpy(x, X, 21 * sizeof *x);
  for (int k = 0; k < 6; k++)
    for (int c = 0; c < 3; c++) x[21 + 3 * k + c] = (X[3 * ends[k][0] + c] + X[3 * ends[k][1] + c]) / 2;
  CHECK_OK(flesh_mesh_create_quadratic(13, x, 2, nodes, NULL, &mesh));
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.45, &material));
  CHECK_OK(flesh_effect_elasticity(&(flesh_body){.mesh = mesh, .materials = &material}, &effect));
  for (int d = 0; d < 39; d++) x[d] += 0.1 * chance(&seed);
  CHECK_OK(flesh_effect_check_derivatives(effect, mesh, 0, x, 5, &report));
  CHECK(flesh_derivative_report_passes(&report, 1e-6));
  flesh_effect_destroy(&effect);
  flesh_mesh_destroy(&mesh);
}

/* Returns the mesh's tet with the nodes of a cell: ascending, padded with the last one. */
static int tet_of(const flesh_cells *all, const int *cell)
{
  for (int t = 0; t < all->count; t++)
    if (!memcmp(all->nodes + 10 * t, cell, 10 * sizeof *cell)) return t;
  return -1;
}

/* Elasticity of every other cell, and of the rest, add up to that of all. */
static void parts_add_up(void)
{
  flesh_scene *scene = open_scene(-1, "lumped", "  - elasticity: {}\n", 0, "");
  values all = evaluate(scene);
  const flesh_effect *effect = flesh_system_effect(flesh_scene_system(scene), 0);
  const flesh_cells *cells = effect->operations->cells(effect);
  const flesh_mesh *mesh = flesh_scene_mesh(scene);
  flesh_cells given;
  CHECK_OK(flesh_cells_of_tets(mesh, &given));
  CHECK(given.padded && cells->padded && cells->count == 72);
  double *sum = calloc((size_t)all.n, sizeof *sum);
  for (int part = 0; part < 2; part++) {
    int chosen[72], nodes[720], count = 0;
    for (int k = part; k < cells->count; k += 2) {
      const int t = tet_of(&given, cells->nodes + 10 * k);
      CHECK(t >= 0);
      memcpy(nodes + 10 * count, flesh_mesh_tets(mesh) + 4 * t, 4 * sizeof *nodes);
      memcpy(nodes + 10 * count + 4, flesh_mesh_tet_edges(mesh) + 6 * t, 6 * sizeof *nodes);
      chosen[count++] = k;
    }
    flesh_mesh *own = NULL;
    flesh_effect *restricted = NULL;
    CHECK_OK(flesh_mesh_create_quadratic(all.n / 3, flesh_mesh_positions(mesh), count, nodes, NULL, &own));
    CHECK_OK(effect->operations->library->restrict_to_cells(effect, count, chosen, own, &restricted));
    const flesh_point point = flesh_point_at(0, all.x, all.v, all.a);
    CHECK_OK(restricted->operations->residual(restricted, &point, sum));
    flesh_effect_destroy(&restricted);
    flesh_mesh_destroy(&own);
  }
  compare("parts", all.n, sum, all.r, 1e-12);
  free(sum);
  free(all.x);
  flesh_cells_clear(&given);
  flesh_scene_destroy(&scene);
}

/* A frame has cells of four and of ten points. */
/* The appended data of the array `name`, which has so many bytes. */
static const char *appended(const char *bytes, const char *name, uint32_t length)
{
  static const char begin[] = "<AppendedData encoding=\"raw\">";
  char words[40];
  snprintf(words, sizeof words, "Name=\"%s\"", name);
  const char *header = strstr(bytes, words), *data = strstr(bytes, begin);
  CHECK(header && data);
  const char *place = strstr(header, "offset=\"");
  data = strchr(data, '_') + 1 + atol(place + strlen("offset=\""));
  uint32_t found;
  memcpy(&found, data, sizeof found);
  CHECK(found == length);
  return data + sizeof found;
}

static void frames_have_both_cells(void)
{
  enum { TETS = 72, LINEAR = 24, POINTS = 4 * LINEAR + 10 * (TETS - LINEAR) };
  flesh_scene *scene = open_scene(-1, "lumped", "  - inertia: {}\n", 0, "time: {end: 1}\n");
  const flesh_mesh *mesh = flesh_scene_mesh(scene);
  const flesh_vtu content = {.points = flesh_mesh_node_count(mesh),
                             .tets = flesh_mesh_tet_count(mesh),
                             .positions = flesh_mesh_positions(mesh),
                             .tet_nodes = flesh_mesh_tets(mesh),
                             .edge_nodes = flesh_mesh_tet_edges(mesh)};
  CHECK_OK(flesh_vtu_write(file_path("mixed.vtu"), &content));
  FILE *file = fopen(file_path("mixed.vtu"), "rb");
  char *bytes = malloc((1 << 20) + 1);
  const size_t size = fread(bytes, 1, 1 << 20, file);
  fclose(file);
  bytes[size] = 0;
  const char *types = appended(bytes, "types", TETS), *offsets = appended(bytes, "offsets", 8 * TETS);
  const char *connectivity = appended(bytes, "connectivity", 4 * POINTS);
  for (int t = 0, end = 0; t < TETS; t++) {
    const int linear = t >= 24 && t < 48, nodes = linear ? 4 : 10;
    int64_t offset;
    CHECK(types[t] == (linear ? 10 : 24));
    memcpy(&offset, offsets + 8 * t, sizeof offset);
    for (int a = 0; a < nodes; a++, end++) {
      int32_t node;
      memcpy(&node, connectivity + 4 * end, sizeof node);
      CHECK(node == (a < 4 ? flesh_mesh_tets(mesh)[4 * t + a] : flesh_mesh_tet_edges(mesh)[6 * t + a - 4]));
    }
    CHECK(offset == end);
  }
  free(bytes);
  flesh_scene_destroy(&scene);
}

/* Probes show the stresses at the points of each body's tets; the energies add up to that of the effect. */
static void stresses_are_those_of_each_body(void)
{
  flesh_scene *scene = open_scene(-1, "lumped", "  - elasticity: {}\n", 0, "");
  const flesh_body *body = flesh_scene_body(scene);
  values all = evaluate(scene);
  const flesh_state state = {.x = all.x, .v = all.v};
  flesh_tet_stress stress;
  flesh_strain_point points[4];
  double energy = 0, rest;
  CHECK_OK(flesh_tet_stress_open(body, flesh_scene_system(scene), &stress));
  for (int t = 0; t < flesh_mesh_tet_count(body->mesh); t++) {
    const int count = flesh_tet_stress_points(&stress, &state, t, points);
    CHECK(count == (t >= 24 && t < 48 ? 1 : 4));
    for (int q = 0; q < count; q++) energy += points[q].volume * points[q].energy;
  }
  CHECK_OK(flesh_material_energy(body->materials, (const double[9]){1, 0, 0, 0, 1, 0, 0, 0, 1}, &rest));
  printf("# %.12g of %.12g J\n", energy, all.energy[0] - 12 * rest);
  CHECK_NEAR(energy, all.energy[0] - 12 * rest, 1e-9 * fabs(all.energy[0]));
  flesh_tet_stress_clear(&stress);
  flesh_fields fields;
  CHECK_OK(flesh_fields_open(body, flesh_scene_system(scene), FLESH_METHOD_STATIC, FLESH_FIELD_J,
                             FLESH_AT_POINTS, &fields));
  double *means = malloc(sizeof *means * (size_t)flesh_mesh_tet_count(body->mesh));
  flesh_mesh_mean_jacobians(body->mesh, state.x, means);
  flesh_fields_find(&fields, &(flesh_step_record){.state = &state, .stage = &state});
  for (int t = 0; t < flesh_mesh_tet_count(body->mesh); t++) {
    const double *J = fields.at_points[0] + 4 * t, mean = means[t];
    const int linear = t >= 24 && t < 48;
    for (int q = 0; q < 4; q++) CHECK(linear ? J[q] == J[0] : J[q] > 0);
    CHECK_NEAR((J[0] + J[1] + J[2] + J[3]) / 4, mean, 1e-12);
  }
  flesh_fields_clear(&fields);
  free(means);
  free(all.x);
  flesh_scene_destroy(&scene);
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  write_bar();
  int failed = RUN_TESTS(argc, argv, TEST(meshes_are_checked), TEST(effects_are_those_of_each_body),
                         TEST(derivatives_are_consistent), TEST(equilibria_are_those_of_each_body),
                         TEST(motions_are_those_of_each_body), TEST(momentum_is_kept_in_a_collision),
                         TEST(groups_may_share_a_corner), TEST(parts_add_up), TEST(frames_have_both_cells),
                         TEST(stresses_are_those_of_each_body));
  test_folder_remove(folder);
  return failed;
}
