/* test_picture.c: what is rendered where, what is fitted, and which values become colours. */
#include "test_mesh_files.h"

#include "flesh/flesh.h"
#include "picture.h"
#include "picture_body.h"

static const double open_target[3] = {NAN, NAN, NAN};

/* Where a view puts a point, in parts of the picture from its middle (-1/2 ... 1/2). */
static void place(const flesh_view *v, const double p[3], double at[2])
{
  double q[3], r = 0, u = 0, away = 0;
  for (int d = 0; d < 3; d++) {
    q[d] = p[d] - v->target[d];
    r += q[d] * v->right[d], u += q[d] * v->up[d], away -= q[d] * v->back[d];
  }
  double w = v->distance > 0 ? v->distance / (v->distance + away) : 1;
  at[0] = r * w / v->height * v->height_px / v->width_px;
  at[1] = u * w / v->height;
}

static void everything_is_in_the_picture_and_fills_it(void)
{
  unsigned long long seed = 6;
  for (int trial = 0; trial < 200; trial++) {
    double points[60], most = 0, scale = pow(10, 6 * test_uniform(&seed) - 3);
    flesh_camera camera = {.azimuth = 360 * test_uniform(&seed), .elevation = 180 * test_uniform(&seed) - 90,
                           .height = NAN, .field_of_view = trial & 1 ? 5 + 80 * test_uniform(&seed) : 0};
    memcpy(camera.target, open_target, sizeof open_target);
    for (int d = 0; d < 60; d++) points[d] = scale * (test_uniform(&seed) + (d % 3 == 1 ? 7 : 0));
    if (trial % 3 == 0)
      for (int d = 0; d < 3; d++) camera.target[d] = points[d];
    flesh_view_fit fit;
    flesh_view view;
    flesh_view_fit_begin(&camera, 400, trial % 5 ? 300 : 700, &fit);
    flesh_view_fit_add(&fit, 20, points);
    flesh_view_fit_end(&fit, &camera, &view);
    for (int k = 0; k < 20; k++) {
      double at[2];
      place(&view, points + 3 * k, at);
      most = fmax(most, fmax(fabs(at[0]), fabs(at[1])));
    }
    CHECK(most <= 0.5 && most > 0.4);
  }
}

/* Two triangles across the view, the near one over the middle of the far one. */
static void near_hides_far(void)
{
  for (int perspective = 0; perspective < 2; perspective++) {
    flesh_camera camera = {.target = {0, 0, 0}, .height = 4, .field_of_view = perspective ? 40 : 0};
    flesh_view_fit fit;
    flesh_view view;
    flesh_image image;
    flesh_view_fit_begin(&camera, 80, 80, &fit);
    flesh_view_fit_end(&fit, &camera, &view); /* along +y */
    static const double far[9] = {-1.5, 1, -1.5, 1.5, 1, -1.5, 0, 1, 1.5},
                        near[9] = {-.4, -1, -.6, .4, -1, -.6, 0, -1, 0};
    static const int corners[3] = {0, 1, 2};
    const flesh_render_surface surfaces[2] = {
        {.vertices = 3, .triangles = 1, .x = far, .corners = corners, .plain = {0.6f, 0, 0}},
        {.vertices = 3, .triangles = 1, .x = near, .corners = corners, .plain = {0, 0.6f, 0}}};
    for (int order = 0; order < 2; order++) { /* whichever comes first */
      const flesh_render_surface turned[2] = {surfaces[order], surfaces[!order]};
      CHECK_OK(flesh_render(&view, 2, turned, 2, &image));
      uint32_t middle = image.pixels[48 * 80 + 40], above = image.pixels[34 * 80 + 40];
      uint32_t out = image.pixels[2 * 80 + 2];
      CHECK((middle >> 8 & 255) > 2 * (middle >> 16 & 255)); /* green */
      CHECK((above >> 16 & 255) > 2 * (above >> 8 & 255));   /* red */
      CHECK((out & 255) > 200 && (out >> 8 & 255) > 200);    /* the wall behind */
      flesh_image_free(&image);
    }
  }
}

/* What has collapsed to a line or a point can be seen: about as long as it is, and thin. */
static void lines_and_points_are_drawn(void)
{
  flesh_camera camera = {.azimuth = 90, .target = {0, 0, 0}, .height = 4};
  flesh_view_fit fit;
  flesh_view view;
  flesh_view_fit_begin(&camera, 80, 80, &fit);
  flesh_view_fit_end(&fit, &camera, &view);
  static const double line[9] = {-1, 0, -1, 1, 0, 1, 0, 0, 0}, point[9] = {0};
  static const int corners[3] = {0, 1, 2};
  for (int k = 0; k < 2; k++) {
    flesh_image image;
    int drawn = 0;
    const flesh_render_surface surface = {
        .vertices = 3, .triangles = 1, .x = k ? point : line, .corners = corners, .plain = {0.5f, 0.1f, 0.1f}};
    CHECK_OK(flesh_render(&view, 1, &surface, 3, &image));
    for (int p = 0; p < 6400; p++) drawn += (image.pixels[p] >> 8 & 255) < 200;
    CHECK(k ? drawn >= 1 && drawn <= 4 : drawn >= 40 && drawn <= 120); /* 40 pixels along either axis */
    flesh_image_free(&image);
  }
}

