/* render.c: a depth buffer that keeps which triangle is seen where, a shadow map by the same means,
 * and the shading of what is seen. */
#include "render.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "math/mat3.h"

/* A projected corner: pixels from the upper left, 1 over the depth (1 for parallel rays). */
typedef struct projected {
  double x, y, w;
  double depth; /* grows away from the eye; linear in the picture */
} projected;

/* Depth and triangle of every sample; triangles of all surfaces are numbered through. */
typedef struct buffer {
  int width, height;
  float *depth;
  int *triangle;
} buffer;

typedef struct scene {
  int count, total;
  const flesh_render_surface *surfaces;
  int *first;               /* [count+1] number of each surface's first triangle */
  float (*normals)[3];      /* [3*total] of every corner */
  projected *eye, *sun;     /* [3*total] corners as the camera and the light see them */
  flesh_view view, sun_view;
  buffer seen, lit;
} scene;

static void normalise(double a[3])
{
  double length = sqrt(flesh_vec3_dot(a, a));
  for (int d = 0; d < 3; d++) a[d] = length > 0 ? a[d] / length : 0;
}

double flesh_srgb_decode(double encoded)
{
  return encoded <= 0.04045 ? encoded / 12.92 : pow((encoded + 0.055) / 1.055, 2.4);
}

double flesh_srgb_encode(double linear)
{
  if (!(linear > 0)) return 0;
  if (linear >= 1) return 1;
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * pow(linear, 1 / 2.4) - 0.055;
}

static projected project(const flesh_view *view, const double p[3])
{
  double q[3] = {p[0] - view->target[0], p[1] - view->target[1], p[2] - view->target[2]};
  double scale = view->height_px / view->height, away = -flesh_vec3_dot(q, view->back);
  projected r = {.w = 1, .depth = away};
  if (view->distance > 0) {
    double z = view->distance + away;
    r.w = z > 1e-3 * view->distance ? view->distance / z : NAN; /* behind the eye: not drawn */
    r.depth = -r.w;
  }
  r.x = 0.5 * view->width_px + scale * r.w * flesh_vec3_dot(q, view->right);
  r.y = 0.5 * view->height_px - scale * r.w * flesh_vec3_dot(q, view->up);
  return r;
}

/* Twice a triangle's area in the picture, positive when it is seen from behind, as y points down. */
static double area_of(const projected c[3])
{
  return (c[1].x - c[0].x) * (c[2].y - c[0].y) - (c[1].y - c[0].y) * (c[2].x - c[0].x);
}

/* Barycentric weights of (x, y) in the picture of a triangle; 0 when it is seen edge on. */
static int weights_at(const projected c[3], double x, double y, double b[3])
{
  const double area = area_of(c);
  if (!(fabs(area) > 1e-12)) return 0;
  b[1] = ((x - c[0].x) * (c[2].y - c[0].y) - (y - c[0].y) * (c[2].x - c[0].x)) / area;
  b[2] = ((c[1].x - c[0].x) * (y - c[0].y) - (c[1].y - c[0].y) * (x - c[0].x)) / area;
  b[0] = 1 - b[1] - b[2];
  return 1;
}

static void put(buffer *target, int x, int y, float depth, int number)
{
  if (x < 0 || y < 0 || x >= target->width || y >= target->height) return;
  const size_t at = (size_t)y * (size_t)target->width + (size_t)x;
  if (depth >= target->depth[at]) return;
  target->depth[at] = depth;
  target->triangle[at] = number;
}

/* A triangle that is but a line or a point, as those of collapsed bodies: its edges, three samples wide. */
static void draw_edges(buffer *target, const projected c[3], int number)
{
  for (int k = 0; k < 3; k++) {
    const projected *p = &c[k], *q = &c[(k + 1) % 3];
    const double length = fmin(hypot(q->x - p->x, q->y - p->y), 4.0 * (target->width + target->height));
    const int steps = 1 + (int)length;
    for (int i = 0; i <= steps; i++) {
      const double part = (double)i / steps, x = p->x + part * (q->x - p->x), y = p->y + part * (q->y - p->y);
      if (!(fabs(x) < 1e9 && fabs(y) < 1e9)) continue;
      for (int s = 0; s < 9; s++)
        put(target, (int)floor(x) + s % 3 - 1, (int)floor(y) + s / 3 - 1,
            (float)(p->depth + part * (q->depth - p->depth)), number);
    }
  }
}

