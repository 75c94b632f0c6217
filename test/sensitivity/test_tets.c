// TEST full memory seconds=5
/* test_tets.c: derivatives by a constant of each single tet: their sum is that by the constant of all tets, a tet's is
 * that of a scene in which only it differs (body.material_map), and adjoints by it are gradients. */
#include <unistd.h>

#include "gradients.h"

static const char map_file[] = "test_tets_map.csv";

static const char text[] =
    "body: {mesh: ../meshes/bar_8x2x2.mesh, density: 1000, element: tet4, material: {energy: S, young: 1e5, poisson: 0.3}}\n"
    "effects:\n  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}\n  - gravity: {acceleration: [0, 1, -1]}\n"
    "  - pressure: {box: [[-1, -1, 0.999], [5, 2, 2]], pressure: 40}\n"
    "time: {method: static, step: 1, end: 1}\nsolver: {newton_tolerance: 1e-9}\n";

static const char *added_effects = "effects.drag=null"; /* an override; without "null" the scene has inertia, too */

/* Makes the scene with another element and constant, and a map of one tet: the first `key` is that of the whole. */
static flesh_scene *scene_with(const char *element, const char *poisson, const char *key, double value, int tet)
{
  char sets[7][128];
  const char *const list[] = {sets[0], sets[1], sets[2], sets[3], sets[4], sets[5], sets[6]};
  const int moves = !strstr(added_effects, "null");
  flesh_scene *scene = NULL;
  snprintf(sets[0], sizeof sets[0], "body.element=%s", element);
  snprintf(sets[1], sizeof sets[1], "body.material.poisson=%s", poisson);
  snprintf(sets[2], sizeof sets[2], "body.material.%s=%.17g", tet < 0 ? key : "young", tet < 0 ? value : 1e5);
  snprintf(sets[3], sizeof sets[3], "effects.%s=null", atof(poisson) == 0.5 ? "pressure" : "drag");
  snprintf(sets[4], sizeof sets[4], "%s", added_effects);
  snprintf(sets[5], sizeof sets[5], "effects.%s", moves ? "inertia={}" : "drag=null");
  snprintf(sets[6], sizeof sets[6], "body.material_map=%s", map_file);
  if (tet >= 0) {
    FILE *file = fopen(map_file, "w");
    fprintf(file, "# a comment\ntet,%s\n%d,%.17g\n", key, tet, value);
    fclose(file);
  }
  CHECK_OK(flesh_scene_read_text(text, "../data/scenes/tets.yaml", 6 + (tet >= 0), list, &scene));
  if (!scene) exit(1);
  unlink(map_file);
  return scene;
}

static flesh_state solve(const flesh_scene *scene)
{
  const flesh_system *system = flesh_scene_system(scene);
  const int n = flesh_system_unknowns(system), multipliers = flesh_system_multiplier_count(system);
  flesh_state state = {.x = calloc(2 * (size_t)n, sizeof(double)), .multiplier_count = multipliers};
  flesh_integrator *integrator = NULL;
  state.v = state.x + n;
  state.multipliers = multipliers ? calloc((size_t)multipliers, sizeof(double)) : NULL;
  flesh_scene_start(scene, &state);
  CHECK_OK(flesh_integrator_create(system, FLESH_METHOD_STATIC, flesh_scene_solver(scene), &integrator));
  CHECK_OK(flesh_integrator_step(integrator, &state, 1, NULL));
  flesh_integrator_destroy(&integrator);
  return state;
}

/* Computes f [3*nodes], the sum of a tet's forces, or of all tets' (-1). */
static void gather(const flesh_mesh *mesh, const double *forces, int only, double *f)
{
  const int size = flesh_mesh_order(mesh) == 2 ? 10 : 4;
  memset(f, 0, 3 * (size_t)flesh_mesh_node_count(mesh) * sizeof *f);
  for (int t = 0; t < flesh_mesh_tet_count(mesh); t++)
    for (int a = 0; a < size && (only < 0 || only == t); a++)
      for (int c = 0; c < 3; c++) {
        const int node = a < 4 ? flesh_mesh_tets(mesh)[4 * t + a] : flesh_mesh_tet_edges(mesh)[6 * t + a - 4];
        f[3 * node + c] += forces[3 * (size * t + a) + c];
      }
}

