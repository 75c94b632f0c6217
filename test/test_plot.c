/* test_plot.c: pictures are drawn with the right triangles in the right order and colours, or
 * refused in a sentence. */
#include "temporary.h"

#include "flesh/mesh.h"
#include "plot.h"
#include "test.h"

static char folder[256];

static const char *in_folder(const char *name)
{
  static char path[512];
  snprintf(path, sizeof path, "%s/%.200s", folder, name);
  return path;
}

static int is_png(const char *path)
{
  static const unsigned char signature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  unsigned char start[8] = {0};
  FILE *stream = fopen(path, "rb");
  if (!stream) return 0;
  int whole = fread(start, 1, 8, stream) == 8;
  fclose(stream);
  return whole && !memcmp(start, signature, 8);
}

/* One cube; the tet `special` has the value 1.5, the others 1. */
static flesh_mesh *cube(int special, double value[6])
{
  static const int cells[3] = {1, 1, 1};
  static const double size[3] = {1, 1, 1}, origin[3] = {0};
  flesh_mesh *mesh;
  CHECK_OK(flesh_mesh_box(cells, size, origin, &mesh));
  for (int t = 0; t < 6; t++) value[t] = t == special ? 1.5 : 1;
  return mesh;
}

/* Reads back the triangles of NAME.dat: corners and red, green, blue. */
static int read_triangles(const char *name, double p[][3][2], int rgb[][3])
{
  FILE *stream = fopen(in_folder(name), "r");
  int count = 0;
  double x[4], y[4], z;
  unsigned colour[4];
  for (; stream && count < 64; count++) {
    for (int k = 0; k < 4; k++)
      if (fscanf(stream, "%lf %lf %lf %u", &x[k], &y[k], &z, &colour[k]) != 4) {
        fclose(stream);
        return count;
      }
    for (int k = 0; k < 3; k++) p[count][k][0] = x[k + 1], p[count][k][1] = y[k + 1];
    for (int c = 0; c < 3; c++) rgb[count][c] = (int)(colour[0] >> (16 - 8 * c) & 255);
  }
  if (stream) fclose(stream);
  return count;
}

static void a_body_is_drawn(void)
{
  double value[6], p[64][3][2];
  int rgb[64][3];
  flesh_mesh *mesh = cube(-1, value);
  const flesh_plot_panel panel = {"a cube's title", "and $more", mesh, flesh_mesh_positions(mesh),
                                  value};
  flesh_plot_surface_options options;
  flesh_plot_surface_options_default(&options);
  options.azimuth = 0, options.elevation = 0; /* looks along +y: x to the right, z up */
  CHECK_OK(flesh_plot_surface(folder, "cube", 1, &panel, &options));
  CHECK(is_png(in_folder("cube.png")));
  CHECK(access(in_folder("cube.gp"), R_OK) == 0 && access(in_folder("cube.log"), F_OK) != 0);
  CHECK(read_triangles("cube.dat", p, rgb) == 12);
  /* Drawn last, on top: the face y = 0, the whole unit square, in the colour of J = 1, nearly grey.
   */
  for (int s = 10; s < 12; s++) {
    double area = 0;
    for (int k = 0; k < 3; k++)
      area += 0.5 * (p[s][k][0] * p[s][(k + 1) % 3][1] - p[s][(k + 1) % 3][0] * p[s][k][1]);
    CHECK_NEAR(area, 0.5, 1e-6); /* anticlockwise: it faces the camera */
    CHECK(rgb[s][0] - rgb[s][2] < 30 && rgb[s][0] > 150);
  }
  flesh_mesh_destroy(&mesh);
}

