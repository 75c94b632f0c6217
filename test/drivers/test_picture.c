// TEST quick needs=drivers
/* test_picture.c: where bodies are drawn, how views are fitted, and which values become colours. */
#include "mesh_files.h"

#include "flesh/flesh.h"
#include "picture/picture.h"
#include "math/mat3.h"
#include "picture/picture_body.h"
#include "picture/picture_legend.h"

static const double open_target[3] = {NAN, NAN, NAN};

/* Computes the position of a point in a view, in fractions of the picture from its middle (-1/2 ... 1/2). */
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
    for (int d = 0; d < 3; d++) camera.up[d] = trial % 7 ? test_uniform(&seed) - 0.5 : -(d == 2);
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

/* Views are upright: at the horizon, up is straight up in the picture, and the axes form a right-handed frame; with z
 * up the camera looks along y, with y up along -z. */
static void the_camera_stands_upright(void)
{
  unsigned long long seed = 4;
  for (int trial = 0; trial < 100; trial++) {
    flesh_camera camera = {.azimuth = 360 * test_uniform(&seed)};
    flesh_view_fit fit;
    double up[3], length = 0, cross[3];
    for (int d = 0; d < 3; d++) {
      camera.up[d] = trial == 0 ? -(d == 2) : trial == 1 ? (d == 2) : test_uniform(&seed) - 0.5;
      length += camera.up[d] * camera.up[d];
    }
    for (int d = 0; d < 3; d++) up[d] = camera.up[d] / sqrt(length);
    flesh_view_fit_begin(&camera, 10, 10, &fit);
    const flesh_view *v = &fit.view;
    flesh_vec3_cross(v->right, v->up, cross);
    for (int d = 0; d < 3; d++) {
      CHECK_NEAR(v->up[d], up[d], 1e-9);
      CHECK_NEAR(v->zenith[d], up[d], 1e-9);
      CHECK_NEAR(cross[d], v->back[d], 1e-9);
    }
    CHECK_NEAR(flesh_vec3_dot(v->right, v->right), 1, 1e-9);
  }
  static const double ups[3][3] = {{0, 0, 0}, {NAN, NAN, NAN}, {0, 3, 0}};
  static const double backs[3][3] = {{0, -1, 0}, {0, -1, 0}, {0, 0, 1}};
  for (int k = 0; k < 3; k++) {
    flesh_camera camera = {.azimuth = 0};
    flesh_view_fit fit;
    memcpy(camera.up, ups[k], sizeof ups[k]);
    flesh_view_fit_begin(&camera, 10, 10, &fit);
    for (int d = 0; d < 3; d++) {
      CHECK_NEAR(fit.view.right[d], d == 0, 1e-12);
      CHECK_NEAR(fit.view.back[d], backs[k][d], 1e-12);
    }
  }
}

/* Two triangles across the view, the near one over the middle of the far one. */
static void near_hides_far(void)
{
  for (int perspective = 0; perspective < 2; perspective++) {
    flesh_camera camera = {.target = {0, 0, 0}, .height = 4, .field_of_view = perspective ? 40 : 0};
    flesh_view_fit fit;
    flesh_view view;
    uint32_t image[200 * 200];
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
      CHECK_OK(flesh_render(&view, 2, turned, &(flesh_render_style){.samples = 2}, image));
      uint32_t middle = image[48 * 80 + 40], above = image[34 * 80 + 40];
      uint32_t out = image[2 * 80 + 2];
      CHECK((middle >> 8 & 255) > 2 * (middle >> 16 & 255)); /* green */
      CHECK((above >> 16 & 255) > 2 * (above >> 8 & 255));   /* red */
      CHECK((out & 255) > 200 && (out >> 8 & 255) > 200);    /* the wall behind */
    }
  }
}

/* A body that has collapsed to a line or a point remains visible: about as long as it is, and thin. */
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
    uint32_t image[200 * 200];
    int drawn = 0;
    const flesh_render_surface surface = {
        .vertices = 3, .triangles = 1, .x = k ? point : line, .corners = corners, .plain = {0.5f, 0.1f, 0.1f}};
    CHECK_OK(flesh_render(&view, 1, &surface, &(flesh_render_style){.samples = 3}, image));
    for (int p = 0; p < 6400; p++) drawn += (image[p] >> 8 & 255) < 200;
    CHECK(k ? drawn >= 1 && drawn <= 4 : drawn >= 40 && drawn <= 120); /* 40 pixels along either axis */
  }
}

