// TEST quick
/* test_sets.c: selections by the name of a set of the mesh, or by the numbers of a set's nodes, equal those by a box:
 * nodes, triangles, tets of muscles; with ten nodes, refined and in several bodies; unknown names are refused with a
 * list of the known ones. */
#include "scene_files.h"

#include <math.h>
#include <stdlib.h>

#include "mesh/mesh.h"
#include "scene/fibres.h"
#include "scene/scene.h"
#include "scene/selection.h"
#include "system/parts.h"

/* bar.inp: 4 x 1 x 1 m in cubes of six tets; the set `clamp` has the nodes at x = 0, the set `lower` the tets with x <
 * 2. */
static void write_deck(void)
{
  flesh_mesh *mesh;
  if (flesh_mesh_box((int[]){4, 1, 1}, (double[]){4, 1, 1}, (double[]){0, 0, 0}, &mesh)) abort();
  FILE *file = fopen(file_path("bar.inp"), "w");
  if (!file) abort();
  fputs("*NODE\n", file);
  for (int i = 0; i < mesh->nodes; i++)
    fprintf(file, "%d, %g, %g, %g\n", 10 * i + 1, mesh->positions[3 * i], mesh->positions[3 * i + 1], mesh->positions[3 * i + 2]);
  for (int half = 0; half < 2; half++) {
    fprintf(file, "*ELEMENT, TYPE=C3D4, ELSET=%s\n", half ? "upper" : "lower");
    for (int t = 12 * half; t < 12 * half + 12; t++) {
      const int *n = mesh->tet_nodes + 4 * t;
      fprintf(file, "%d, %d, %d, %d, %d\n", t + 1, 10 * n[0] + 1, 10 * n[1] + 1, 10 * n[2] + 1, 10 * n[3] + 1);
    }
  }
  fputs("*NSET, NSET=clamp\n", file);
  for (int i = 0; i < mesh->nodes; i++)
    if (mesh->positions[3 * i] == 0) fprintf(file, "%d,\n", 10 * i + 1);
  fclose(file);
  flesh_mesh_destroy(&mesh);
}

static flesh_selection nothing(void)
{
  flesh_selection selection = {.body = NULL};
  for (int k = 0; k < 6; k++) selection.box[k] = NAN;
  selection.sphere.radius = NAN;
  return selection;
}

static flesh_selection boxed(double low, double high)
{
  flesh_selection selection = nothing();
  for (int c = 0; c < 3; c++) selection.box[c] = c ? -1 : low, selection.box[3 + c] = c ? 2 : high;
  return selection;
}

static flesh_selection named(char *set)
{
  flesh_selection selection = nothing();
  selection.set = set;
  return selection;
}

typedef int select_function(const flesh_selection *, const flesh_body *, int *, int **);

static void check_same(select_function *select, const flesh_body *body, const flesh_selection *a, const flesh_selection *b,
                       int ints_each, int least)
{
  int counts[2] = {0, 0}, *lists[2] = {NULL, NULL};
  const int failed = select(a, body, &counts[0], &lists[0]) || select(b, body, &counts[1], &lists[1]);
  CHECK(!failed);
  if (failed) return;
  CHECK(counts[0] == counts[1] && counts[0] >= least);
  if (counts[0] == counts[1])
    CHECK(!memcmp(lists[0], lists[1], (size_t)ints_each * (size_t)counts[0] * sizeof(int)));
  free(lists[0]);
  free(lists[1]);
}

static flesh_scene *read_bar(const char *body, const char *effects)
{
  char text[1024];
  flesh_scene *scene = NULL;
  snprintf(text, sizeof text, "body: {mesh: bar.inp, density: 1000, material: {energy: S, young: 1e5, poisson: 0.3}%s\n"
           "effects: [inertia, %s]\ntime: {step: 0.01, end: 0.01}\n", body, effects);
  CHECK_OK(flesh_scene_read_text(text, file_path("s.yaml"), 0, NULL, &scene));
  return scene;
}

/* Returns the nodes of the set `clamp` in the file, for a body whose first node is `first`. */
static flesh_selection listed(int first)
{
  static int numbers[4];
  flesh_selection selection = nothing();
  for (int k = 0; k < 4; k++) numbers[k] = first + 5 * k;
  selection.nodes = (flesh_integers){4, numbers};
  return selection;
}