/* A small plate between the light and a large one darkens it. */
static void shadows_fall(void)
{
  flesh_camera camera = {.elevation = 90, .target = {0, 0, 0}, .height = 4};
  flesh_view_fit fit;
  flesh_view view;
  flesh_image with, without;
  flesh_view_fit_begin(&camera, 60, 60, &fit);
  flesh_view_fit_end(&fit, &camera, &view);
  static const double floor_x[12] = {-2, -2, 0, 2, -2, 0, 2, 2, 0, -2, 2, 0},
                      plate[12] = {-.5, -.5, .5, .5, -.5, .5, .5, .5, .5, -.5, .5, .5};
  static const int corners[6] = {0, 1, 2, 0, 2, 3};
  const flesh_render_surface surfaces[2] = {
      {.vertices = 4, .triangles = 2, .x = floor_x, .corners = corners, .plain = {0.5f, 0.5f, 0.5f}},
      {.vertices = 4, .triangles = 2, .x = plate, .corners = corners, .plain = {0.5f, 0.5f, 0.5f}}};
  CHECK_OK(flesh_render(&view, 2, surfaces, 1, &with));
  CHECK_OK(flesh_render(&view, 1, surfaces, 1, &without));
  int darker = 0, brighter = 0;
  for (int k = 0; k < 3600; k++) {
    int change = (int)(with.pixels[k] & 255) - (int)(without.pixels[k] & 255);
    darker += change < -25;
    brighter += change > 25;
  }
  CHECK(darker > 40 && darker < 1000 && !brighter);
  flesh_image_free(&with);
  flesh_image_free(&without);
}

/* Where the surface is turned over and where tets are inverted it is dark. */
static void the_inside_is_darker(void)
{
  flesh_camera camera = {.target = {0, 0, 0}, .height = 2};
  flesh_view_fit fit;
  flesh_view view;
  uint32_t seen[3];
  static const double x[9] = {-1, 0, -1, 1, 0, -1, 0, 0, 1};
  static const int facing[3] = {0, 1, 2}, turned[3] = {0, 2, 1};
  static const uint8_t marked[1] = {1};
  flesh_view_fit_begin(&camera, 40, 40, &fit);
  flesh_view_fit_end(&fit, &camera, &view);
  for (int k = 0; k < 3; k++) {
    flesh_image image;
    const flesh_render_surface surface = {.vertices = 3, .triangles = 1, .x = x, .corners = k == 1 ? turned : facing,
                                          .marked = k == 2 ? marked : NULL, .plain = {0.5f, 0.5f, 0.5f}};
    CHECK_OK(flesh_render(&view, 1, &surface, 1, &image));
    seen[k] = image.pixels[24 * 40 + 20] >> 8 & 255;
    flesh_image_free(&image);
  }
  CHECK(seen[1] < 0.8 * seen[0] && seen[2] < 0.5 * seen[0]);
}

/* A block stretched along its axes: J is the product, von Mises' stress follows from derivatives of
 * the energy density along the principal stretches: sigma_i = s_i/J d psi/d s_i. */