/* A small plate between the light and a large one casts a shadow on it. */
static void shadows_fall(void)
{
  flesh_camera camera = {.elevation = 90, .target = {0, 0, 0}, .height = 4};
  flesh_view_fit fit;
  flesh_view view;
  uint32_t with[60 * 60], without[60 * 60];
  flesh_view_fit_begin(&camera, 60, 60, &fit);
  flesh_view_fit_end(&fit, &camera, &view);
  static const double floor_x[12] = {-2, -2, 0, 2, -2, 0, 2, 2, 0, -2, 2, 0},
                      plate[12] = {-.5, -.5, .5, .5, -.5, .5, .5, .5, .5, -.5, .5, .5};
  static const int corners[6] = {0, 1, 2, 0, 2, 3};
  const flesh_render_surface surfaces[2] = {
      {.vertices = 4, .triangles = 2, .x = floor_x, .corners = corners, .plain = {0.5f, 0.5f, 0.5f}},
      {.vertices = 4, .triangles = 2, .x = plate, .corners = corners, .plain = {0.5f, 0.5f, 0.5f}}};
  CHECK_OK(flesh_render(&view, 2, surfaces, &(flesh_render_style){.samples = 1}, with));
  CHECK_OK(flesh_render(&view, 1, surfaces, &(flesh_render_style){.samples = 1}, without));
  int darker = 0, brighter = 0;
  for (int k = 0; k < 3600; k++) {
    int change = (int)(with[k] & 255) - (int)(without[k] & 255);
    darker += change < -25;
    brighter += change > 25;
  }
  CHECK(darker > 40 && darker < 1000 && !brighter);
}

/* A red glass plate before a green one hides it from its front, is transparent from behind, and also lets light
 * through. */
static void glass_is_seen_through_from_behind(void)
{
  flesh_camera camera = {.target = {0, 0, 0}, .height = 4};
  flesh_view_fit fit;
  flesh_view view;
  flesh_view_fit_begin(&camera, 60, 60, &fit);
  flesh_view_fit_end(&fit, &camera, &view); /* along +y */
  static const double far[12] = {-1, 1, -1, 1, 1, -1, 1, 1, 1, -1, 1, 1},
                      near[12] = {-9, -1, -9, 9, -1, -9, 9, -1, 9, -9, -1, 9};
  static const int front[6] = {0, 1, 2, 0, 2, 3}, back[6] = {0, 2, 1, 0, 3, 2};
  uint32_t seen[4];
  for (int k = 0; k < 4; k++) { /* none; opaque; of glass from its front; of glass from behind */
    uint32_t image[200 * 200];
    const flesh_render_surface surfaces[2] = {
        {.vertices = 4, .triangles = 2, .x = far, .corners = front, .plain = {0, 0.6f, 0}},
        {.vertices = 4, .triangles = 2, .x = near, .corners = k == 3 ? back : front, .glass = k > 1,
         .plain = {0.6f, 0, 0}}};
    CHECK_OK(flesh_render(&view, k ? 2 : 1, surfaces, &(flesh_render_style){.samples = 2}, image));
    seen[k] = image[30 * 60 + 30];
  }
  CHECK((seen[0] >> 8 & 255) > 100 && (seen[0] >> 16 & 255) < 80);
  for (int k = 1; k < 3; k++) CHECK((seen[k] >> 8 & 255) < 80 && (seen[k] >> 16 & 255) > 100);
  CHECK((seen[3] >> 8 & 255) > 0.8 * (seen[0] >> 8 & 255) && (seen[3] >> 16 & 255) > 40);
}

/* Colours without shading; light without shadows. */
static void flat_and_unshadowed(void)
{
  flesh_camera camera = {.elevation = 60, .target = {0, 0, 0}, .height = 4};
  flesh_view_fit fit;
  flesh_view view;
  flesh_view_fit_begin(&camera, 60, 60, &fit);
  flesh_view_fit_end(&fit, &camera, &view);
  static const double floor_x[12] = {-9, -9, 0, 9, -9, 0, 9, 9, 0, -9, 9, 0},
                      plate[12] = {-.5, -.5, .5, .5, -.5, .5, .5, .5, .5, -.5, .5, .5};
  static const int corners[6] = {0, 1, 2, 0, 2, 3};
  const float grey = (float)flesh_srgb_decode(128 / 255.);
  const flesh_render_surface surfaces[2] = {
      {.vertices = 4, .triangles = 2, .x = floor_x, .corners = corners, .plain = {grey, grey, grey}},
      {.vertices = 4, .triangles = 2, .x = plate, .corners = corners, .plain = {grey, grey, grey}}};
  int kinds[3] = {0};
  for (int k = 0; k < 3; k++) {
    uint32_t image[200 * 200];
    const flesh_render_style style = {.samples = 2, .flat = k == 1, .no_shadow = k == 2};
    CHECK_OK(flesh_render(&view, 2, surfaces, &style, image));
    uint32_t first = image[0];
    for (int p = 0; p < 3600; p++) {
      int change = (int)(image[p] & 255) - (int)(first & 255);
      kinds[k] += abs(change) > 20;
      if (k == 1) CHECK(image[p] == 0x808080);
    }
  }
  CHECK(kinds[0] > 50 && !kinds[1] && !kinds[2]);
}