static void fill(buffer *target, const projected c[3], int number)
{
  double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY}, b[3], bx[3], by[3];
  for (int k = 0; k < 3; k++) {
    if (!isfinite(c[k].x + c[k].y)) return;
    low[0] = fmin(low[0], c[k].x), high[0] = fmax(high[0], c[k].x);
    low[1] = fmin(low[1], c[k].y), high[1] = fmax(high[1], c[k].y);
  }
  if (high[0] < 0 || high[1] < 0 || low[0] > target->width || low[1] > target->height) return;
  if (fabs(area_of(c)) <= 1e-3 * hypot(high[0] - low[0], high[1] - low[1])) {
    draw_edges(target, c, number);
    return;
  }
  int x0 = (int)fmax(0, floor(low[0] - 0.5)), x1 = (int)fmin(target->width - 1, ceil(high[0]));
  int y0 = (int)fmax(0, floor(low[1] - 0.5)), y1 = (int)fmin(target->height - 1, ceil(high[1]));
  /* The weights are linear: their steps in x and y from two more points. */
  if (!weights_at(c, x0 + 0.5, y0 + 0.5, b) || !weights_at(c, x0 + 1.5, y0 + 0.5, bx) ||
      !weights_at(c, x0 + 0.5, y0 + 1.5, by))
    return;
  for (int y = y0; y <= y1; y++)
    for (int x = x0; x <= x1; x++) {
      double i = x - x0, j = y - y0, w[3];
      for (int k = 0; k < 3; k++) w[k] = b[k] + i * (bx[k] - b[k]) + j * (by[k] - b[k]);
      if (w[0] < 0 || w[1] < 0 || w[2] < 0) continue;
      put(target, x, y, (float)(w[0] * c[0].depth + w[1] * c[1].depth + w[2] * c[2].depth), number);
    }
}

static int buffer_open(buffer *b, int width, int height)
{
  size_t count = (size_t)width * (size_t)height;
  *b = (buffer){width, height, malloc(count * sizeof *b->depth), malloc(count * sizeof *b->triangle)};
  if (!b->depth || !b->triangle) return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a picture");
  for (size_t k = 0; k < count; k++) b->depth[k] = INFINITY, b->triangle[k] = -1;
  return FLESH_OK;
}

/* Normals of every corner: the mean, weighted by area, over the triangles around its vertex that
 * meet its own at less than `SHARP` in the rest shape. */