static double largest(int n, const double *f)
{
  double most = 0;
  for (int d = 0; d < n; d++) most = fmax(most, fabs(f[d]));
  return most;
}

static void compare(const char *name, int n, const double *own, const double *other, double tolerance)
{
  double off = 0;
  for (int d = 0; d < n; d++) off = fmax(off, fabs(own[d] - other[d]));
  printf("# %s: off by %.1e of %.3g\n", name, off, largest(n, other));
  CHECK(largest(n, other) > 0);
  CHECK_BELOW(off, tolerance * largest(n, other));
}

static void try_element(const char *element, const char *poisson, const char *key, double p, double h)
{
  const int only[] = {0, 77};
  flesh_scene *scene = scene_with(element, poisson, key, p, -1);
  flesh_scene *all[] = {scene_with(element, poisson, key, p - h, -1), scene_with(element, poisson, key, p + h, -1)};
  const flesh_mesh *mesh = flesh_scene_mesh(scene);
  const int tets = flesh_mesh_tet_count(mesh), n = flesh_system_unknowns(flesh_scene_system(scene));
  flesh_state state = solve(scene);
  flesh_sensitivity *sensitivity = NULL;
  double *room = calloc(5 * (size_t)n + 31 * (size_t)tets, sizeof *room);
  double *f = room, *g = f + n, *dx = g + n, *by_x = dx + n, *lambda = by_x + n, *difference = lambda + n, *forces = difference + tets;
  for (int t = 0; t < tets; t++) difference[t] = 2 * h;
  flesh_tet_parameter by_tet = {{flesh_scene_body(all[0]), flesh_scene_body(all[1])}, difference};
  const flesh_parameter whole = {{NULL, flesh_scene_system(all[0]), flesh_scene_system(all[1]), NULL}, h};
  CHECK_OK(flesh_sensitivity_create(flesh_scene_system(scene), flesh_scene_solver(scene), 1e-12, &sensitivity));
  CHECK_OK(flesh_sensitivity_set(sensitivity, &state, NULL));
  CHECK_OK(flesh_tet_forces(&by_tet, &state, forces));
  gather(mesh, forces, -1, f);
  CHECK_OK(flesh_sensitivity_force(sensitivity, &whole, g));
  compare("all tets", n, f, g, 1e-9);
  CHECK_OK(flesh_sensitivity_respond(sensitivity, f, dx));
  CHECK_OK(flesh_sensitivity_tangent(sensitivity, &whole, g));
  compare("their tangent", n, dx, g, 1e-9);
  const int node = gradient_node(mesh, 4, 1, 1);
  by_x[3 * node + 2] = 1;
  CHECK_OK(flesh_sensitivity_adjoint(sensitivity, &(flesh_quantity){.by_x = by_x}, lambda));
  for (int k = 0; k < 2; k++) {
    flesh_scene *alone[] = {scene_with(element, poisson, key, p - h, only[k]), scene_with(element, poisson, key, p + h, only[k])};
    const flesh_parameter one = {{NULL, flesh_scene_system(alone[0]), flesh_scene_system(alone[1]), NULL}, h};
    double gradient, by_forces = 0;
    gather(mesh, forces, only[k], f);
    CHECK_OK(flesh_sensitivity_force(sensitivity, &one, g));
    compare("a tet", n, f, g, 1e-7);
    CHECK_OK(flesh_sensitivity_gradient(sensitivity, &(flesh_quantity){.by_x = by_x}, 1, &one, &gradient));
    for (int d = 0; d < n; d++) by_forces -= lambda[d] * f[d];
    CHECK_NEAR(by_forces, gradient, 1e-7 * fabs(gradient));
    for (int s = 0; s < 2; s++) flesh_scene_destroy(&alone[s]);
  }
  difference[77] = 0;
  CHECK_OK(flesh_tet_forces(&by_tet, &state, forces));
  gather(mesh, forces, 77, f);
  CHECK(largest(n, f) == 0);
  flesh_sensitivity_destroy(&sensitivity);
  flesh_scene_destroy(&scene);
  for (int s = 0; s < 2; s++) flesh_scene_destroy(&all[s]);
  free(room);
  free(state.x);
  free(state.multipliers);
}