/* The edge of a shadow on a floor that is far larger than the picture is as straight as the object that casts it: its
 * crossings with the picture's rows lie on a line to a fraction of a pixel. */
static void shadows_have_straight_edges(void)
{
  enum { SIZE = 200 };
  flesh_camera camera = {.elevation = 70, .target = {0, 0, 0}, .height = 2};
  flesh_view_fit fit;
  flesh_view view;
  uint32_t image[200 * 200];
  flesh_view_fit_begin(&camera, SIZE, SIZE, &fit);
  flesh_view_fit_end(&fit, &camera, &view);
  static const double floor_x[12] = {-30, -30, 0, 30, -30, 0, 30, 30, 0, -30, 30, 0},
                      plate[12] = {-8, -3, .3, -.5, -3, .3, .1, 3, .3, -8, 3, .3};
  static const int corners[6] = {0, 1, 2, 0, 2, 3};
  const flesh_render_surface surfaces[2] = {
      {.vertices = 4, .triangles = 2, .x = floor_x, .corners = corners, .plain = {0.5f, 0.5f, 0.5f}},
      {.vertices = 4, .triangles = 2, .x = plate, .corners = corners, .plain = {0.5f, 0.5f, 0.5f}}};
  CHECK_OK(flesh_render(&view, 2, surfaces, &(flesh_render_style){.samples = 3}, image));
  double at[SIZE], sums[5] = {0}, worst = 0;
  for (int y = 0; y < SIZE; y++) { /* from the right, where it is light, to the shadow */
    const uint32_t *row = image + (size_t)y * SIZE;
    int bright = (int)(row[SIZE - 1] & 255), x = SIZE - 1;
    while (x > 0 && (int)(row[x] & 255) > bright - 30) x--;
    const double right = row[x + 1] & 255, left = row[x] & 255;
    at[y] = x > 1 && right > left ? x + (bright - 30 - left) / (right - left) : NAN;
    if (isnan(at[y])) continue;
    sums[0]++, sums[1] += y, sums[2] += at[y], sums[3] += (double)y * y, sums[4] += y * at[y];
  }
  const double slope = (sums[0] * sums[4] - sums[1] * sums[2]) / (sums[0] * sums[3] - sums[1] * sums[1]);
  const double start = (sums[2] - slope * sums[1]) / sums[0];
  for (int y = 0; y < SIZE; y++)
    if (isfinite(at[y])) worst = fmax(worst, fabs(at[y] - start - slope * y));
  printf("# edge over %g rows, slope %.3g, off the line by %.3g pixels\n", sums[0], slope, worst);
  CHECK(sums[0] > 150 && worst < 0.3);
}

/* Across the edge of a shadow light rises from none to all without jumps, even if the map is coarse. */
static void light_rises_smoothly(void)
{
  flesh_camera camera = {.elevation = 70, .target = {0, 0, 0}, .height = 2};
  flesh_view_fit fit;
  flesh_view view;
  flesh_shadow shadow;
  static const double plate[12] = {-1, -1, .3, 1, -1.2, .3, 1, 1, .3, -1.1, 1, .3};
  static const int corners[6] = {0, 1, 2, 0, 2, 3};
  const flesh_render_surface surface = {.vertices = 4, .triangles = 2, .x = plate, .corners = corners};
  flesh_view_fit_begin(&camera, 100, 100, &fit);
  flesh_view_fit_end(&fit, &camera, &view);
  flesh_shadow_begin(&view, &shadow);
  flesh_view_fit window = flesh_view_fit_along(&shadow.view);
  for (int k = 0; k < 4; k++)
    flesh_view_fit_add(&window, 1, (const double[]){k & 1 ? 3 : -3, k & 2 ? 3 : -3, 0});
  CHECK_OK(flesh_shadow_cast(&shadow, &window, 64, 1, &surface));
  double before = -1, least = 1, most = 0, jump = 0;
  for (int k = 0; k <= 20000; k++) {
    const double p[3] = {-3 + 6 * k / 20000., 0.13, 0};
    double lit = flesh_shadow_lit(&shadow, p, shadow.view.back[2]);
    if (before >= 0) jump = fmax(jump, fabs(lit - before));
    before = lit;
    least = fmin(least, lit), most = fmax(most, lit);
  }
  printf("# least %g, most %g, largest jump %g\n", least, most, jump);
  CHECK(least == 0 && fabs(most - 1) < 1e-12 && jump < 0.02);
  flesh_raster_close(&shadow.map);
}