static int make_normals(const flesh_render_surface *s, float (*normals)[3])
{
  enum { X, REST };
  static const double SHARP = 0.64; /* cos 50 degrees */
  size_t triangles = (size_t)s->triangles, corners = 3 * triangles;
  double(*faces[2])[3] = {malloc((triangles + 1) * sizeof **faces), NULL};
  int *start = calloc((size_t)s->vertices + 2, sizeof *start), *around = malloc((corners + 1) * sizeof *around);
  faces[REST] = s->rest ? malloc((triangles + 1) * sizeof **faces) : faces[X];
  int failed = !faces[X] || !faces[REST] || !start || !around;
  for (int kind = X; kind <= (s->rest ? REST : X) && !failed; kind++)
    for (size_t t = 0; t < triangles; t++) {
      const double *x = kind == X ? s->x : s->rest;
      const double *p = x + 3 * (size_t)s->corners[3 * t], *q = x + 3 * (size_t)s->corners[3 * t + 1];
      const double *r = x + 3 * (size_t)s->corners[3 * t + 2];
      double a[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]}, b[3] = {r[0] - p[0], r[1] - p[1], r[2] - p[2]};
      flesh_vec3_cross(a, b, faces[kind][t]);
    }
  for (size_t c = 0; c < corners && !failed; c++) start[s->corners[c] + 2]++;
  for (int v = 0; v < s->vertices && !failed; v++) start[v + 2] += start[v + 1];
  for (size_t c = 0; c < corners && !failed; c++) around[start[s->corners[c] + 1]++] = (int)(c / 3);
  for (size_t c = 0; c < corners && !failed; c++) {
    double sum[3] = {0, 0, 0}, mine[3];
    memcpy(mine, faces[REST][c / 3], sizeof mine);
    normalise(mine);
    for (int k = start[s->corners[c]]; k < start[s->corners[c] + 1]; k++) {
      const double *other = faces[REST][around[k]];
      if (around[k] != (int)(c / 3) && !(flesh_vec3_dot(mine, other) > SHARP * sqrt(flesh_vec3_dot(other, other))))
        continue;
      for (int d = 0; d < 3; d++) sum[d] += faces[X][around[k]][d];
    }
    normalise(sum);
    for (int d = 0; d < 3; d++) normals[c][d] = (float)sum[d];
  }
  if (s->rest) free(faces[REST]);
  free(faces[X]);
  free(start);
  free(around);
  return failed ? flesh_fail(FLESH_ERR_MEMORY, "out of memory for a picture") : FLESH_OK;
}

/* Parallel rays from over the camera's left shoulder onto everything. */
static void place_sun(scene *s)
{
  flesh_camera camera = {.target = {NAN, NAN, NAN}, .height = NAN};
  flesh_view *sun = &s->sun_view;
  const flesh_view *v = &s->view;
  double direction[3], up[3] = {0, 0, 1}, size = s->lit.height;
  for (int d = 0; d < 3; d++) direction[d] = v->back[d] + 0.9 * v->up[d] - 0.65 * v->right[d];
  normalise(direction);
  if (fabs(direction[2]) > 0.99) up[1] = 1, up[2] = 0;
  flesh_view_fit fit;
  flesh_view_fit_begin(&camera, (int)size, (int)size, &fit);
  memcpy(fit.view.back, direction, sizeof direction);
  flesh_vec3_cross(up, direction, fit.view.right);
  normalise(fit.view.right);
  flesh_vec3_cross(direction, fit.view.right, fit.view.up);
  for (int k = 0; k < s->count; k++)
    if (!s->surfaces[k].ground) flesh_view_fit_add(&fit, s->surfaces[k].vertices, s->surfaces[k].x);
  flesh_view_fit_end(&fit, &camera, sun);
}

/* Which surface a triangle's number belongs to. */
static int surface_of(const scene *s, int number)
{
  int k = 0;
  while (number >= s->first[k + 1]) k++;
  return k;
}

/* How much of the light reaches a point: the mean over 3x3 texels of the shadow map. */
static double lit_part(const scene *s, const double p[3], double facing)
{
  projected at = project(&s->sun_view, p);
  double texel = s->sun_view.height / s->lit.height, bias = texel * (1.5 + 2.5 / fmax(facing, 0.15));
  int lit = 0;
  for (int j = -1; j <= 1; j++)
    for (int i = -1; i <= 1; i++) {
      double x = floor(at.x + 1.1 * i), y = floor(at.y + 1.1 * j);
      if (!(x >= 0 && y >= 0 && x < s->lit.width && y < s->lit.height)) lit++;
      else lit += at.depth - bias <= s->lit.depth[(size_t)y * (size_t)s->lit.width + (size_t)x];
    }
  return lit / 9.;
}

static const float inverted_colour[3] = {0.030f, 0.004f, 0.055f};