static void forces_of_tets_are_those_of_scenes(void)
{
  try_element("tet4", "0.3", "young", 1e5, 1e2);
  try_element("tet4", "0.4", "poisson", 0.4, 1e-4);
  try_element("tet10", "0.4", "young", 1e5, 1e2);
  try_element("tet10-mean", "0.49", "young", 1e5, 1e2);
  try_element("tet10-mean", "0.5", "young", 1e5, 1e2);
}

/* A quantity Q of all states: a linear function of x and v by `by` [2*n], weighted by the time. */
typedef struct weighed {
  int n, states;
  const double *by;
} weighed;

static double weight_at(double t) { return 1 + 30 * t; }

static int add_weighed(void *data, double t, double *by_x, double *by_v)
{
  weighed *w = data;
  for (int d = 0; d < w->n; d++) by_x[d] += weight_at(t) * w->by[d], by_v[d] += weight_at(t) * w->by[w->n + d];
  w->states++;
  return FLESH_OK;
}

/* The sum of its tangent. */
typedef struct summed {
  weighed of;
  double sum;
} summed;

static int sum_up(void *data, int k, double t, const double *dx, const double *dv)
{
  summed *s = data;
  (void)k;
  for (int d = 0; d < s->of.n; d++) s->sum += weight_at(t) * (s->of.by[d] * dx[d] + s->of.by[s->of.n + d] * dv[d]);
  return FLESH_OK;
}

/* Derivatives of a motion's Q by single tets, and by all, agree with tangents by scenes that differ in them. */
static void try_motion(const char *element, const char *damping, flesh_method method)
{
  enum { STEPS = 6 };
  const double h = 1e2;
  const int only[] = {3, 77};
  added_effects = damping;
  flesh_scene *scene = scene_with(element, "0.4", "young", 1e5, -1);
  flesh_scene *all[] = {scene_with(element, "0.4", "young", 1e5 - h, -1), scene_with(element, "0.4", "young", 1e5 + h, -1)};
  const flesh_system *system = flesh_scene_system(scene);
  const int n = flesh_system_unknowns(system), tets = flesh_mesh_tet_count(flesh_scene_mesh(scene));
  double *room = calloc(4 * (size_t)n + 2 * (size_t)tets, sizeof *room), *by = room + 2 * n, *gradient = room + 4 * n;
  double *difference = gradient + tets, whole = 0;
  flesh_state state = {.x = room, .v = room + n};
  flesh_integrator *integrator = NULL;
  flesh_trajectory *trajectory = NULL;
  for (int d = 0; d < 2 * n; d++) by[d] = sin(d) * (d < n ? 1 : 0.03);
  flesh_scene_start(scene, &state);
  CHECK_OK(flesh_integrator_create(system, method, flesh_scene_solver(scene), &integrator));
  CHECK_OK(flesh_trajectory_create(integrator, 1e-12, 1000, &trajectory));
  for (int k = 0; k < STEPS; k++) CHECK_OK(flesh_integrator_step(integrator, &state, 1e-2, NULL));
  for (int t = 0; t < tets; t++) difference[t] = 2 * h;
  const flesh_tet_parameter by_tet = {{flesh_scene_body(all[0]), flesh_scene_body(all[1])}, difference};
  weighed w = {.n = n, .by = by};
  CHECK_OK(flesh_trajectory_tet_gradient(trajectory, &by_tet, add_weighed, &w, gradient));
  CHECK(w.states == STEPS + 1);
  for (int t = 0; t < tets; t++) whole += gradient[t];
  for (int k = -1; k < 2; k++) {
    flesh_scene *alone[] = {k < 0 ? all[0] : scene_with(element, "0.4", "young", 1e5 - h, only[k]),
                            k < 0 ? all[1] : scene_with(element, "0.4", "young", 1e5 + h, only[k])};
    const flesh_parameter one = {{NULL, flesh_scene_system(alone[0]), flesh_scene_system(alone[1]), NULL}, h};
    const double own = k < 0 ? whole : gradient[only[k]];
    summed s = {w, 0};
    CHECK_OK(flesh_trajectory_tangents(trajectory, 1, &one, NULL, sum_up, &s));
    printf("# %s, %s, %s: %.8g, off by %.1e of it\n", element, flesh_method_name(method), k < 0 ? "all" : "a tet", own,
           fabs(own / s.sum - 1));
    CHECK_BELOW(fabs(own - s.sum), 1e-6 * fabs(s.sum));
    for (int i = 0; i < 2; i++) flesh_scene_destroy(&alone[i]);
  }
  flesh_trajectory_destroy(&trajectory);
  flesh_integrator_destroy(&integrator);
  flesh_scene_destroy(&scene);
  free(room);
  added_effects = "effects.drag=null";
}

