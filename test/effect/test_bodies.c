// TEST quick
/* test_bodies.c: several bodies in one scene move as each alone, need no more Newton iterations, and can be selected by
 * name. */
#include "scene_files.h"

#include <math.h>
#include <stdlib.h>

#include "flesh/integrator.h"

#define BAR "mesh: bar.node, density: 1000, material: {energy: S, young: 4e5, poisson: 0.45}"
#define BLOCK "mesh: block.node, density: 500, material: {energy: S, young: 4e6, poisson: 0.3}"

/* A bar clamped at its end, and away from it a block that is thrown and spins. */
static const char common[] = "time: {method: backward-euler, step: 1/60, end: 1/5}\n"
                             "solver: {newton_tolerance: 1e-9}\n";
static const char bar_alone[] = "body: {" BAR "}\n"
                                "effects: [inertia, gravity, pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}]\n";
static const char block_alone[] = "body: {" BLOCK "}\n"
                                  "effects: [inertia, gravity]\n"
                                  "start: {velocity: [1, 2, 3]}\n";
static const char both[] = "body: {name: bar, " BAR "}\n"
                           "bodies: [{name: block, " BLOCK ", translation: [0, 5, 0], rotation: [0, 0, 0.5],\n"
                           "          velocity: [1, 2, 3]}]\n"
                           "effects: [inertia, gravity, pin: {body: bar, box: [[-1, -1, -1], [1e-9, 9, 2]]}]\n";

typedef struct outcome {
  flesh_scene *scene;
  flesh_state state;
  int nodes, newton;
} outcome;

static outcome open_scene(const char *text)
{
  outcome o = {0};
  char whole[2000];
  snprintf(whole, sizeof whole, "%s%s", text, common);
  CHECK_OK(flesh_scene_read(write_text("scene.yaml", whole), 0, NULL, &o.scene));
  o.nodes = flesh_mesh_node_count(flesh_scene_mesh(o.scene));
  o.state.x = malloc(sizeof(double) * 3 * (size_t)o.nodes);
  o.state.v = malloc(sizeof(double) * 3 * (size_t)o.nodes);
  flesh_scene_start(o.scene, &o.state);
  return o;
}

static void close_scene(outcome *o)
{
  free(o->state.x);
  free(o->state.v);
  flesh_scene_destroy(&o->scene);
}

/* Adds a spin of 40 rad/s about (cx, cy) to the nodes from `first` on. */
static void spin(outcome *o, int first)
{
  double centre[2] = {0};
  for (int i = first; i < o->nodes; i++)
    for (int c = 0; c < 2; c++) centre[c] += o->state.x[3 * i + c] / (o->nodes - first);
  for (int i = first; i < o->nodes; i++) {
    o->state.v[3 * i] -= 40 * (o->state.x[3 * i + 1] - centre[1]);
    o->state.v[3 * i + 1] += 40 * (o->state.x[3 * i] - centre[0]);
  }
}

static void run(outcome *o)
{
  flesh_integrator *integrator = NULL;
  flesh_solve_stats stats = {0};
  CHECK_OK(flesh_integrator_create(flesh_scene_system(o->scene), FLESH_METHOD_BACKWARD_EULER,
                                   flesh_scene_solver(o->scene), &integrator));
  for (int k = 0; k < 12; k++) CHECK_OK(flesh_integrator_step(integrator, &o->state, 1. / 60, &stats));
  o->newton = (int)stats.newton;
  flesh_integrator_destroy(&integrator);
}

static void each_moves_as_by_itself(void)
{
  outcome bar = open_scene(bar_alone), block = open_scene(block_alone), together = open_scene(both);
  CHECK(together.nodes == bar.nodes + block.nodes);
  CHECK(flesh_scene_material_count(together.scene) == 2);
  spin(&block, 0);
  spin(&together, bar.nodes);
  run(&bar);
  run(&block);
  run(&together);
  double worst[2] = {0};
  for (int d = 0; d < 3 * bar.nodes; d++) worst[0] = fmax(worst[0], fabs(together.state.x[d] - bar.state.x[d]));
  for (int i = 0; i < block.nodes; i++) {
    const double *x = block.state.x + 3 * i, *y = together.state.x + 3 * (bar.nodes + i), c = cos(0.5), s = sin(0.5);
    /* Alone the block is not rotated, but its velocity is the same vector: rotate its motion relative to the flight. */
    const double flight[3] = {0.2, 0.4, 0.6};
    double p[3] = {x[0] - flight[0], x[1] - flight[1], x[2]};
    const double turned[3] = {c * p[0] - s * p[1] + flight[0], s * p[0] + c * p[1] + flight[1] + 5, p[2]};
    for (int k = 0; k < 3; k++) worst[1] = fmax(worst[1], fabs(y[k] - turned[k]));
  }
  printf("# bar off by %.2g m, block by %.2g m; Newton iterations %d and %d alone, %d together\n", worst[0], worst[1],
         bar.newton, block.newton, together.newton);
  CHECK_BELOW(worst[0], 1e-6);
  CHECK_BELOW(worst[1], 1e-6);
  CHECK(together.newton <= 1.1 * fmax(bar.newton, block.newton));
  close_scene(&bar);
  close_scene(&block);
  close_scene(&together);
}