static void values_are_those_of_the_motion(void)
{
  flesh_mesh *mesh = NULL;
  flesh_material material;
  const double s[3] = {1.3, 0.9, 0.95}, J = 1.3 * 0.9 * 0.95, e = 1e-6;
  CHECK_OK(flesh_mesh_box((int[]){3, 2, 2}, (double[]){3, 1, 2}, (double[]){0, 0, 0}, &mesh));
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.4, &material));
  flesh_body body = {.mesh = mesh, .materials = &material};
  int nodes = flesh_mesh_node_count(mesh);
  double *x = malloc(sizeof *x * 3 * (size_t)nodes), *v = malloc(sizeof *v * 3 * (size_t)nodes);
  for (int d = 0; d < 3 * nodes; d++) {
    x[d] = s[d % 3] * flesh_mesh_positions(mesh)[d];
    v[d] = d % 3 == 0 ? 3 : d % 3 == 1 ? 0 : -4;
  }
  double sigma[3];
  for (int i = 0; i < 3; i++) {
    double psi[2];
    for (int side = 0; side < 2; side++) {
      double F[9] = {s[0], 0, 0, 0, s[1], 0, 0, 0, s[2]};
      F[4 * i] += side ? e : -e;
      CHECK_OK(flesh_material_energy(&material, F, &psi[side]));
    }
    sigma[i] = s[i] / J * (psi[1] - psi[0]) / (2 * e);
  }
  double mises = sqrt(0.5 * (pow(sigma[0] - sigma[1], 2) + pow(sigma[1] - sigma[2], 2) + pow(sigma[2] - sigma[0], 2)));
  const double expected[] = {[FLESH_PICTURE_J] = J, [FLESH_PICTURE_STRESS] = mises, [FLESH_PICTURE_SPEED] = 5};
  flesh_picture_panel panel = {.body = &body, .x = x, .v = v};
  for (flesh_picture_field field = FLESH_PICTURE_J; field <= FLESH_PICTURE_SPEED; field++) {
    double *values = NULL;
    CHECK_OK(flesh_picture_values(&panel, field, &values));
    for (int i = 0; i < nodes && values; i++) CHECK_NEAR(values[i], expected[field], 1e-7 * expected[field]);
    free(values);
  }
  flesh_picture_options options;
  flesh_picture_options_default(&options);
  flesh_picture_fit fit;
  flesh_picture_frame frame;
  options.field = FLESH_PICTURE_SPEED;
  flesh_picture_fit_begin(&options, &fit);
  CHECK_OK(flesh_picture_fit_add(&fit, &panel));
  flesh_picture_fit_end(&fit, &frame);
  CHECK(frame.low == 0 && frame.high == 5);
  options.field = FLESH_PICTURE_J; /* 1.1115: a scale of 0.88 to 1.12 */
  flesh_picture_fit_begin(&options, &fit);
  CHECK_OK(flesh_picture_fit_add(&fit, &panel));
  flesh_picture_fit_end(&fit, &frame);
  CHECK_NEAR(frame.low, 0.88, 1e-12);
  CHECK_NEAR(frame.high, 1.12, 1e-12);
  body.materials = NULL;
  double *none;
  CHECK(flesh_picture_values(&panel, FLESH_PICTURE_STRESS, &none) == FLESH_ERR_ARGUMENT && !none);
  CHECK_TEXT(flesh_error_text(), "no material");
  free(x), free(v);
  flesh_mesh_destroy(&mesh);
}

static void pictures_are_whole_files(void)
{
  flesh_mesh *mesh = NULL;
  CHECK_OK(flesh_mesh_read("../data/meshes/two_regions.mesh", &mesh));
  flesh_body body = {.mesh = mesh};
  flesh_picture_panel panels[2] = {{.title = "a", .body = &body, .x = flesh_mesh_positions(mesh)},
                                   {.title = "b", .subtitle = "nothing to show", .body = &body}};
  flesh_picture_options options;
  flesh_picture_options_default(&options);
  options.width = 101; /* sizes come out even all the same, as films want them */
  options.field = FLESH_PICTURE_PLAIN;
  const char *path = in_work_folder("two.png");
  CHECK_OK(flesh_picture(path, 2, panels, &options));
  size_t size;
  char *bytes = read_bytes(path, &size);
  CHECK(size > 500 && !memcmp(bytes, "\x89PNG\r\n\x1a\n", 8) && !memcmp(bytes + size - 8, "IEND", 4));
  CHECK(!(bytes[19] & 1) && !(bytes[23] & 1));
  free(bytes);
  CHECK(flesh_picture("/nowhere/at/all.png", 2, panels, &options) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "/nowhere/at/all.png: cannot be written");
  flesh_mesh_destroy(&mesh);
}

/* Coordinates that are no numbers, a subtitle instead of a body, many panels. */
static void broken_states_are_drawn(void)
{
  flesh_mesh *mesh = NULL;
  double x[24];
  CHECK_OK(flesh_mesh_box((int[]){1, 1, 1}, (double[]){1, 1, 1}, (double[]){0, 0, 0}, &mesh));
  flesh_body body = {.mesh = mesh};
  memcpy(x, flesh_mesh_positions(mesh), sizeof x);
  x[3] = NAN, x[7] = INFINITY;
  flesh_picture_panel panels[9] = {{.body = &body, .subtitle = "failed"}, {.body = &body, .x = x}};
  for (int p = 2; p < 9; p++) panels[p] = (flesh_picture_panel){.body = &body, .x = flesh_mesh_positions(mesh)};
  for (int d = 0; d < 24; d++) x[d] = d % 5 ? x[d] : NAN;
  flesh_picture_options options;
  flesh_picture_options_default(&options);
  options.width = 40;
  CHECK_OK(flesh_picture(in_work_folder("odd.png"), 9, panels, &options));
  CHECK_OK(flesh_picture(in_work_folder("odd.png"), 2, panels, &options));
  CHECK_OK(flesh_picture(in_work_folder("odd.png"), 1, panels, &options));
  flesh_mesh_destroy(&mesh);
}

int main(int argc, char **argv)
{
  if (!make_work_folder()) return 1;
  return RUN_TESTS(argc, argv, TEST(everything_is_in_the_picture_and_fills_it), TEST(near_hides_far),
                   TEST(lines_and_points_are_drawn), TEST(shadows_fall), TEST(the_inside_is_darker),
                   TEST(values_are_those_of_the_motion), TEST(pictures_are_whole_files), TEST(broken_states_are_drawn));
}
