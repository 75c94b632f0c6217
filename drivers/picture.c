/* picture.c: panels side by side with their words and the scale of colours; text and PNG by cairo.
 */
#include "picture.h"

#include <cairo.h>
#include <fontconfig/fontconfig.h>
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "io/file.h"
#include "picture_body.h"

enum { MARGIN = 10, TITLE = 22, SUBTITLE = 18, BAR = 92 };

static const char *const field_names[] = {"none", "J", "stress", "speed"};
static const char *const field_labels[] = {"", "J", "σ", "|v| [m/s]"};

int flesh_picture_field_from_name(const char *name, flesh_picture_field *field)
{
  for (int k = FLESH_PICTURE_PLAIN; k <= FLESH_PICTURE_SPEED; k++)
    if (!strcmp(name, field_names[k])) {
      *field = (flesh_picture_field)k;
      return FLESH_OK;
    }
  return flesh_fail(FLESH_ERR_ARGUMENT, "'%s' is no field; it must be none, J, stress or speed",
                    name);
}

void flesh_picture_options_default(flesh_picture_options *options)
{
  *options = (flesh_picture_options){
      .field = FLESH_PICTURE_J,
      .low = NAN,
      .high = NAN,
      .camera = {.azimuth = 30, .elevation = 20, .target = {NAN, NAN, NAN}, .height = NAN, .field_of_view = 20},
      .width = 480,
      .samples = 3};
}