/* A box whose triangles are wound either way, around the body or beside it, and a post through a ring. */
static void obstacles_face_the_body(void)
{
  flesh_mesh *mesh = NULL;
  unsigned long long seed = 12;
  CHECK_OK(flesh_mesh_box((int[]){6, 6, 1}, (double[]){1, 1, 1}, (double[]){0, 0, 0}, &mesh));
  flesh_body body = {.mesh = mesh};
  const int nodes = flesh_mesh_node_count(mesh);
  double *x = malloc(sizeof *x * 3 * (size_t)nodes), box[24];
  for (int k = 0; k < 8; k++)
    for (int d = 0; d < 3; d++) box[3 * k + d] = k >> d & 1;
  static const int outward[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                   2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  for (int trial = 0; trial < 60; trial++) {
    int corners[36], inside = trial % 3 == 0;
    memcpy(corners, outward, sizeof corners);
    for (int t = 0; t < 12; t++)
      if (test_uniform(&seed) < 0.5) {
        int kept = corners[3 * t];
        corners[3 * t] = corners[3 * t + 1], corners[3 * t + 1] = kept;
      }
    for (int i = 0; i < nodes; i++) {
      const double *X = flesh_mesh_positions(mesh) + 3 * i;
      double *p = x + 3 * i, away = trial % 3 == 1 ? 1.7 : 0;
      for (int d = 0; d < 3; d++) p[d] = inside ? 0.1 + 0.8 * X[d] : X[d] + away;
      if (trial % 3 == 2) { /* a ring around the box */
        double angle = 2 * acos(-1) * X[0], radius = 2 + X[1];
        p[0] = 0.5 + radius * cos(angle), p[1] = 0.5 + radius * sin(angle), p[2] = X[2];
      }
    }
    CHECK_OK(flesh_picture_turn_to_body(&(flesh_picture_panel){.body = &body, .x = x}, box, 12, corners));
    int wrong = 0;
    for (int t = 0; t < 12; t++) {
      const double *a = box + 3 * corners[3 * t], *b = box + 3 * corners[3 * t + 1], *c = box + 3 * corners[3 * t + 2];
      double e[3], f[3], n[3], out = 0;
      for (int d = 0; d < 3; d++) e[d] = b[d] - a[d], f[d] = c[d] - a[d];
      flesh_vec3_cross(e, f, n);
      for (int d = 0; d < 3; d++) out += n[d] * ((a[d] + b[d] + c[d]) / 3 - 0.5);
      wrong += inside ? !(out < 0) : !(out > 0);
    }
    CHECK(!wrong);
  }
  free(x);
  flesh_mesh_destroy(&mesh);
}

/* Marks are few, round, inside the range and evenly spaced; both ends of fitted ranges are marked. */
static void marks_are_round(void)
{
  unsigned long long seed = 3;
  double ticks[FLESH_LEGEND_TICKS], low, high;
  int decimals, unmarked = 0;
  for (int trial = 0; trial < 2000; trial++) {
    const int fitted = trial & 1, room = 3 + trial % 7;
    const flesh_picture_field field = trial & 2 ? FLESH_PICTURE_J : FLESH_PICTURE_STRESS;
    double size = pow(10, 12 * test_uniform(&seed) - 6);
    double most = field == FLESH_PICTURE_J ? 1 + 0.1 * size : size;
    if (fitted) flesh_picture_range(field, 1 - 0.1 * size, most, &low, &high);
    else low = (test_uniform(&seed) - 0.5) * size, high = low + (0.01 + test_uniform(&seed)) * size;
    int count = flesh_picture_ticks(low, high, room, ticks, &decimals);
    CHECK(count >= 2 && count <= room);
    double step = ticks[1] - ticks[0], mantissa = step / pow(10, floor(log10(step) + 1e-9));
    int round = 0;
    for (int k = 0; k < 4; k++) round |= fabs(mantissa - (const double[]){1, 2, 2.5, 5}[k]) < 1e-5;
    for (int k = 0; k < count; k++) {
      CHECK(ticks[k] >= low - 1e-5 * step && ticks[k] <= high + 1e-5 * step);
      CHECK(!round || fabs(ticks[k] / step - nearbyint(ticks[k] / step)) < 1e-5);
      CHECK(ticks[k] != 0 || !signbit(ticks[k]));
    }
    CHECK(round || (count == 2 && ticks[0] == low && ticks[1] == high));
    const double off = fmax(fabs(ticks[0] - low), fabs(ticks[count - 1] - high));
    if (fitted && room >= 7) unmarked += off > 1e-5 * step;
  }
  CHECK(unmarked == 0);
  CHECK(flesh_picture_ticks(0.85, 1.15, 9, ticks, &decimals) == 7 && decimals == 2 && fabs(ticks[1] - 0.9) < 1e-12);
  CHECK(flesh_picture_ticks(0, 12, 9, ticks, &decimals) == 7 && decimals == 0 && ticks[6] == 12);
}

/* One node of 1331 that is pulled out is beyond the scale, which is reported. */
static void the_scale_tells_the_extremes(void)
{
  flesh_mesh *mesh = NULL;
  CHECK_OK(flesh_mesh_box((int[]){10, 10, 10}, (double[]){1, 1, 1}, (double[]){0, 0, 0}, &mesh));
  flesh_body body = {.mesh = mesh};
  const int nodes = flesh_mesh_node_count(mesh), tets = flesh_mesh_tet_count(mesh);
  double *x = malloc(sizeof *x * 3 * (size_t)nodes), *J = malloc(sizeof *J * (size_t)tets), least = INFINITY, most = 0;
  for (int d = 0; d < 3 * nodes; d++) x[d] = flesh_mesh_positions(mesh)[d] * 1.01;
  x[0] -= 5, x[1] -= 3;
  flesh_mesh_jacobians(mesh, x, J, NULL, NULL);
  for (int t = 0; t < tets; t++) least = fmin(least, J[t]), most = fmax(most, J[t]);
  flesh_picture_options options;
  flesh_picture_frame frame;
  flesh_picture_options_default(&options);
  options.width = 60;
  flesh_picture_panel panel = {.body = &body, .x = x};
  CHECK_OK(flesh_picture(in_work_folder("extremes.png"), 1, &panel, &options, &frame));
  CHECK(most > 5 && frame.most == most && frame.least == least && !frame.inverted == !(least <= 0));
  CHECK_NEAR(frame.high, 1.04, 1e-9); /* J of all others is 1.030 */
  free(x), free(J);
  flesh_mesh_destroy(&mesh);
}

/* A surface is dark if it is turned over or if tets are inverted. */
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
    uint32_t image[200 * 200];
    const flesh_render_surface surface = {.vertices = 3, .triangles = 1, .x = x, .corners = k == 1 ? turned : facing,
                                          .marked = k == 2 ? marked : NULL, .plain = {0.5f, 0.5f, 0.5f}};
    CHECK_OK(flesh_render(&view, 1, &surface, &(flesh_render_style){.samples = 1}, image));
    seen[k] = image[24 * 40 + 20] >> 8 & 255;
  }
  CHECK(seen[1] < 0.8 * seen[0] && seen[2] < 0.5 * seen[0]);
}