static void a_set_is_what_a_box_is(void)
{
  static const char *const bodies[] = {"}", ", refine: 1}", ", element: tet10-mean}", ", refine: 1, element: tet10}",
    ", refine: 1, element: tet10, curved: [{sphere: {centre: [2, .5, .5], radius: 2.1213203435596424}}]}"};
  for (int b = 0; b < 5; b++) {
    flesh_scene *scene = read_bar(bodies[b], "pin: {set: clamp}");
    if (!scene) continue;
    flesh_selection set = named("clamp"), box = boxed(-1, 1e-9), half = named("lower"), low = boxed(-1, 2 + 1e-9);
    check_same(flesh_selection_nodes, &scene->body, &set, &box, 1, 4);
    check_same(flesh_selection_triangles, &scene->body, &set, &box, 3, 2);
    check_same(flesh_selection_nodes, &scene->body, &half, &low, 1, 8);
    flesh_selection list = listed(0);
    check_same(flesh_selection_nodes, &scene->body, &list, &box, 1, 4);
    check_same(flesh_selection_triangles, &scene->body, &list, &box, 3, 2);
    flesh_selection both = set, either = box;
    both.nodes = either.nodes = (flesh_integers){1, (int[]){7}};
    check_same(flesh_selection_nodes, &scene->body, &both, &either, 1, 5);
    flesh_selection regions = nothing();
    regions.regions = (flesh_integers){1, (int[]){1}};
    check_same(flesh_selection_triangles, &scene->body, &half, &regions, 3, 18);
    flesh_scene_destroy(&scene);
  }
}

static void a_set_is_of_each_body_that_has_it(void)
{
  flesh_scene *scene = read_bar(", name: a}\nbodies: [{name: b, mesh: bar.inp, translation: [0, 0, 5]}]", "pin: {set: clamp}");
  if (!scene) return;
  flesh_selection set = named("clamp"), box = boxed(-1, 1e-9);
  box.box[5] = 9;
  check_same(flesh_selection_nodes, &scene->body, &set, &box, 1, 8);
  set.body = box.body = "b";
  check_same(flesh_selection_nodes, &scene->body, &set, &box, 1, 4);
  check_same(flesh_selection_triangles, &scene->body, &set, &box, 3, 2);
  flesh_scene_destroy(&scene);
}

static void a_list_has_the_nodes_between_in_each_body(void)
{
  static const char *const elements[][2] = {{"tet4", "tet4"}, {"tet10", "tet4"}, {"tet4", "tet10-mean"}, {"tet10", "tet10"}};
  for (int e = 0; e < 8; e++) {
    char body[256];
    snprintf(body, sizeof body, ", name: a, refine: %d, element: %s}\nbodies: [{name: b, mesh: bar.inp, element: %s, translation: "
             "[0, 0, 5]}]", e % 2, elements[e / 2][0], elements[e / 2][1]);
    flesh_scene *scene = read_bar(body, "traction: {set: clamp, traction: [1, 0, 0]}");
    if (!scene) continue;
    for (int b = 0; b < 2; b++) {
      flesh_selection list = listed(scene->part_nodes[b]), set = named("clamp");
      set.body = b ? "b" : "a";
      check_same(flesh_selection_nodes, &scene->body, &list, &set, 1, 4);
      check_same(flesh_selection_triangles, &scene->body, &list, &set, 3, 2);
    }
    flesh_scene_destroy(&scene);
  }
}

/* The ends of edges, and the file's numbers of mid-edge nodes, select only these nodes. */
static void a_list_of_a_file_with_ten_nodes_is_its_nodes(void)
{
  flesh_mesh *mesh, *raised;
  char text[512];
  flesh_scene *scene = NULL;
  CHECK_OK(flesh_mesh_read(file_path("bar.inp"), &mesh));
  CHECK_OK(flesh_mesh_raise_order(mesh, &raised));
  CHECK_OK(flesh_mesh_write(raised, file_path("ten.msh")));
  snprintf(text, sizeof text, "body: {mesh: ten.msh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.3}}\n"
           "effects: [inertia, pin: {nodes: [0, 5, 10, 15, %d]}]\ntime: {step: 0.01, end: 0.01}\n", mesh->nodes + 9);
  CHECK_OK(flesh_scene_read_text(text, file_path("s.yaml"), 0, NULL, &scene));
  CHECK(scene && scene->system->constraints[0].count == 5);
  flesh_scene_destroy(&scene);
  flesh_mesh_destroy(&mesh);
  flesh_mesh_destroy(&raised);
}