static void densities_and_selections_are_by_body(void)
{
  outcome together = open_scene(both);
  const flesh_body *body = flesh_scene_body(together.scene);
  CHECK(body->part_count == 2 && body->parts[0].tets == body->parts[1].first_tet);
  CHECK(body->density[0] == 1000 && body->density[body->parts[1].first_tet] == 500);
  uint8_t *fixed = malloc(3 * (size_t)together.nodes);
  CHECK(flesh_system_fixed(flesh_scene_system(together.scene), 0, fixed) == 12); /* only the bar's end */
  free(fixed);
  close_scene(&together);
  /* A name alone selects the whole body. */
  const char *hold[] = {"effects.pin.box=null", "effects.pin.body=block"};
  flesh_scene *held = NULL;
  CHECK_OK(flesh_scene_read(file_path("scene.yaml"), 2, hold, &held));
  fixed = malloc(3 * (size_t)flesh_mesh_node_count(flesh_scene_mesh(held)));
  CHECK(flesh_system_fixed(flesh_scene_system(held), 0, fixed) == 3 * 27);
  free(fixed);
  flesh_scene_destroy(&held);
  const char *alone[] = {"effects.pin.box=null", "effects.pin.body=bar", "bodies=null"};
  CHECK_OK(flesh_scene_read(file_path("scene.yaml"), 3, alone, &held));
  fixed = malloc((size_t)flesh_system_unknowns(flesh_scene_system(held)));
  CHECK(flesh_system_fixed(flesh_scene_system(held), 0, fixed) == flesh_system_unknowns(flesh_scene_system(held)));
  free(fixed);
  flesh_scene_destroy(&held);
}

static void refused(const char *text, const char *part)
{
  flesh_scene *scene = NULL;
  char whole[2000];
  snprintf(whole, sizeof whole, "%s%s", text, common);
  CHECK(flesh_scene_read(write_text("bad.yaml", whole), 0, NULL, &scene) == FLESH_ERR_ARGUMENT);
  if (!strstr(flesh_error_text(), part)) printf("# %s\n", flesh_error_text());
  CHECK(strstr(flesh_error_text(), part));
}

static void bad_bodies_are_refused(void)
{
  refused("body: {" BAR "}\nbodies: [{name: body, " BLOCK "}]\neffects: [inertia]\n",
          "bad.yaml:2:17: bodies[0].name is 'body'; another body has that name already");
  refused("body: {" BAR "}\nbodies: [{name: a, " BLOCK "}]\neffects: [inertia, pin: {body: b}]\n",
          "body is 'b'; the scene has no body of that name, but body, a");
  refused("body: {" BAR "}\neffects: [inertia, pin: {body: left}]\n",
          "body is 'left'; the scene has no body of that name, but body");
  refused("body: {mesh: bar.node}\nbodies: [{name: a, " BLOCK "}]\neffects: [inertia]\n", "have no material");
  flesh_scene *scene = NULL;
  const char *path =
      write_text("bad.yaml", "body: {" BAR "}\nbodies: [{name: a, mesh: none.msh}]\neffects: [inertia]\n");
  CHECK(flesh_scene_read(path, 0, NULL, &scene) == FLESH_ERR_FILE);
  CHECK(strstr(flesh_error_text(), "bad.yaml:2:26: bodies[0].mesh: ") && !strstr(flesh_error_text(), "in their places"));
  /* Too far away for floating-point numbers to separate the nodes. */
  path = write_text("bad.yaml", "body: {" BAR "}\nbodies: [{name: a, " BLOCK ", translation: [1e20, 0, 0]}]\neffects: [inertia]\n");
  CHECK(flesh_scene_read(path, 0, NULL, &scene) == FLESH_ERR_FILE);
  CHECK(strstr(flesh_error_text(), "bad.yaml:2:9: bodies: the mesh of all bodies in their places: tet "));
}