/* A block stretched along its axes: J is the product of the stretches; von Mises' stress follows from derivatives of
 * the energy density by the principal stretches: sigma_i = s_i/J d psi/d s_i. Ten-node tets also have fibres along x,
 * at their optimal stretch, which add peak/J. */
static void check_values(int order)
{
  flesh_mesh *mesh = NULL, *raised;
  flesh_material material;
  const double s[3] = {1.3, 0.9, 0.95}, J = 1.3 * 0.9 * 0.95, e = 1e-6;
  CHECK_OK(flesh_mesh_box((int[]){3, 2, 2}, (double[]){3, 1, 2}, (double[]){0, 0, 0}, &mesh));
  if (order == 2) {
    CHECK_OK(flesh_mesh_raise_order(mesh, &raised));
    flesh_mesh_destroy(&mesh);
    mesh = raised;
  }
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
  flesh_fibre fibre;
  flesh_effect *muscle;
  flesh_system *system;
  double *along = calloc(3 * (size_t)flesh_mesh_tet_count(mesh), sizeof *along);
  for (int t = 0; t < flesh_mesh_tet_count(mesh); t++) along[3 * t] = 1;
  CHECK_OK(flesh_fibre_default(FLESH_FIBRE_BLEMKER, 3e4, &fibre));
  fibre.optimal_stretch = s[0];
  CHECK_OK(flesh_effect_muscle(&body, flesh_mesh_tet_count(mesh), NULL, along, &fibre, NULL, &muscle));
  CHECK_OK(flesh_system_create(mesh, &system));
  CHECK_OK(flesh_system_add_effect(system, &muscle));
  sigma[0] += order == 2 ? 3e4 / J : 0;
  double mises = sqrt(0.5 * (pow(sigma[0] - sigma[1], 2) + pow(sigma[1] - sigma[2], 2) + pow(sigma[2] - sigma[0], 2)));
  const double expected[] = {[FLESH_PICTURE_J] = J, [FLESH_PICTURE_STRESS] = mises, [FLESH_PICTURE_SPEED] = 5};
  flesh_picture_panel panel = {.body = &body, .x = x, .v = v, .system = order == 2 ? system : NULL};
  for (flesh_picture_field field = FLESH_PICTURE_J; field <= FLESH_PICTURE_SPEED; field++) {
    double *values = NULL;
    CHECK_OK(flesh_picture_values(&panel, field, &values, NULL));
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
  options.field = FLESH_PICTURE_J; /* 1.1115: a scale of 0.85 to 1.15 */
  flesh_picture_fit_begin(&options, &fit);
  CHECK_OK(flesh_picture_fit_add(&fit, &panel));
  flesh_picture_fit_end(&fit, &frame);
  CHECK_NEAR(frame.low, 0.85, 1e-12);
  CHECK_NEAR(frame.high, 1.15, 1e-12);
  body.materials = NULL;
  double *none;
  CHECK(flesh_picture_values(&panel, FLESH_PICTURE_STRESS, &none, NULL) == FLESH_ERR_ARGUMENT && !none);
  CHECK_TEXT(flesh_error_text(), "no material");
  free(x), free(v), free(along);
  flesh_system_destroy(&system);
  flesh_mesh_destroy(&mesh);
}

static void values_are_those_of_the_motion(void)
{
  for (int order = 1; order <= 2; order++) check_values(order);
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
  options.width = 101; /* sizes are even nonetheless, as video encoders require */
  options.field = FLESH_PICTURE_PLAIN;
  const char *path = in_work_folder("two.png");
  CHECK_OK(flesh_picture(path, 2, panels, &options, NULL));
  size_t size;
  char *bytes = read_bytes(path, &size);
  CHECK(size > 500 && !memcmp(bytes, "\x89PNG\r\n\x1a\n", 8) && !memcmp(bytes + size - 8, "IEND", 4));
  CHECK(!(bytes[19] & 1) && !(bytes[23] & 1));
  free(bytes);
  CHECK(flesh_picture("/nowhere/at/all.png", 2, panels, &options, NULL) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "/nowhere/at/all.png: cannot be written");
  flesh_mesh_destroy(&mesh);
}

/* Coordinates that are not finite, a subtitle instead of a body, many panels. */
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
  CHECK_OK(flesh_picture(in_work_folder("odd.png"), 9, panels, &options, NULL));
  CHECK_OK(flesh_picture(in_work_folder("odd.png"), 2, panels, &options, NULL));
  CHECK_OK(flesh_picture(in_work_folder("odd.png"), 1, panels, &options, NULL));
  flesh_mesh_destroy(&mesh);
}

int main(int argc, char **argv)
{
  if (!make_work_folder()) return 1;
  return RUN_TESTS(argc, argv, TEST(everything_is_in_the_picture_and_fills_it), TEST(near_hides_far),
                   TEST(the_camera_stands_upright), TEST(glass_is_seen_through_from_behind), TEST(flat_and_unshadowed),
                   TEST(shadows_have_straight_edges), TEST(light_rises_smoothly), TEST(obstacles_face_the_body),
                   TEST(marks_are_round), TEST(the_scale_tells_the_extremes), TEST(lines_and_points_are_drawn),
                   TEST(shadows_fall), TEST(the_inside_is_darker), TEST(values_are_those_of_the_motion),
                   TEST(pictures_are_whole_files), TEST(broken_states_are_drawn));
}