static void muscles_take_the_tets_of_a_set(void)
{
  flesh_scene *scene = read_bar("}", "pin: {set: clamp}");
  if (!scene) return;
  flesh_fibre_field field = {.direction = {1, 0, 0}, .along = {.from = {NAN}}};
  flesh_tet_selection selection = {.box = {NAN}, .set = "upper"};
  flesh_chosen_fibres chosen;
  CHECK_OK(flesh_fibres_choose(&selection, &field, &scene->body, &chosen));
  CHECK(chosen.count == 12 && chosen.tets[0] == 12);
  flesh_fibres_free(&chosen);
  selection.set = "clamp"; /* of nodes */
  CHECK(flesh_fibres_choose(&selection, &field, &scene->body, &chosen) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "no tet of the mesh meets all of the given regions, box, set and body");
  flesh_fibres_free(&chosen);
  selection.set = "top";
  CHECK(flesh_fibres_choose(&selection, &field, &scene->body, &chosen) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "set is 'top'; the mesh has the sets 'lower', 'upper' and 'clamp'");
  flesh_fibres_free(&chosen);
  flesh_scene_destroy(&scene);
}

static void regions_are_chosen_by_tag_set_and_box(void)
{
  static const char *const regions[] = {"{set: upper, density: 7}", "{tags: [2], density: 7}",
                                        "{box: [[2, 0, 0], [4, 1, 1]], density: 7}",
                                        "{tags: [2], set: upper, density: 7}, {box: [[0, 0, 0], [2, 1, 1]], density: 1000}"};
  for (size_t k = 0; k < sizeof regions / sizeof *regions; k++) {
    char body[256];
    snprintf(body, sizeof body, ", name: a, regions: [%s]}\nbodies: [{name: b, mesh: bar.inp, translation: [0, 0, 5]}]",
             regions[k]);
    flesh_scene *scene = read_bar(body, "pin: {set: clamp}");
    if (!scene) continue;
    for (int t = 0; t < 48; t++) CHECK(scene->body.density[t] == (t >= 12 && t < 24 ? 7 : 1000));
    flesh_scene_destroy(&scene);
  }
}

static void names_that_there_are_not_are_refused(void)
{
  static const struct {
    const char *mesh, *effect, *expected;
  } bad[] = {{"bar.inp", "pin: {set: Clamp}", "s.yaml:1:96: effects[0].pin: set is 'Clamp'; the mesh has the sets 'lower', 'upper' and 'clamp'"},
             {"bar.inp", "force: {set: tip, force: [0, 0, 1]}", "effects[0].force: set is 'tip'; the mesh has the sets"},
             {"bar.inp", "spring: {set: tip, target: {translation: [0, 0, 1]}, stiffness: 1}", ""},
             {"bar.node", "pin: {set: clamp}", "effects[0].pin: set is 'clamp'; the mesh has no named sets"}};
  write_bar();
  for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
    char text[512];
    flesh_scene *scene = NULL;
    snprintf(text, sizeof text, "{body: {mesh: %s, material: {energy: S, young: 1e5, poisson: 0.3}}, effects: [{%s}]}\n",
             bad[k].mesh, bad[k].effect);
    CHECK(flesh_scene_read_text(text, file_path("s.yaml"), 0, NULL, &scene) && !scene);
    CHECK_TEXT(flesh_error_text(), bad[k].expected);
    flesh_scene_destroy(&scene);
  }
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  write_deck();
  const int code = RUN_TESTS(argc, argv, TEST(a_set_is_what_a_box_is), TEST(a_set_is_of_each_body_that_has_it),
                             TEST(a_list_has_the_nodes_between_in_each_body), TEST(a_list_of_a_file_with_ten_nodes_is_its_nodes),
                             TEST(muscles_take_the_tets_of_a_set),
                             TEST(regions_are_chosen_by_tag_set_and_box), TEST(names_that_there_are_not_are_refused));
  test_folder_remove(folder);
  return code;
}