void flesh_picture_fit_begin(const flesh_picture_options *options, flesh_picture_fit *fit)
{
  *fit = (flesh_picture_fit){.options = options, .low = INFINITY, .high = -INFINITY};
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

static int compare_numbers(const void *a, const void *b)
{
  return (*(const double *)a > *(const double *)b) - (*(const double *)a < *(const double *)b);
}

/* All but a hundredth of the values at either end. */
static int add_values(flesh_picture_fit *fit, const flesh_picture_panel *panel)
{
  double *values;
  int nodes = flesh_mesh_node_count(panel->body->mesh), finite = 0;
  int status = flesh_picture_values(panel, fit->options->field, &values);
  if (status || !values) return status;
  for (int i = 0; i < nodes; i++)
    if (isfinite(values[i])) values[finite++] = values[i];
  qsort(values, (size_t)finite, sizeof *values, compare_numbers);
  if (finite) {
    fit->low = fmin(fit->low, values[finite / 100]);
    fit->high = fmax(fit->high, values[finite - 1 - finite / 100]);
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
  int nodes = flesh_mesh_node_count(panel->body->mesh), status = FLESH_OK;
  double size = size_of(nodes, panel->x);
  add_points(fit, nodes, panel->x);
  for (int k = 0; k < flesh_picture_obstacle_count(panel) && !status; k++) {
    int count, triangles, *corners;
    double *x;
    status = flesh_picture_obstacle(panel, k, NULL, &count, &x, &triangles, &corners);
    if (status) break;
    /* What is far larger than the body may reach out of the picture. */
    if (size_of(count, x) < 4 * size) add_points(fit, count, x);
    free(x);
    free(corners);
  }
  return status ? status : add_values(fit, panel);
}

/* The next number that reads well. */
static double round_up(double value)
{
  static const double steps[] = {1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10};
  double power = pow(10, floor(log10(value)));
  for (size_t k = 0; k < sizeof steps / sizeof *steps; k++)
    if (value <= 1.0000001 * steps[k] * power) return steps[k] * power;
  return 10 * power;
}

void flesh_picture_fit_end(flesh_picture_fit *fit, flesh_picture_frame *frame)
{
  const flesh_picture_options *options = fit->options;
  int best = 0;
  double shape = flesh_view_fit_shape(&fit->bodies[0]); /* width over height */
  for (int k = 1; k < fit->shapes; k++) /* not flatter than the bodies */
    if (fit->bodies[k - 1].view.height_px < fit->bodies[k].view.width_px / shape) best = k;
  flesh_view_fit_end(&fit->bodies[best], &options->camera, &frame->view);
  int any = fit->high >= fit->low;
  if (options->field == FLESH_PICTURE_J) {
    double reach = any ? fmax(1 - fit->low, fit->high - 1) : 0.5;
    reach = round_up(fmin(fmax(reach, 0.01), 0.5));
    frame->low = 1 - reach;
    frame->high = 1 + reach;
  } else {
    frame->low = 0;
    frame->high = any && fit->high > 0 ? round_up(fit->high) : 1;
  }
  if (!isnan(options->low)) frame->low = options->low;
  if (!isnan(options->high)) frame->high = options->high;
}

/* What cairo and fontconfig keep of the fonts, so that a search for leaks finds none. */
static void release_fonts(void)
{
  cairo_debug_reset_static_data();
  FcFini();
}

static void write_text(cairo_t *c, double x, double y, double align, double size, double grey,
                       const char *text)
{
  cairo_text_extents_t extents;
  cairo_select_font_face(c, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(c, size);
  cairo_text_extents(c, text, &extents);
  cairo_set_source_rgb(c, grey, grey, grey);
  cairo_move_to(c, x - align * extents.x_advance, y);
  cairo_show_text(c, text);
}

/* The scale of colours, with five marks. */
static void draw_bar(cairo_t *c, double x, double y, double height, flesh_picture_field field,
                     const flesh_picture_frame *frame)
{
  enum { MARKS = 4, WIDTH = 14 };
  static const char *const units[] = {"Pa", "kPa", "MPa", "GPa"};
  char label[32];
  int thousands = 0;
  if (field == FLESH_PICTURE_STRESS && frame->high >= 1e3)
    thousands = (int)fmin(3, floor(log10(frame->high) / 3));
  double unit = pow(1000, thousands);
  for (int k = 0; k < (int)height; k++) {
    double rgb[3];
    flesh_picture_colour(field, 1 - (k + 0.5) / height, rgb);
    cairo_set_source_rgb(c, rgb[0], rgb[1], rgb[2]);
    cairo_rectangle(c, x, y + k, WIDTH, 1);
    cairo_fill(c);
  }
  for (int k = 0; k <= MARKS; k++) {
    char text[32];
    double value = (frame->low + (frame->high - frame->low) * k / MARKS) / unit;
    snprintf(text, sizeof text, "%.4g", fabs(value) < 1e-12 * frame->high ? 0 : value);
    write_text(c, x + WIDTH + 6, y + height * (1 - (double)k / MARKS) + 4, 0, 11, 0.2, text);
  }
  snprintf(label, sizeof label, field == FLESH_PICTURE_STRESS ? "%s [%s]" : "%s", field_labels[field],
           units[thousands]);
  write_text(c, x, y - 12, 0, 12, 0.15, label);
}

static cairo_status_t write_bytes(void *stream, const unsigned char *data, unsigned length)
{
  return fwrite(data, 1, length, stream) == length ? CAIRO_STATUS_SUCCESS : CAIRO_STATUS_WRITE_ERROR;
}

static int write_png(const char *path, cairo_surface_t *picture)
{
  flesh_file file;
  int status = flesh_file_open(path, &file);
  if (status) return status;
  cairo_status_t written = cairo_surface_write_to_png_stream(picture, write_bytes, file.stream);
  if (!written) return flesh_file_commit(&file);
  flesh_file_abandon(&file);
  return flesh_fail(FLESH_ERR_FILE, "%s: could not be written completely: %s", path,
                    cairo_status_to_string(written));
}

/* Renders a panel and puts it at (x, y). */
static int draw_panel(cairo_t *c, double x, double y, const flesh_picture_panel *panel,
                      const flesh_picture_options *options, const flesh_picture_frame *frame)
{
  flesh_picture_scene scene;
  flesh_image image;
  int status = flesh_picture_scene_make(panel, options, frame, &scene);
  if (status) return status;
  status = flesh_render(&frame->view, scene.count, scene.surfaces, options->samples, &image);
  flesh_picture_scene_free(&scene);
  if (!status) {
    cairo_surface_t *pixels =
        cairo_image_surface_create_for_data((unsigned char *)image.pixels, CAIRO_FORMAT_RGB24,
                                            image.width, image.height, 4 * image.width);
    cairo_set_source_surface(c, pixels, x, y);
    cairo_paint(c);
    cairo_surface_destroy(pixels);
    flesh_image_free(&image);
  }
  if (panel->title)
    write_text(c, x + 0.5 * frame->view.width_px, y - (panel->subtitle && panel->x ? 26 : 9), 0.5, 14, 0.1,
               panel->title);
  if (panel->subtitle)
    write_text(c, x + 0.5 * frame->view.width_px, panel->x ? y - 9 : y + 0.5 * frame->view.height_px,
               0.5, 11.5, 0.35, panel->subtitle);
  return status;
}

int flesh_picture_draw(const char *path, int count, const flesh_picture_panel *panels,
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
  int total_width = columns * (width + MARGIN) + MARGIN + bar * BAR, total_height = rows * (height + top) + MARGIN;
  total_width += total_width & 1; /* films want even sizes */
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
  if (bar) {
    double length = floor(fmin(0.7 * height, 300));
    draw_bar(c, total_width - BAR + 16, floor(top + 0.5 * (height - length) + 8), length, options->field, frame);
  }
  if (!status && (cairo_status(c) || cairo_surface_status(picture)))
    status = flesh_fail(FLESH_ERR_MEMORY, "%s: a picture of %d x %d pixels: %s", path, total_width,
                        total_height, cairo_status_to_string(cairo_status(c)));
  cairo_destroy(c);
  if (!status) status = write_png(path, picture);
  cairo_surface_destroy(picture);
  return status;
}

int flesh_picture(const char *path, int count, const flesh_picture_panel *panels,
                  const flesh_picture_options *options)
{
  flesh_picture_fit fit;
  flesh_picture_frame frame;
  int status = FLESH_OK;
  flesh_picture_fit_begin(options, &fit);
  for (int p = 0; p < count && !status; p++) status = flesh_picture_fit_add(&fit, &panels[p]);
  if (status) return status;
  flesh_picture_fit_end(&fit, &frame);
  return flesh_picture_draw(path, count, panels, options, &frame);
}