/* Bodies of ten-node tets are joined with their mid-edge nodes. */
static void ten_node_bodies_are_joined(void)
{
  flesh_mesh *block = NULL, *ten = NULL;
  CHECK_OK(flesh_mesh_read(file_path("block.node"), &block));
  CHECK_OK(flesh_mesh_raise_order(block, &ten));
  CHECK_OK(flesh_mesh_write(ten, file_path("ten.msh")));
  const char *text = "body: {name: a, mesh: ten.msh, density: 500, material: {energy: S, young: 4e6, poisson: 0.3}}\n"
                     "bodies: [{name: b, mesh: ten.msh, density: 500, material: {energy: S, young: 4e6, poisson: 0.3},\n"
                     "          translation: [0, 5, 0]}]\n"
                     "effects: [inertia, force: {body: b, force: [1, 0, 0]}]\n";
  outcome o = open_scene(text);
  const flesh_mesh *mesh = flesh_scene_mesh(o.scene);
  const int nodes = flesh_mesh_node_count(ten), tets = flesh_mesh_tet_count(ten), *edges = flesh_mesh_tet_edges(mesh);
  CHECK(flesh_mesh_order(mesh) == 2 && o.nodes == 2 * nodes && flesh_mesh_tet_count(mesh) == 2 * tets);
  for (int k = 0; k < 6 * tets && edges; k++) {
    CHECK(edges[k] == flesh_mesh_tet_edges(ten)[k] && edges[6 * tets + k] == nodes + edges[k]);
    for (int c = 0; c < 3; c++)
      CHECK_NEAR(flesh_mesh_positions(mesh)[3 * edges[6 * tets + k] + c],
                 flesh_mesh_positions(ten)[3 * edges[k] + c] + 5 * (c == 1), 1e-15);
  }
  /* The force is on all of the second body's nodes, including mid-edge nodes. */
  double *r = calloc(6 * (size_t)nodes, sizeof *r), *zero = calloc(6 * (size_t)nodes, sizeof *zero);
  const flesh_point point = flesh_point_at(0, flesh_mesh_positions(mesh), zero, zero);
  CHECK_OK(flesh_system_residual(flesh_scene_system(o.scene), &point, r));
  for (int i = 0; i < 2 * nodes; i++) CHECK_NEAR(r[3 * i], i < nodes ? 0 : -1. / nodes, 1e-9);
  free(r), free(zero);
  close_scene(&o);
  flesh_mesh_destroy(&block);
  flesh_mesh_destroy(&ten);
}

/* Returns the lowest z of the nodes of a bar with its own element that bends under its weight. */
static double sag_alone(const char *element)
{
  char text[400];
  double lowest = INFINITY;
  snprintf(text, sizeof text, "body: {element: %s, mesh: bar.node, density: 1000, material: {energy: S, young: 4e5, "
                              "poisson: 0.49}}\neffects: [inertia, gravity, pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}]\n",
           element);
  outcome o = open_scene(text);
  run(&o);
  for (int i = 0; i < o.nodes; i++) lowest = fmin(lowest, o.state.x[3 * i + 2]);
  close_scene(&o);
  return lowest;
}

/* Bodies side by side each bend as their own elements do, also if they share a material. */
static void each_body_has_its_element(void)
{
  static const char *const elements[3] = {"tet10", "tet10-mean", "tet10"};
  double lowest[3] = {INFINITY, INFINITY, INFINITY}, alone[2] = {sag_alone("tet10"), sag_alone("tet10-mean")};
  outcome o = open_scene(
      "body: {name: a, element: tet10, mesh: bar.node, density: 1000,\n"
      "       material: {energy: S, young: 4e5, poisson: 0.49}}\n"
      "bodies:\n"
      "  - {name: b, element: tet10-mean, mesh: bar.node, translation: [0, 5, 0]}\n"
      "  - {name: c, mesh: bar.node, translation: [0, 10, 0]}\n"
      "effects: [inertia, gravity, pin: {box: [[-1, -1, -1], [1e-9, 99, 2]]}]\n");
  const int nodes = o.nodes / 3;
  run(&o);
  for (int i = 0; i < o.nodes; i++) lowest[i / nodes] = fmin(lowest[i / nodes], o.state.x[3 * i + 2]);
  for (int k = 0; k < 3; k++) {
    printf("# body %d, %s: %.12g, alone %.12g\n", k, elements[k], lowest[k], alone[k % 2]);
    CHECK_NEAR(lowest[k], alone[k % 2], 1e-7);
  }
  CHECK(fabs(alone[0] - alone[1]) > 1e-4);
  close_scene(&o);
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  write_bar();
  flesh_mesh *mesh = NULL;
  if (flesh_mesh_box((int[]){2, 2, 2}, (double[]){1, 1, 1}, (double[]){-0.5, -0.5, -0.5}, &mesh) ||
      flesh_mesh_write(mesh, file_path("block.node")))
    return 1;
  flesh_mesh_destroy(&mesh);
  int failed = RUN_TESTS(argc, argv, TEST(each_moves_as_by_itself), TEST(densities_and_selections_are_by_body),
                         TEST(bad_bodies_are_refused), TEST(ten_node_bodies_are_joined),
                         TEST(each_body_has_its_element));
  test_folder_remove(folder);
  return failed;
}