/* The colour of the surface itself at the place with weights b. */
static void base_colour(const flesh_render_surface *f, int triangle, const double b[3], double rgb[3])
{
  const int *n = f->corners + 3 * (size_t)triangle;
  for (int d = 0; d < 3; d++) {
    if (f->marked && f->marked[triangle]) rgb[d] = inverted_colour[d];
    else if (f->triangle_colours) rgb[d] = f->triangle_colours[3 * (size_t)triangle + (size_t)d];
    else if (!f->colours) rgb[d] = f->plain[d];
    else
      rgb[d] = b[0] * f->colours[3 * (size_t)n[0] + (size_t)d] + b[1] * f->colours[3 * (size_t)n[1] + (size_t)d] +
               b[2] * f->colours[3 * (size_t)n[2] + (size_t)d];
  }
}

/* Distance of the sample from the nearest edge, in samples. */
static double edge_distance(const projected c[3], const double b[3])
{
  const double area = area_of(c);
  double least = INFINITY;
  for (int k = 0; k < 3; k++) {
    const projected *p = &c[(k + 1) % 3], *q = &c[(k + 2) % 3];
    least = fmin(least, fabs(b[k] * area) / hypot(q->x - p->x, q->y - p->y));
  }
  return least;
}

static void shade(const scene *s, int number, double x, double y, double samples, double rgb[3])
{
  int k = surface_of(s, number), triangle = number - s->first[k];
  const flesh_render_surface *f = &s->surfaces[k];
  const projected *c = s->eye + 3 * (size_t)number;
  double screen[3] = {1, 0, 0}, b[3], p[3] = {0, 0, 0}, n[3] = {0, 0, 0}, face[3], eye[3], half[3], sum = 0;
  weights_at(c, x, y, screen);
  for (int i = 0; i < 3; i++) sum += b[i] = screen[i] * c[i].w; /* linear in space */
  for (int i = 0; i < 3; i++) {
    b[i] /= sum;
    const double *corner = f->x + 3 * (size_t)f->corners[3 * (size_t)triangle + (size_t)i];
    for (int d = 0; d < 3; d++) {
      p[d] += b[i] * corner[d];
      n[d] += b[i] * s->normals[3 * (size_t)number + (size_t)i][d];
    }
  }
  normalise(n);
  for (int d = 0; d < 3; d++) {
    const flesh_view *v = &s->view;
    eye[d] = v->distance > 0 ? v->target[d] + v->distance * v->back[d] - p[d] : v->back[d];
    face[d] = n[d];
  }
  normalise(eye);
  /* Seen from behind when the triangle itself is: interpolated normals may turn early. */
  int inside = area_of(c) > 0;
  for (int d = 0; d < 3 && inside; d++) face[d] = -n[d];
  const double *sun = s->sun_view.back;
  double light = flesh_vec3_dot(face, sun), facing = fmax(flesh_vec3_dot(face, eye), 0), shadow = 0;
  if (light > 0) shadow = lit_part(s, p, light);
  for (int d = 0; d < 3; d++) half[d] = eye[d] + sun[d];
  normalise(half);
  double sky = 0.5 + 0.5 * face[2], rim = pow(1 - facing, 4);
  double gloss = shadow * 0.10 * pow(fmax(flesh_vec3_dot(face, half), 0), 36);
  double diffuse = 0.20 + 0.18 * sky + 0.13 * facing + 0.70 * fmax(light, 0) * shadow;
  base_colour(f, triangle, b, rgb);
  for (int d = 0; d < 3; d++) {
    rgb[d] = rgb[d] * diffuse + gloss + 0.14 * rim * (0.4 + 0.6 * rgb[d]);
    if (inside && !f->two_sided) rgb[d] *= 0.45;
  }
  if (!f->edges) return;
  double near = edge_distance(c, screen) / samples; /* pixels */
  if (near < 0.55)
    for (int d = 0; d < 3; d++) rgb[d] *= 0.62;
}

/* A bright wall that darkens downwards. */
static void backdrop(double part, double rgb[3])
{
  static const double top[3] = {0.965, 0.970, 0.980}, bottom[3] = {0.80, 0.82, 0.85};
  for (int d = 0; d < 3; d++) rgb[d] = top[d] + part * part * (bottom[d] - top[d]);
}