static void each_triangle_has_the_colour_of_its_tet(void)
{
  for (int special = 0; special < 6; special++) {
    double value[6], p[64][3][2];
    int rgb[64][3], red = 0;
    flesh_mesh *mesh = cube(special, value);
    const flesh_plot_panel panel = {"", NULL, mesh, flesh_mesh_positions(mesh), value};
    flesh_plot_surface_options options;
    flesh_plot_surface_options_default(&options);
    CHECK_OK(flesh_plot_surface(folder, "colour", 1, &panel, &options));
    int count = read_triangles("colour.dat", p, rgb);
    for (int s = 0; s < count; s++) red += rgb[s][0] > 2 * rgb[s][1];
    CHECK(red == 2); /* a Kuhn tet of a cube has two faces on its surface */
    flesh_mesh_destroy(&mesh);
  }
}

static void a_panel_without_a_state_and_a_broken_state_are_drawn(void)
{
  double value[6], x[24];
  flesh_mesh *mesh = cube(-1, value);
  memcpy(x, flesh_mesh_positions(mesh), sizeof x);
  x[3] = NAN, x[7] = INFINITY;
  const flesh_plot_panel panels[] = {{"none", "failed at t = 0", mesh, NULL, NULL},
                                     {"broken", NULL, mesh, x, NULL}};
  flesh_plot_surface_options options;
  flesh_plot_surface_options_default(&options);
  CHECK_OK(flesh_plot_surface(folder, "odd", 2, panels, &options));
  CHECK(is_png(in_folder("odd.png")));
  options.low = 1;
  CHECK(flesh_plot_surface(folder, "odd", 2, panels, &options) == FLESH_ERR_ARGUMENT);
  flesh_mesh_destroy(&mesh);
}

static void lines_are_drawn(void)
{
  FILE *stream = fopen(in_folder("table.csv"), "w");
  fputs("t,volume_ratio\n0,1\n1,1.1\n2,nan\n3,0.9\n", stream);
  fclose(stream);
  const flesh_plot_series series[] = {{"B's", "table.csv", "t", "volume_ratio", NULL, 0},
                                      {"S", "table.csv", "t", "volume_ratio", "#ff0000", 1}};
  flesh_plot_lines lines = {"Volume_it's", "t [s]", "V/V0", "set yrange [0:2]\n", 2, series};
  CHECK_OK(flesh_plot_lines_draw(folder, "lines", &lines));
  CHECK(is_png(in_folder("lines.png")));
  lines.extra = "nonsense\n";
  CHECK(flesh_plot_lines_draw(folder, "wrong", &lines) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "gnuplot failed");
  CHECK(access(in_folder("wrong.log"), R_OK) == 0);
}

/* Names come from the users' scenes. */
static void odd_names_are_drawn(void)
{
  static const char name[] = "it's \"a\" % #1\nexit gnuplot status 1\n";
  double value[6];
  flesh_mesh *mesh = cube(-1, value);
  const flesh_plot_panel panel = {"", NULL, mesh, flesh_mesh_positions(mesh), value};
  flesh_plot_surface_options options;
  flesh_plot_surface_options_default(&options);
  CHECK_OK(flesh_plot_surface(folder, "it's", 1, &panel, &options));
  CHECK(is_png(in_folder("it's.png")));
  CHECK(flesh_plot_surface(folder, name, 1, &panel, &options) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "line break");
  flesh_mesh_destroy(&mesh);
}

static void a_missing_gnuplot_is_said(void)
{
  char *path = strdup(getenv("PATH"));
  setenv("PATH", folder, 1);
  int status = flesh_plot_draw(folder, "lines");
  setenv("PATH", path, 1);
  free(path);
  CHECK(status == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "gnuplot is not installed");
  CHECK(access(in_folder("lines.gp"), R_OK) == 0);
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  int result =
      RUN_TESTS(argc, argv, TEST(a_body_is_drawn), TEST(each_triangle_has_the_colour_of_its_tet),
                TEST(a_panel_without_a_state_and_a_broken_state_are_drawn), TEST(lines_are_drawn),
                TEST(odd_names_are_drawn),
                TEST(a_missing_gnuplot_is_said));
  test_folder_remove(folder);
  return result;
}
