/* scene_files.h: the small files that tests of scenes read. Include it before any system header. */
#ifndef FLESH_TEST_SCENE_FILES_H
#define FLESH_TEST_SCENE_FILES_H

#include "temporary.h"

#include "flesh/mesh.h"
#include "flesh/scene.h"
#include "test.h"

static char folder[256];

/* Returns the path of `name` in the tests' folder; up to eight are valid at a time. */
static inline const char *file_path(const char *name)
{
  static char paths[8][512];
  static int next;
  char *path = paths[next++ % 8];
  snprintf(path, sizeof paths[0], "%s/%s", folder, name);
  return path;
}

static inline const char *write_bytes(const char *name, const char *data, size_t size)
{
  const char *path = file_path(name);
  FILE *file = fopen(path, "wb");
  if (!file || fwrite(data, 1, size, file) != size || fclose(file)) {
    perror(path);
    abort();
  }
  return path;
}

static inline const char *write_text(const char *name, const char *text)
{
  return write_bytes(name, text, strlen(text));
}

/* Returns the whole file as an allocated text. */
static inline char *read_text(const char *path)
{
  FILE *file = fopen(path, "rb");
  char *text = calloc(1, 1 << 20);
  if (!file || !text) abort();
  size_t size = fread(text, 1, (1 << 20) - 1, file);
  text[size] = 0;
  fclose(file);
  return text;
}

/* bar.node and bar.ele: 4 x 1 x 1 m, cubes in six tets, region 3 where x < 2 and 7 beyond. */
static inline void write_bar(void)
{
  flesh_mesh *mesh;
  if (flesh_mesh_box((int[]){4, 1, 1}, (double[]){4, 1, 1}, (double[]){0, 0, 0}, &mesh)) abort();
  const double *x = flesh_mesh_positions(mesh);
  const int *tets = flesh_mesh_tets(mesh);
  FILE *node = fopen(file_path("bar.node"), "w"), *ele = fopen(file_path("bar.ele"), "w");
  if (!node || !ele) abort();
  fprintf(node, "%d 3 0 0\n", flesh_mesh_node_count(mesh));
  for (int n = 0; n < flesh_mesh_node_count(mesh); n++)
    fprintf(node, "%d %g %g %g\n", n, x[3 * n], x[3 * n + 1], x[3 * n + 2]);
  fprintf(ele, "%d 4 1\n", flesh_mesh_tet_count(mesh));
  for (int t = 0; t < flesh_mesh_tet_count(mesh); t++) {
    const int *n = tets + 4 * t;
    double middle = (x[3 * n[0]] + x[3 * n[1]] + x[3 * n[2]] + x[3 * n[3]]) / 4;
    fprintf(ele, "%d %d %d %d %d %d\n", t, n[0], n[1], n[2], n[3], middle < 2 ? 3 : 7);
  }
  fclose(node);
  fclose(ele);
  flesh_mesh_destroy(&mesh);
}

/* Writes the text as `name` and reads it as a scene. */
static inline int read_scene(const char *name, const char *text, int count,
                             const char *const *overrides, flesh_scene **scene)
{
  return flesh_scene_read(write_text(name, text), count, overrides, scene);
}

/* Returns the resolved scene as an allocated text. */
static inline char *resolved(const flesh_scene *scene)
{
  if (flesh_scene_write(scene, file_path("resolved.yaml"))) return strdup(flesh_error_text());
  return read_text(file_path("resolved.yaml"));
}

/* The scene shown in the documentation. */
static const char example[] =
    "body:\n"
    "  mesh: bar.node\n"
    "  density: 1000            # kg/m³\n"
    "  mass: lumped             # or consistent\n"
    "  material: {energy: B, constants: raw, mu: 34000, lambda: 306000}   # or young, poisson\n"
    "effects:\n"
    "  - inertia: {}\n"
    "  - gravity: {acceleration: [0, 0, -9.81]}\n"
    "  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}\n"
    "time: {method: backward-euler, step: 1/60, end: 2}\n"
    "solver: {newton_tolerance: 1e-10}    # τ of the design\n";

#endif
