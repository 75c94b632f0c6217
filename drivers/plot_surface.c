/* plot_surface.c: shaded pictures of deformed bodies.
 *
 * Projection, depth order, colour and shade are computed here; gnuplot fills the triangles (in a
 * flat map view, each as a quadrilateral with a doubled corner, whose colours it takes from the
 * data) and sets the text. */
#include "plot.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "plot_text.h"

enum { TITLE_HEIGHT = 56, BAR_WIDTH = 120, MARGIN = 12 };

typedef struct colour {
  double at; /* 0: low, 0.5: value 1, 1: high */
  int rgb[3];
} colour;

static const colour palette[] = {{0, {38, 54, 140}},
                                 {0.25, {104, 154, 208}},
                                 {0.5, {236, 231, 222}},
                                 {0.75, {230, 152, 98}},
                                 {1, {160, 34, 44}}};
enum { PALETTE_SIZE = sizeof palette / sizeof palette[0] };
static const int inverted_rgb[3] = {46, 10, 62}, plain_rgb[3] = {222, 190, 170};

typedef struct camera {
  double right[3], up[3], forward[3], light[3];
} camera;

typedef struct triangle {
  double p[3][2], depth;
  unsigned rgb;
} triangle;

void flesh_plot_surface_options_default(flesh_plot_surface_options *options)
{
  *options = (flesh_plot_surface_options){.azimuth = 30,
                                          .elevation = 20,
                                          .low = 0.5,
                                          .high = 1.5,
                                          .label = "J",
                                          .panel_width = 480,
                                          .edges = 1};
}

static camera camera_at(double azimuth, double elevation)
{
  const double degree = acos(-1) / 180;
  double ca = cos(azimuth * degree), sa = sin(azimuth * degree);
  double ce = cos(elevation * degree), se = sin(elevation * degree);
  camera c = {
      .right = {ca, sa, 0}, .up = {-sa * se, ca * se, ce}, .forward = {-sa * ce, ca * ce, -se}};
  double length = 0;
  for (int k = 0; k < 3; k++) {
    c.light[k] = -c.forward[k] + 0.7 * c.up[k] - 0.5 * c.right[k]; /* over the left shoulder */
    length += c.light[k] * c.light[k];
  }
  for (int k = 0; k < 3; k++) c.light[k] /= sqrt(length);
  return c;
}

