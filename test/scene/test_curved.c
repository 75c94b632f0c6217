// TEST full memory seconds=60
/* test_curved.c: bodies with boundaries on spheres, cylinders and surfaces: volumes, positions of nodes, refusals. */
#include "scene_files.h"

#include <math.h>
#include <stdlib.h>

#include "flesh/surface.h"

/* Makes the scene of one body of `mesh` with these keys. */
static int open_scene(const char *mesh, const char *keys, flesh_scene **scene)
{
  char text[6000];
  snprintf(text, sizeof text, "body: {mesh: '%s', %s}\neffects: [gravity: {}]\n", mesh, keys);
  return flesh_scene_read(write_text("scene.yaml", text), 0, NULL, scene);
}

static const char *of_data(const char *name)
{
  static char path[4200];
  char relative[200];
  snprintf(relative, sizeof relative, "../data/meshes/%s", name);
  CHECK(realpath(relative, path));
  return path;
}

static double volume_of(const char *mesh, const char *keys)
{
  flesh_scene *scene = NULL;
  CHECK_OK(open_scene(mesh, keys, &scene));
  if (!scene) return NAN;
  const double volume = flesh_mesh_volume(flesh_scene_mesh(scene), flesh_mesh_positions(flesh_scene_mesh(scene)));
  flesh_scene_destroy(&scene);
  return volume;
}

/* Half of a thick sphere, and a rod with a round end: the error of their volumes nearly vanishes. */
static void volumes_are_those_of_the_shapes(void)
{
  const double shell = 2 * M_PI / 3 * (1e-3 - 3.43e-4), rod = M_PI * 0.028 * 0.028 * (0.272 + 2. / 3 * 0.028);
  const char *spheres = "element: tet10, curved: [{sphere: {radius: 0.1}}, {sphere: {radius: 0.07}}]";
  const char *cylinder = "element: tet10, curved: [{cylinder: {from: [0, 0, 0], to: [0.272, 0, 0], radius: 0.028}}, "
                         "{sphere: {centre: [0.272, 0, 0], radius: 0.028}}]";
  const double shells[2] = {volume_of(of_data("sphere_shell.msh"), "element: tet10"),
                            volume_of(of_data("sphere_shell.msh"), spheres)};
  const double rods[2] = {volume_of(of_data("limb.msh"), "element: tet10"), volume_of(of_data("limb.msh"), cylinder)};
  printf("# shell off by %.2g, then %.2g; rod by %.2g, then %.2g\n", shells[0] / shell - 1, shells[1] / shell - 1,
         rods[0] / rod - 1, rods[1] / rod - 1);
  CHECK(fabs(shells[1] / shell - 1) < 0.02 * fabs(shells[0] / shell - 1));
  CHECK(fabs(rods[1] / rod - 1) < 0.02 * fabs(rods[0] / rod - 1));
}

/* The error of the volume falls with the fourth power of the edge length, and every tet keeps a positive Jacobian,
 * without which a mesh is refused. */
static void refined_volumes_converge(void)
{
  const double ball = 4 * M_PI / 3 * 1.25e-4, rod = M_PI * 0.028 * 0.028 * (0.272 + 2. / 3 * 0.028);
  const struct {
    const char *mesh, *curved;
    double volume;
    int most;
  } cases[] = {{"ball.msh", "{sphere: {radius: 0.05}}", ball, 2},
               {"sphere_shell.msh", "{sphere: {radius: 0.1}}, {sphere: {radius: 0.07}}",
                2 * M_PI / 3 * (1e-3 - 3.43e-4), 1},
               {"limb.msh", "{cylinder: {from: [0, 0, 0], to: [0.272, 0, 0], radius: 0.028}}, "
                "{sphere: {centre: [0.272, 0, 0], radius: 0.028}}", rod, 1}};
  for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
    double before = NAN;
    for (int refine = 0; refine <= cases[k].most; refine++) {
      char keys[400];
      snprintf(keys, sizeof keys, "element: tet10, refine: %d, curved: [%s]", refine, cases[k].curved);
      const double error = volume_of(of_data(cases[k].mesh), keys) / cases[k].volume - 1;
      printf("# %s refined %d times: off by %.2g\n", cases[k].mesh, refine, error);
      CHECK(fabs(error) < 1e-3);
      if (refine) CHECK(fabs(before / error) > 12 && fabs(before / error) < 25);
      before = error;
    }
  }
}