static void motions_have_derivatives_by_tets(void)
{
  static const char *const damping[] = {"effects.damping={mass: 0.5, stiffness: 0.01}",
                                        "effects.damping={stiffness: 0.01, stiffness_at: current}"};
  for (int k = 0; k < TEST_FEWER(2, 1); k++) {
    try_motion("tet4", damping[k], FLESH_METHOD_BACKWARD_EULER);
    try_motion("tet4", damping[k], FLESH_METHOD_NEWMARK);
  }
  try_motion("tet10-mean", damping[0], FLESH_METHOD_BDF2);
  try_motion("tet10", damping[1], FLESH_METHOD_MIDPOINT);
  try_motion("tet4", damping[0], FLESH_METHOD_RUNGE_KUTTA);
}

/* A map names tets of the mesh in the file: parts of refined ones have the constants of their parents. */
static void maps_go_to_refined_tets(void)
{
  char sets[2][64];
  const char *const list[] = {sets[0], sets[1]};
  flesh_scene *scene = NULL;
  FILE *file = fopen(map_file, "w");
  fprintf(file, "tet,young [Pa],poisson\n3,2e5,0.2\n5,2e5,0.2\n4,3e5,0.1\n");
  fclose(file);
  snprintf(sets[0], sizeof sets[0], "body.refine=1");
  snprintf(sets[1], sizeof sets[1], "body.material_map=%s", map_file);
  CHECK_OK(flesh_scene_read_text(text, "../data/scenes/tets.yaml", 2, list, &scene));
  unlink(map_file);
  const flesh_body *body = flesh_scene_body(scene);
  CHECK(flesh_scene_material_count(scene) == 3); /* both rows of 2e5 have a tet */
  for (int t = 0; t < flesh_mesh_tet_count(body->mesh); t++) {
    const flesh_material *own = &body->materials[body->tet_material[t]];
    const int of = t / 8;
    CHECK_NEAR(own->young, of == 4 ? 3e5 : of == 3 || of == 5 ? 2e5 : 1e5, 0);
    CHECK_NEAR(own->poisson, of == 4 ? 0.1 : of == 3 || of == 5 ? 0.2 : 0.3, 0);
  }
  flesh_scene_destroy(&scene);
}

/* Pressures of another number of tets, and a difference that is no number, are refused. */
static void what_does_not_fit_the_tets_is_refused(void)
{
  flesh_scene *scene = scene_with("tet10-mean", "0.5", "young", 1e5, -1);
  const int tets = flesh_mesh_tet_count(flesh_scene_mesh(scene));
  flesh_state state = solve(scene);
  double *difference = calloc(31 * (size_t)tets, sizeof *difference), *forces = difference + tets;
  const flesh_tet_parameter parameter = {{flesh_scene_body(scene), flesh_scene_body(scene)}, difference};
  CHECK(state.multiplier_count == tets);
  CHECK_OK(flesh_tet_forces(&parameter, &state, forces));
  state.multiplier_count--;
  CHECK(flesh_tet_forces(&parameter, &state, forces) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "multipliers; the body has");
  state.multiplier_count++;
  difference[3] = NAN;
  CHECK(flesh_tet_forces(&parameter, &state, forces) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "difference[3] is nan; it must be finite");
  free(state.x);
  free(state.multipliers);
  free(difference);
  flesh_scene_destroy(&scene);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(what_does_not_fit_the_tets_is_refused), TEST(forces_of_tets_are_those_of_scenes),
                   TEST(motions_have_derivatives_by_tets), TEST(maps_go_to_refined_tets));
}