static double dot(const double a[3], const double b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void value_rgb(double value, const flesh_plot_surface_options *options, double rgb[3])
{
  double at = value < 1 ? 0.5 * (value - options->low) / (1 - options->low)
                        : 0.5 + 0.5 * (value - 1) / (options->high - 1);
  at = fmin(fmax(at, 0), 1);
  int k = 0;
  while (k < PALETTE_SIZE - 2 && palette[k + 1].at < at) k++;
  double part = (at - palette[k].at) / (palette[k + 1].at - palette[k].at);
  for (int c = 0; c < 3; c++)
    rgb[c] = value > 0 ? palette[k].rgb[c] + part * (palette[k + 1].rgb[c] - palette[k].rgb[c])
                       : inverted_rgb[c];
}

static int compare_key(const void *a, const void *b)
{
  const int *p = a, *q = b;
  for (int k = 0; k < 3; k++)
    if (p[k] != q[k]) return p[k] < q[k] ? -1 : 1;
  return 0;
}

static void sort_three(int *n)
{
  for (int pass = 0; pass < 2; pass++)
    for (int k = 0; k < 2; k++)
      if (n[k] > n[k + 1]) {
        int other = n[k];
        n[k] = n[k + 1];
        n[k + 1] = other;
      }
}

/* The tet behind every surface triangle. Returns new [triangles]. */
static int *tets_of_surface(const flesh_mesh *mesh, const int *surface, int triangles)
{
  int(*keys)[4] = malloc(sizeof *keys * (size_t)(triangles + 1));
  int *tet_of = malloc(sizeof *tet_of * (size_t)(triangles + 1));
  if (!keys || !tet_of) {
    free(keys);
    free(tet_of);
    return NULL;
  }
  for (int s = 0; s < triangles; s++) {
    memcpy(keys[s], surface + 3 * s, 3 * sizeof(int));
    sort_three(keys[s]);
    keys[s][3] = s;
  }
  qsort(keys, (size_t)triangles, sizeof *keys, compare_key);
  const int *tets = flesh_mesh_tets(mesh);
  for (int t = 0; t < flesh_mesh_tet_count(mesh); t++)
    for (int skipped = 0; skipped < 4; skipped++) {
      int face[4] = {0}, n = 0;
      for (int k = 0; k < 4; k++)
        if (k != skipped) face[n++] = tets[4 * t + k];
      sort_three(face);
      int(*found)[4] = bsearch(face, keys, (size_t)triangles, sizeof *keys, compare_key);
      if (found) tet_of[(*found)[3]] = t;
    }
  free(keys);
  return tet_of;
}

static int compare_depth(const void *a, const void *b)
{
  double p = ((const triangle *)a)->depth, q = ((const triangle *)b)->depth;
  return (p < q) - (p > q); /* far ones first */
}

static unsigned shaded(const double rgb[3], double light)
{
  unsigned packed = 0;
  for (int c = 0; c < 3; c++) packed = packed << 8 | (unsigned)fmin(255, rgb[c] * light + 0.5);
  return packed;
}

/* Projects, colours and sorts a panel's surface. Returns new *triangles, *count of them. */
static int project(const flesh_plot_panel *panel, const camera *camera,
                   const flesh_plot_surface_options *options, int *count, triangle **triangles)
{
  int all;
  const int *surface = flesh_mesh_surface(panel->mesh, &all);
  int *tet_of = tets_of_surface(panel->mesh, surface, all);
  triangle *made = malloc(sizeof *made * (size_t)(all + 1));
  *count = 0;
  *triangles = made;
  if (!tet_of || !made) {
    free(tet_of);
    free(made);
    *triangles = NULL;
    return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a picture");
  }
  for (int s = 0; s < all; s++) {
    triangle *t = &made[*count];
    const double *p[3];
    double e[2][3], normal[3], rgb[3] = {plain_rgb[0], plain_rgb[1], plain_rgb[2]};
    t->depth = 0;
    for (int k = 0; k < 3; k++) {
      p[k] = panel->x + 3 * surface[3 * s + k];
      t->p[k][0] = dot(p[k], camera->right);
      t->p[k][1] = dot(p[k], camera->up);
      t->depth += dot(p[k], camera->forward) / 3;
    }
    if (!isfinite(t->depth)) continue;
    for (int k = 0; k < 3; k++) e[0][k] = p[1][k] - p[0][k], e[1][k] = p[2][k] - p[0][k];
    for (int k = 0; k < 3; k++)
      normal[k] = e[0][(k + 1) % 3] * e[1][(k + 2) % 3] - e[0][(k + 2) % 3] * e[1][(k + 1) % 3];
    double length = sqrt(dot(normal, normal)),
           facing = length > 0 ? dot(normal, camera->light) / length : 0;
    /* The inside, which shows where the surface is turned over, is darker. */
    double light = dot(normal, camera->forward) < 0 ? 0.68 + 0.38 * fmax(facing, 0) : 0.45;
    if (panel->value) value_rgb(panel->value[tet_of[s]], options, rgb);
    t->rgb = shaded(rgb, light);
    (*count)++;
  }
  free(tet_of);
  qsort(made, (size_t)*count, sizeof *made, compare_depth);
  return FLESH_OK;
}

static void write_triangles(FILE *stream, int count, const triangle *triangles)
{
  for (int s = 0; s < count; s++) {
    const triangle *t = &triangles[s];
    fprintf(stream, "%.6g %.6g 0 %u\n%.6g %.6g 0 %u\n\n%.6g %.6g 0 %u\n%.6g %.6g 0 %u\n\n\n",
            t->p[0][0], t->p[0][1], t->rgb, t->p[0][0], t->p[0][1], t->rgb, t->p[1][0], t->p[1][1],
            t->rgb, t->p[2][0], t->p[2][1], t->rgb);
  }
}

static void grow_window(double window[4], int count, const triangle *triangles)
{
  for (int s = 0; s < count; s++)
    for (int k = 0; k < 3; k++) {
      const double *p = triangles[s].p[k];
      window[0] = fmin(window[0], p[0]), window[1] = fmax(window[1], p[0]);
      window[2] = fmin(window[2], p[1]), window[3] = fmax(window[3], p[1]);
    }
}

/* Widens the window by a margin, then to the panel's shape, so that both axes have one scale. */
static void fit_window(double window[4], double margin, int width, int *height)
{
  double w = (window[1] - window[0]) * (1 + margin), h = (window[3] - window[2]) * (1 + margin);
  if (!(w > 0)) w = 1e-9;
  if (!(h > 0)) h = 1e-9;
  if (!*height) *height = (int)(width * fmin(fmax(h / w, 0.4), 1.5));
  double ratio = (double)*height / width;
  if (h / w < ratio) h = w * ratio;
  else w = h / ratio;
  double x = 0.5 * (window[0] + window[1]), y = 0.5 * (window[2] + window[3]);
  window[0] = x - 0.5 * w, window[1] = x + 0.5 * w;
  window[2] = y - 0.5 * h, window[3] = y + 0.5 * h;
}

typedef struct layout {
  int count, columns, rows, width, height; /* of a panel, in pixels */
  int total_width, total_height, bar;
  double window[4];
} layout;

static void write_label(FILE *stream, int tag, const char *text, double x, double y,
                        const char *style)
{
  fprintf(stream, "set label %d ", tag);
  flesh_plot_quote(stream, text);
  fprintf(stream, " at screen %.5f,%.5f %s noenhanced\n", x, y, style);
}

static void write_palette(FILE *stream, const flesh_plot_surface_options *options)
{
  fprintf(stream, "set cbrange [%g:%g]\nset palette defined (", options->low, options->high);
  for (int k = 0; k < PALETTE_SIZE; k++) {
    double at = palette[k].at, value = at < 0.5 ? options->low + 2 * at * (1 - options->low)
                                                : 1 + (2 * at - 1) * (options->high - 1);
    fprintf(stream, "%s%g '#%02x%02x%02x'", k ? ", " : "", value, palette[k].rgb[0],
            palette[k].rgb[1], palette[k].rgb[2]);
  }
  fprintf(stream, ")\nset cbtics (%g, %g, 1, %g, %g) out nomirror textcolor rgb '#303030'\n",
          options->low, 0.5 * (options->low + 1), 0.5 * (1 + options->high), options->high);
}

static void write_script(FILE *stream, const char *name, const layout *l,
                         const flesh_plot_panel *panels, const int *counts,
                         const flesh_plot_surface_options *options)
{
  double W = l->total_width, H = l->total_height;
  flesh_plot_begin(stream, name, l->total_width, l->total_height);
  fputs("set multiplot\nset view map\nunset border\nunset tics\nunset key\nunset colorbox\n",
        stream);
  fprintf(stream, "set pm3d border lc rgb '%s' lw 0.4\n",
          options->edges ? "#b8202020" : "#f0808080");
  fprintf(stream, "set xrange [%.9g:%.9g]\nset yrange [%.9g:%.9g]\n", l->window[0], l->window[1],
          l->window[2], l->window[3]);
  write_palette(stream, options);
  int first = 0;
  for (int p = 0; p < l->count; p++) {
    int column = p % l->columns, row = p / l->columns;
    double left = MARGIN + column * (l->width + MARGIN);
    double top = H - row * (l->height + TITLE_HEIGHT) - TITLE_HEIGHT;
    double centre = (left + 0.5 * l->width) / W;
    fprintf(stream, "set lmargin at screen %.5f\nset rmargin at screen %.5f\n", left / W,
            (left + l->width) / W);
    fprintf(stream, "set tmargin at screen %.5f\nset bmargin at screen %.5f\n", top / H,
            (top - l->height) / H);
    write_label(stream, 1, panels[p].title ? panels[p].title : "", centre, (top + 36) / H,
                "center font ',13' textcolor rgb '#202020'");
    write_label(stream, 2, panels[p].subtitle ? panels[p].subtitle : "", centre,
                (panels[p].x ? top + 16 : top - 0.5 * l->height) / H,
                "center font ',10' textcolor rgb '#606060'");
    if (counts[p]) {
      fputs("splot ", stream);
      flesh_plot_quote(stream, name);
      fprintf(stream, ".'.dat' index %d:%d using 1:2:3:4 with pm3d fillcolor rgb variable\n",
              first, first + counts[p] - 1);
    } else fputs("splot '+' using (NaN):(NaN):(NaN) with points\n", stream);
    first += counts[p];
  }
  if (l->bar) {
    double bottom = (l->rows - 1) * (l->height + TITLE_HEIGHT) + MARGIN + 0.15 * l->height;
    fprintf(stream,
            "unset label\nset colorbox user origin screen %.5f,%.5f size screen %.5f,%.5f\n",
            (W - BAR_WIDTH + 20) / W, bottom / H, 14 / W, 0.7 * l->height / H);
    write_label(stream, 1, options->label ? options->label : "", (W - BAR_WIDTH + 27) / W,
                (bottom + 0.7 * l->height + 16) / H, "center textcolor rgb '#202020'");
    fputs("splot '+' using (NaN):(NaN):(NaN):(NaN) with points palette\n", stream);
  }
  fputs("unset multiplot\n", stream);
}

static int draw(const char *folder, const char *name, layout *l, const flesh_plot_panel *panels,
                const flesh_plot_surface_options *options, int *counts)
{
  flesh_file data, script;
  int status = flesh_plot_open(folder, name, ".dat", &data);
  if (status) return status;
  camera camera = camera_at(options->azimuth, options->elevation);
  double window[4] = {INFINITY, -INFINITY, INFINITY, -INFINITY};
  for (int p = 0; p < l->count && !status; p++) {
    triangle *triangles = NULL;
    counts[p] = 0;
    if (!panels[p].x) continue;
    l->bar |= panels[p].value != NULL;
    status = project(&panels[p], &camera, options, &counts[p], &triangles);
    write_triangles(data.stream, counts[p], triangles);
    grow_window(window, counts[p], triangles);
    free(triangles);
  }
  if (status) {
    flesh_file_abandon(&data);
    return status;
  }
  status = flesh_file_commit(&data);
  if (status) return status;
  int given = options->window[1] > options->window[0];
  if (given) memcpy(window, options->window, sizeof window);
  else if (!(window[1] >= window[0])) window[0] = window[2] = 0, window[1] = window[3] = 1;
  memcpy(l->window, window, sizeof window);
  fit_window(l->window, given ? 0 : 0.06, l->width, &l->height);
  l->total_width = l->columns * (l->width + MARGIN) + MARGIN + (l->bar ? BAR_WIDTH : 0);
  l->total_height = l->rows * (l->height + TITLE_HEIGHT) + MARGIN;
  status = flesh_plot_open(folder, name, ".gp", &script);
  if (status) return status;
  write_script(script.stream, name, l, panels, counts, options);
  status = flesh_file_commit(&script);
  return status ? status : flesh_plot_draw(folder, name);
}

int flesh_plot_surface(const char *folder, const char *name, int count,
                       const flesh_plot_panel *panels, const flesh_plot_surface_options *options)
{
  if (count < 1 || !(options->low < 1) || !(options->high > 1) || options->panel_width < 32)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "a picture needs a panel of 32 pixels and colours around 1");
  layout l = {.count = count, .width = options->panel_width, .height = options->panel_height};
  l.columns = options->columns > 0 ? options->columns : count <= 4 ? count : (int)ceil(sqrt(count));
  if (l.columns > count) l.columns = count;
  l.rows = (count + l.columns - 1) / l.columns;
  int *counts = calloc((size_t)count, sizeof *counts);
  if (!counts) return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a picture");
  int status = draw(folder, name, &l, panels, options, counts);
  free(counts);
  return status;
}