/* Makes a slice of a ball: twelve prisms of three tets each between two planes. */
static void write_slice(double low, double high, const char *path)
{
  enum { SIDES = 12 };
  double X[6 * (SIDES + 1)];
  int tets[12 * SIDES];
  flesh_mesh *mesh = NULL;
  for (int i = 0; i < 2 * (SIDES + 1); i++) {
    const double z = i > SIDES ? high : low, at = 2 * M_PI * (i % (SIDES + 1)) / SIDES;
    const double r = i % (SIDES + 1) ? sqrt(1 - z * z) : 0;
    X[3 * i] = r * cos(at), X[3 * i + 1] = r * sin(at), X[3 * i + 2] = z;
  }
  for (int k = 0; k < SIDES; k++) { /* each quadrilateral is divided from its lower first to its upper last node */
    const int a = 1 + k, b = 1 + (k + 1) % SIDES, p = a < b ? a : b, q = a < b ? b : a, up = SIDES + 1;
    const int prism[12] = {0, p, q, q + up, 0, p, p + up, q + up, 0, up, p + up, q + up};
    memcpy(tets + 12 * k, prism, sizeof prism);
  }
  CHECK_OK(flesh_mesh_create(2 * (SIDES + 1), X, 3 * SIDES, tets, NULL, &mesh));
  CHECK_OK(flesh_mesh_write(mesh, path));
  flesh_mesh_destroy(&mesh);
}

/* Planes that cut a ball obliquely stay planes. Their rims become circles, so that the volume is that of the slice. */
static void cuts_stay_flat(void)
{
  const double low = 0.3, high = 0.6, height = high - low;
  const double slice = M_PI * height / 6 * (3 * (1 - low * low) + 3 * (1 - high * high) + height * height);
  double before = NAN;
  write_slice(low, high, file_path("slice.mesh"));
  for (int refine = 0; refine < 3; refine++) {
    char keys[200];
    snprintf(keys, sizeof keys, "element: tet10, refine: %d, curved: [{sphere: {radius: 1}}]", refine);
    const double error = volume_of("slice.mesh", keys) / slice - 1;
    printf("# slice refined %d times: off by %.2g\n", refine, error);
    if (refine) CHECK(fabs(before / error) > 12);
    before = error;
  }
  CHECK(fabs(before) < 1e-5);
}

/* Nodes on the intersection of two surfaces are on both, including those added by refinement. */
static void surfaces_meet_in_their_nodes(void)
{
  flesh_scene *scene = NULL;
  int seam = 0;
  double worst = 0;
  CHECK_OK(open_scene(of_data("limb.msh"),
                      "element: tet10, refine: 1, curved: [{sphere: {centre: [0.272, 0, 0], radius: 0.028}}, "
                      "{cylinder: {from: [0, 0, 0], to: [0.272, 0, 0], radius: 0.028}}]", &scene));
  const flesh_mesh *mesh = flesh_scene_mesh(scene);
  const double *X = flesh_mesh_positions(mesh);
  int triangles;
  const int *surface = flesh_mesh_surface(mesh, &triangles);
  for (int k = 0; k < 3 * triangles; k++) {
    const double *x = X + 3 * surface[k], r = hypot(x[1], x[2]), past = x[0] - 0.272;
    if (x[0] < 1e-12) continue;
    worst = fmax(worst, fabs((past > 0 ? hypot(r, past) : r) - 0.028));
    seam += fabs(past) < 1e-12;
  }
  CHECK_BELOW(worst, 1e-12);
  CHECK(seam > 20);
  flesh_scene_destroy(&scene);
}

/* One corner of the ball's boundary stands out by a seventh of an edge: its faces are left unchanged, and that is
 * reported. */
static void faces_that_are_left_are_told(void)
{
  const char *sphere = "element: tet10, refine: 1, curved: [{sphere: {radius: 0.05}}]";
  flesh_mesh *mesh = NULL, *other = NULL;
  flesh_scene *scene = NULL;
  CHECK_OK(open_scene(of_data("ball.msh"), sphere, &scene));
  CHECK(scene && !flesh_scene_warning(scene));
  flesh_scene_destroy(&scene);
  CHECK_OK(flesh_mesh_read(of_data("ball.msh"), &mesh));
  const int nodes = flesh_mesh_node_count(mesh);
  double *x = malloc(3 * (size_t)nodes * sizeof *x);
  int triangles, faces = 0;
  const int *surface = flesh_mesh_surface(mesh, &triangles);
  memcpy(x, flesh_mesh_positions(mesh), 3 * (size_t)nodes * sizeof *x);
  for (int c = 0; c < 3; c++) x[3 * surface[0] + c] *= 1 + 0.02 / 7 / 0.05;
  for (int k = 0; k < 3 * triangles; k++) faces += surface[k] == surface[0];
  CHECK_OK(flesh_mesh_create(nodes, x, flesh_mesh_tet_count(mesh), flesh_mesh_tets(mesh), NULL, &other));
  CHECK_OK(flesh_mesh_write(other, file_path("dented.mesh")));
  CHECK_OK(open_scene("dented.mesh", sphere, &scene));
  char words[80];
  snprintf(words, sizeof words, "body.curved[0]: %d faces ", faces);
  printf("# %s\n", scene ? flesh_scene_warning(scene) : "-");
  CHECK(faces > 3 && scene && flesh_scene_warning(scene) && strstr(flesh_scene_warning(scene), words));
  flesh_scene_destroy(&scene);
  flesh_mesh_destroy(&mesh);
  flesh_mesh_destroy(&other);
  free(x);
}

