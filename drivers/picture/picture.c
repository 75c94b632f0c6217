/* picture.c: draws panels side by side with their titles and the scale of colours; text and PNG by cairo.
 */
#include "picture/picture.h"

#include <fontconfig/fontconfig.h>
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/file.h"
#include "base/sort.h"
#include "picture/picture_body.h"
#include "picture/picture_legend.h"

enum { MARGIN = 10, TITLE = 22, SUBTITLE = 18 };

void flesh_picture_options_default(flesh_picture_options *options)
{
  *options = (flesh_picture_options){
      .field = FLESH_PICTURE_J,
      .low = NAN,
      .high = NAN,
      .camera = {.up = {0, 0, 1},
                 .azimuth = 30,
                 .elevation = 20,
                 .target = {NAN, NAN, NAN},
                 .height = NAN,
                 .field_of_view = 20},
      .width = 480,
      .style = {.samples = 3}};
}

void flesh_picture_fit_begin(const flesh_picture_options *options, flesh_picture_fit *fit)
{
  *fit = (flesh_picture_fit){
      .options = options, .frame = {.low = INFINITY, .high = -INFINITY, .least = NAN, .most = NAN}};
  fit->shapes = options->height ? 1 : FLESH_PICTURE_SHAPES;
  for (int k = 0; k < fit->shapes; k++) {
    int height = options->height ? options->height : (int)(options->width * (0.4 + 0.08 * k));
    flesh_view_fit_begin(&options->camera, options->width, height, &fit->bodies[k]);
  }
}

static void add_points(flesh_picture_fit *fit, int count, const double *points)
{
  for (int k = 0; k < fit->shapes; k++) flesh_view_fit_add(&fit->bodies[k], count, points);
}

/* Adds the panel's values: their extremes, and a range without 1 % of them at either end. */
static int add_values(flesh_picture_fit *fit, const flesh_picture_panel *panel)
{
  double *values, extremes[2];
  int nodes = flesh_mesh_node_count(panel->body->mesh), finite = 0;
  int status = flesh_picture_values(panel, fit->options->field, &values, extremes);
  if (status || !values) return status;
  fit->frame.inverted |= flesh_picture_is_inverted(panel);
  fit->frame.least = fmin(fit->frame.least, extremes[0]);
  fit->frame.most = fmax(fit->frame.most, extremes[1]);
  for (int i = 0; i < nodes; i++)
    if (isfinite(values[i])) values[finite++] = values[i];
  qsort(values, (size_t)finite, sizeof *values, flesh_compare_double);
  if (finite) {
    fit->frame.low = fmin(fit->frame.low, values[finite / 100]);
    fit->frame.high = fmax(fit->frame.high, values[finite - 1 - finite / 100]);
  }
  free(values);
  return FLESH_OK;
}

static double size_of(int count, const double *x)
{
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, size = 0;
  for (int d = 0; d < 3 * count; d++) {
    low[d % 3] = fmin(low[d % 3], x[d]);
    high[d % 3] = fmax(high[d % 3], x[d]);
  }
  for (int d = 0; d < 3 && count; d++) size = fmax(size, high[d] - low[d]);
  return size;
}

int flesh_picture_fit_add(flesh_picture_fit *fit, const flesh_picture_panel *panel)
{
  if (!panel->x) return FLESH_OK;
  const int nodes = flesh_mesh_node_count(panel->body->mesh);
  const double size = size_of(nodes, panel->x);
  flesh_picture_scene obstacles;
  add_points(fit, nodes, panel->x);
  const int status = flesh_picture_obstacles(panel, NULL, &obstacles);
  for (int k = 1; k < obstacles.count && !status; k++) {
    const flesh_render_surface *s = &obstacles.surfaces[k];
    /* A surface that is far larger than the body may extend beyond the picture. */
    if (size_of(s->vertices, s->x) < 4 * size) add_points(fit, s->vertices, s->x);
  }
  flesh_arena_free(&obstacles.arena);
  return status ? status : add_values(fit, panel);
}

void flesh_picture_fit_end(flesh_picture_fit *fit, flesh_picture_frame *frame)
{
  const flesh_picture_options *options = fit->options;
  int best = 0;
  double shape = flesh_view_fit_shape(&fit->bodies[0]); /* width over height */
  for (int k = 1; k < fit->shapes; k++) /* the flattest that is not flatter than the bodies */
    if (fit->bodies[k - 1].view.height_px < fit->bodies[k].view.width_px / shape) best = k;
  *frame = fit->frame;
  flesh_view_fit_end(&fit->bodies[best], &options->camera, &frame->view);
  flesh_picture_range(options->field, fit->frame.low, fit->frame.high, &frame->low, &frame->high);
  if (!isnan(options->low)) frame->low = options->low;
  if (!isnan(options->high)) frame->high = options->high;
}

/* Frees the caches of cairo and fontconfig, so that they are not reported as leaks. */
static void release_fonts(void)
{
  cairo_debug_reset_static_data();
  FcFini();
}

/* Writes text above a panel: smaller, and then cut, if the panel is too narrow. */
static void write_heading(cairo_t *c, double x, double y, double size, double grey, int width, const char *text)
{
  enum { LEAST = 8, ROOM = 256 };
  char shown[ROOM + 8];
  size_t length = strlen(text);
  if (length > ROOM) length = ROOM;
  snprintf(shown, sizeof shown, "%.*s", (int)length, text);
  while (size > LEAST && flesh_picture_text_width(c, size, shown) > width) size -= 0.5;
  while (length > 1 && flesh_picture_text_width(c, size, shown) > width) {
    do length--;
    while (length > 1 && ((unsigned char)text[length] & 0xC0) == 0x80); /* whole characters */
    snprintf(shown, sizeof shown, "%.*s…", (int)length, text);
  }
  flesh_picture_text(c, x, y, 0.5, size, grey, shown);
}