static void resolve(const scene *s, int samples, flesh_image *image)
{
  for (int y = 0; y < image->height; y++)
    for (int x = 0; x < image->width; x++) {
      double sum[3] = {0, 0, 0}, rgb[3];
      for (int j = 0; j < samples; j++)
        for (int i = 0; i < samples; i++) {
          size_t row = (size_t)y * (size_t)samples + (size_t)j, column = (size_t)x * (size_t)samples + (size_t)i;
          int number = s->seen.triangle[row * (size_t)s->seen.width + column];
          if (number < 0) backdrop((y + 0.5) / image->height, rgb);
          else shade(s, number, (double)column + 0.5, (double)row + 0.5, samples, rgb);
          for (int d = 0; d < 3; d++) sum[d] += fmin(rgb[d], 1);
        }
      uint32_t packed = 0;
      for (int d = 0; d < 3; d++)
        packed = packed << 8 | (uint32_t)(255 * flesh_srgb_encode(sum[d] / (samples * samples)) + 0.5);
      image->pixels[(size_t)y * (size_t)image->width + (size_t)x] = packed;
    }
}

static int scene_open(scene *s, const flesh_view *view, int count, const flesh_render_surface *surfaces,
                      int samples)
{
  enum { SHADOW = 1024 };
  *s = (scene){.count = count, .surfaces = surfaces, .view = *view};
  s->view.width_px *= samples;
  s->view.height_px *= samples;
  s->first = calloc((size_t)count + 1, sizeof *s->first);
  if (!s->first) return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a picture");
  for (int k = 0; k < count; k++) s->first[k + 1] = s->first[k] + surfaces[k].triangles;
  s->total = s->first[count];
  size_t corners = 3 * (size_t)s->total + 1;
  s->normals = malloc(corners * sizeof *s->normals);
  s->eye = malloc(corners * sizeof *s->eye);
  s->sun = malloc(corners * sizeof *s->sun);
  if (!s->normals || !s->eye || !s->sun) return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a picture");
  int status = buffer_open(&s->seen, s->view.width_px, s->view.height_px);
  if (!status) status = buffer_open(&s->lit, SHADOW, SHADOW);
  if (!status) place_sun(s);
  for (int k = 0; k < count && !status; k++)
    status = make_normals(&surfaces[k], s->normals + 3 * (size_t)s->first[k]);
  return status;
}

static void scene_close(scene *s)
{
  free(s->first);
  free(s->normals);
  free(s->eye);
  free(s->sun);
  free(s->seen.depth), free(s->seen.triangle);
  free(s->lit.depth), free(s->lit.triangle);
}

int flesh_render(const flesh_view *view, int count, const flesh_render_surface *surfaces, int samples,
                 flesh_image *image)
{
  scene s;
  *image = (flesh_image){view->width_px, view->height_px, NULL};
  int status = scene_open(&s, view, count, surfaces, samples);
  if (!status) {
    image->pixels = malloc(sizeof *image->pixels * (size_t)image->width * (size_t)image->height);
    if (!image->pixels) status = flesh_fail(FLESH_ERR_MEMORY, "out of memory for a picture");
  }
  for (int k = 0; k < count && !status; k++)
    for (int c = 0; c < 3 * surfaces[k].triangles; c++) {
      const double *p = surfaces[k].x + 3 * (size_t)surfaces[k].corners[c];
      size_t at = 3 * (size_t)s.first[k] + (size_t)c;
      s.eye[at] = project(&s.view, p);
      s.sun[at] = project(&s.sun_view, p);
      if (c % 3 < 2) continue;
      fill(&s.seen, s.eye + at - 2, s.first[k] + c / 3);
      if (!surfaces[k].ground) fill(&s.lit, s.sun + at - 2, s.first[k] + c / 3);
    }
  if (!status) resolve(&s, samples, image);
  scene_close(&s);
  return status;
}

void flesh_image_free(flesh_image *image)
{
  free(image->pixels);
  image->pixels = NULL;
}