static void nodes_lie_on_the_spheres(void)
{
  flesh_scene *scene = NULL;
  int triangles, curved = 0;
  CHECK_OK(open_scene(of_data("sphere_shell.msh"),
                "element: tet10-mean, refine: 0, curved: [{sphere: {radius: 0.1}}, {sphere: {radius: 0.07}}]", &scene));
  const flesh_mesh *mesh = flesh_scene_mesh(scene);
  const double *X = flesh_mesh_positions(mesh);
  const int *surface = flesh_mesh_surface(mesh, &triangles);
  for (int k = 0; k < 3 * triangles; k++) {
    const double *x = X + 3 * surface[k], r = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
    CHECK(fabs(r - 0.1) < 1e-12 || fabs(r - 0.07) < 1e-12 || fabs(x[1]) < 1e-12);
  }
  for (int e = 0; e < flesh_mesh_tet_count(mesh); e++) curved += flesh_mesh_tet_curved(mesh)[e];
  CHECK(curved > flesh_mesh_tet_count(mesh) / 4);
  flesh_scene_destroy(&scene);
}

/* A coarse shell is curved with a file of a finer one's surface, whose facets are half as long. */
static void surfaces_of_files_are_followed(void)
{
  flesh_scene *scene = NULL;
  flesh_surface *surface = NULL;
  const double shell = 2 * M_PI / 3 * (1e-3 - 3.43e-4);
  CHECK_OK(open_scene(of_data("sphere_shell.msh"),
                "element: tet10, refine: 1, curved: [{sphere: {radius: 0.1}}, {sphere: {radius: 0.07}}]", &scene));
  CHECK_OK(flesh_surface_of_mesh(flesh_scene_mesh(scene), &surface));
  CHECK_OK(flesh_surface_write(surface, NULL, file_path("fine.obj")));
  flesh_surface_destroy(&surface);
  flesh_scene_destroy(&scene);
  const double straight = volume_of(of_data("sphere_shell.msh"), "element: tet10") / shell - 1;
  const char *file = "element: tet10, curved: [{surface: fine.obj}]";
  const double curved = volume_of(of_data("sphere_shell.msh"), file) / shell - 1;
  printf("# shell off by %.2g, then %.2g\n", straight, curved);
  CHECK(fabs(curved) < 0.15 * fabs(straight));
}

static void refused(const char *mesh, const char *keys, const char *part)
{
  flesh_scene *scene = NULL;
  CHECK(open_scene(mesh, keys, &scene) != FLESH_OK && !scene);
  if (!strstr(flesh_error_text(), part)) printf("# %s\n", flesh_error_text());
  CHECK(strstr(flesh_error_text(), part));
}

static void what_cannot_be_is_refused(void)
{
  flesh_mesh *sliver = NULL;
  const double a = sqrt(1 - 0.09), b = sqrt(1 - 0.16);
  CHECK_OK(flesh_mesh_create(4, (double[]){-0.3, 0, a, 0.3, 0, a, 0, -0.4, b, 0, 0.4, b}, 1, (int[]){0, 1, 2, 3}, NULL,
                             &sliver));
  CHECK_OK(flesh_mesh_write(sliver, file_path("sliver.mesh")));
  flesh_mesh_destroy(&sliver);
  refused("sliver.mesh", "element: tet10, curved: [{sphere: {radius: 1}}]", "scene.yaml:1:");
  CHECK(strstr(flesh_error_text(), "curved: "));
  CHECK(strstr(flesh_error_text(), "Jacobian"));
  refused(of_data("limb.msh"), "curved: [{sphere: {radius: 1}}]", "the element must be tet10 or tet10-mean");
  refused(of_data("limb.msh"), "element: tet10, curved: [{sphere: {radius: 1}}]", "no face of the mesh's boundary lies");
  refused(of_data("limb.msh"), "element: tet10, curved: [{}]", "0 surfaces are given");
  refused(of_data("limb.msh"), "element: tet10, curved: [{sphere: {radius: -1}}]", "radius is -1; it must be");
  refused(of_data("limb.msh"), "element: tet10, curved: [{cylinder: {from: [0, 0, 0], to: [0, 0, 0], radius: 1}}]",
          "must be its two ends");
  refused(of_data("limb.msh"), "element: tet10, curved: [{surface: none.ply}]", "none.ply");
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  int failed = RUN_TESTS(argc, argv, TEST(volumes_are_those_of_the_shapes), TEST(refined_volumes_converge), TEST(cuts_stay_flat),
                         TEST(surfaces_meet_in_their_nodes), TEST(faces_that_are_left_are_told), TEST(nodes_lie_on_the_spheres),
                         TEST(surfaces_of_files_are_followed), TEST(what_cannot_be_is_refused));
  test_folder_remove(folder);
  return failed;
}