static cairo_status_t write_bytes(void *stream, const unsigned char *data, unsigned length)
{
  return fwrite(data, 1, length, stream) == length ? CAIRO_STATUS_SUCCESS : CAIRO_STATUS_WRITE_ERROR;
}

/* Renders a panel and draws it at (x, y). */
static int draw_panel(cairo_t *c, double x, double y, const flesh_picture_panel *panel,
                      const flesh_picture_options *options, const flesh_picture_frame *frame)
{
  const int width = frame->view.width_px;
  flesh_picture_scene scene;
  int status = flesh_picture_scene_make(panel, options, frame, &scene);
  if (status) return status;
  cairo_surface_t *image = cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, frame->view.height_px);
  uint32_t *pixels = (uint32_t *)(void *)cairo_image_surface_get_data(image); /* without gaps between rows */
  status = pixels ? flesh_render(&frame->view, scene.count, scene.surfaces, &options->style, pixels)
                  : flesh_picture_no_memory();
  flesh_arena_free(&scene.arena);
  cairo_surface_mark_dirty(image);
  cairo_set_source_surface(c, image, x, y);
  cairo_paint(c);
  cairo_surface_destroy(image);
  const double middle = x + 0.5 * width;
  if (panel->title)
    write_heading(c, middle, y - (panel->subtitle && panel->x ? 26 : 9), 14, 0.1, width, panel->title);
  if (panel->subtitle)
    write_heading(c, middle, panel->x ? y - 9 : y + 0.5 * frame->view.height_px, 11.5, 0.35, width, panel->subtitle);
  return status;
}

int flesh_picture_print(FILE *stream, int count, const flesh_picture_panel *panels,
                        const flesh_picture_options *options, const flesh_picture_frame *frame)
{
  int columns = options->columns > 0 ? options->columns : count <= 4 ? count : (int)ceil(sqrt(count));
  if (columns > count) columns = count;
  int rows = (count + columns - 1) / columns, bar = options->field != FLESH_PICTURE_PLAIN;
  int titles = 0, subtitles = 0;
  for (int p = 0; p < count; p++) {
    titles |= panels[p].title != NULL;
    subtitles |= panels[p].subtitle != NULL;
  }
  int width = frame->view.width_px, height = frame->view.height_px;
  int top = MARGIN + titles * TITLE + subtitles * SUBTITLE;
  int total_width = columns * (width + MARGIN) + MARGIN + bar * FLESH_LEGEND_WIDTH;
  int total_height = rows * (height + top) + MARGIN;
  if (bar && total_height < FLESH_LEGEND_HEIGHT) total_height = FLESH_LEGEND_HEIGHT;
  total_width += total_width & 1; /* videos need even sizes */
  total_height += total_height & 1;
  static atomic_flag registered = ATOMIC_FLAG_INIT;
  if (!atomic_flag_test_and_set(&registered)) atexit(release_fonts);
  cairo_surface_t *picture = cairo_image_surface_create(CAIRO_FORMAT_RGB24, total_width, total_height);
  cairo_t *c = cairo_create(picture);
  cairo_set_source_rgb(c, 1, 1, 1);
  cairo_paint(c);
  int status = FLESH_OK;
  for (int p = 0; p < count && !status; p++)
    status = draw_panel(c, MARGIN + p % columns * (width + MARGIN), top + p / columns * (height + top),
                        &panels[p], options, frame);
  if (bar)
    flesh_picture_legend(c, total_width - FLESH_LEGEND_WIDTH,
                         rows > 1 ? fmax(top + 0.5 * height, 0.5 * FLESH_LEGEND_HEIGHT) : 0.5 * total_height,
                         fmax(height, FLESH_LEGEND_HEIGHT), options->field, frame);
  if (!status && (cairo_status(c) || cairo_surface_status(picture)))
    status = flesh_fail(FLESH_ERR_MEMORY, "a picture of %d x %d pixels: %s", total_width, total_height,
                        cairo_status_to_string(cairo_status(c)));
  cairo_destroy(c);
  const cairo_status_t written =
      status ? CAIRO_STATUS_SUCCESS : cairo_surface_write_to_png_stream(picture, write_bytes, stream);
  if (written)
    status = flesh_fail(FLESH_ERR_FILE, "could not be written completely: %s", cairo_status_to_string(written));
  cairo_surface_destroy(picture);
  return status;
}

int flesh_picture_draw(const char *path, int count, const flesh_picture_panel *panels,
                       const flesh_picture_options *options, const flesh_picture_frame *frame)
{
  flesh_file file;
  int status = flesh_file_open(path, &file);
  if (status) return status;
  status = flesh_picture_print(file.stream, count, panels, options, frame);
  if (!status) return flesh_file_commit(&file);
  flesh_file_abandon(&file);
  return flesh_fail_within(status, "%s: ", path);
}

int flesh_picture(const char *path, int count, const flesh_picture_panel *panels,
                  const flesh_picture_options *options, flesh_picture_frame *frame)
{
  flesh_picture_fit fit;
  flesh_picture_frame own;
  if (!frame) frame = &own;
  int status = FLESH_OK;
  flesh_picture_fit_begin(options, &fit);
  for (int p = 0; p < count && !status; p++) status = flesh_picture_fit_add(&fit, &panels[p]);
  if (status) return status;
  flesh_picture_fit_end(&fit, frame);
  return flesh_picture_draw(path, count, panels, options, frame);
}
