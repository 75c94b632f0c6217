/* render.c: shades what a depth buffer shows, and draws transparent surfaces before it. */
#include "picture/render.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "math/area.h"
#include "math/mat3.h"
#include "scene/arena.h"

/* A scene; the triangles of all surfaces are numbered consecutively. */
typedef struct scene {
  int count;
  const flesh_render_surface *surfaces;
  const flesh_render_style *style;
  flesh_arena memory;   /* memory of the next three and of the veil */
  int *first;           /* [count+1] number of each surface's first triangle */
  float (*normals)[3];  /* of every corner of every triangle */
  flesh_render_point *eye; /* corners as the camera sees them */
  flesh_view view;
  flesh_raster seen;
  float (*veil)[4]; /* per sample: light of transparent surfaces before it, and the part that they let through; NULL: none */
  flesh_shadow shadow;
} scene;

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

/* Computes the normal at every corner: the mean, weighted by area, over the triangles around its vertex whose angle
 * with its own is less than that of `SHARP` in the rest shape. */
static int make_normals(const flesh_render_surface *s, float (*normals)[3])
{
  enum { X, REST };
  static const double SHARP = 0.64; /* cos 50 degrees */
  size_t triangles = (size_t)s->triangles, corners = 3 * triangles;
  flesh_arena room = {0};
  double(*faces[2])[3] = {flesh_arena_take(&room, triangles * sizeof **faces), NULL};
  int *start = flesh_arena_take(&room, ((size_t)s->vertices + 2) * sizeof *start);
  int *around = flesh_arena_take(&room, corners * sizeof *around);
  faces[REST] = s->rest ? flesh_arena_take(&room, triangles * sizeof **faces) : faces[X];
  int failed = !faces[X] || !faces[REST] || !start || !around;
  for (int kind = X; kind <= (s->rest ? REST : X) && !failed; kind++)
    for (size_t t = 0; t < triangles; t++)
      flesh_area_vector_at(kind == X ? s->x : s->rest, s->corners + 3 * t, faces[kind][t]);
  for (size_t c = 0; c < corners && !failed; c++) start[s->corners[c] + 2]++;
  for (int v = 0; v < s->vertices && !failed; v++) start[v + 2] += start[v + 1];
  for (size_t c = 0; c < corners && !failed; c++) around[start[s->corners[c] + 1]++] = (int)(c / 3);
  for (size_t c = 0; c < corners && !failed; c++) {
    double sum[3] = {0, 0, 0}, mine[3];
    memcpy(mine, faces[REST][c / 3], sizeof mine);
    flesh_view_normalise(mine);
    for (int k = start[s->corners[c]]; k < start[s->corners[c] + 1]; k++) {
      const double *other = faces[REST][around[k]];
      if (around[k] != (int)(c / 3) && !(flesh_vec3_dot(mine, other) > SHARP * sqrt(flesh_vec3_dot(other, other))))
        continue;
      for (int d = 0; d < 3; d++) sum[d] += faces[X][around[k]][d];
    }
    flesh_view_normalise(sum);
    for (int d = 0; d < 3; d++) normals[c][d] = (float)sum[d];
  }
  flesh_arena_free(&room);
  return failed ? flesh_picture_no_memory() : FLESH_OK;
}

/* Returns the surface of a triangle. */
static int surface_of(const scene *s, int number)
{
  int k = 0;
  while (number >= s->first[k + 1]) k++;
  return k;
}

/* Colour of inverted tets, darker than any scale. */
const float flesh_render_inverted[3] = {0.002f, 0.002f, 0.0025f};

/* Computes the surface's own colour at the point with weights b. */
static void base_colour(const flesh_render_surface *f, int triangle, const double b[3], double rgb[3])
{
  const int *n = f->corners + 3 * (size_t)triangle;
  for (int d = 0; d < 3; d++) {
    if (f->marked && f->marked[triangle]) rgb[d] = flesh_render_inverted[d];
    else if (f->triangle_colours) rgb[d] = f->triangle_colours[3 * (size_t)triangle + (size_t)d];
    else if (!f->colours) rgb[d] = f->plain[d];
    else
      rgb[d] = b[0] * f->colours[3 * (size_t)n[0] + (size_t)d] + b[1] * f->colours[3 * (size_t)n[1] + (size_t)d] +
               b[2] * f->colours[3 * (size_t)n[2] + (size_t)d];
  }
}

/* Returns the distance from the sample to the nearest edge that is not hidden, in samples. */
static double edge_distance(const flesh_render_point c[3], const double b[3], unsigned hidden)
{
  const double area = flesh_projected_area(c);
  double least = INFINITY;
  for (int k = 0; k < 3; k++) {
    if (hidden >> k & 1) continue;
    const flesh_render_point *p = &c[(k + 1) % 3], *q = &c[(k + 2) % 3];
    least = fmin(least, fabs(b[k] * area) / hypot(q->x - p->x, q->y - p->y));
  }
  return least;
}

/* A point on a triangle: its weights in the picture and in space, its position, and the flat triangle's normal. */
typedef struct spot {
  const flesh_render_surface *surface;
  const float (*normals)[3]; /* [3] at the triangle's corners */
  int triangle;
  double screen[3], b[3], p[3], flat[3];
} spot;

static void find_spot(const scene *s, int number, double x, double y, spot *at)
{
  const int k = surface_of(s, number);
  const flesh_render_surface *f = at->surface = &s->surfaces[k];
  const flesh_render_point *c = s->eye + 3 * (size_t)number;
  const double *corner[3];
  double sum = 0;
  at->triangle = number - s->first[k];
  at->normals = (const float (*)[3])(s->normals + 3 * (size_t)number);
  at->screen[0] = 1, at->screen[1] = at->screen[2] = 0;
  flesh_projected_weights(c, x, y, at->screen);
  for (int i = 0; i < 3; i++) sum += at->b[i] = at->screen[i] * c[i].w; /* linear in space */
  for (int d = 0; d < 3; d++) at->p[d] = 0;
  for (int i = 0; i < 3; i++) {
    corner[i] = f->x + 3 * (size_t)f->corners[3 * (size_t)at->triangle + (size_t)i];
    at->b[i] /= sum;
    for (int d = 0; d < 3; d++) at->p[d] += at->b[i] * corner[i][d];
  }
  flesh_area_vector(corner[0], corner[1], corner[2], at->flat);
  flesh_view_normalise(at->flat);
}

/* Returns the part of the lamp's light that arrives. Shadows are tested above the flat triangle, on the smooth surface
 * that the normals of its corners suggest, so that the triangles of a round shape do not shade each other (Hanika 2021,
 * "Hacking the Shadow Terminator"). `side` is -1 for a point that is seen from behind. */
static double lit_part(const scene *s, const spot *at, double side)
{
  double p[3] = {at->p[0], at->p[1], at->p[2]};
  const flesh_render_surface *f = at->surface;
  for (int i = 0; i < 3; i++) {
    const double *corner = f->x + 3 * (size_t)f->corners[3 * (size_t)at->triangle + (size_t)i];
    double above = 0;
    for (int d = 0; d < 3; d++) above += side * (at->p[d] - corner[d]) * at->normals[i][d];
    for (int d = 0; d < 3 && above < 0; d++) p[d] -= at->b[i] * above * side * at->normals[i][d];
  }
  return flesh_shadow_lit(&s->shadow, p, fabs(flesh_vec3_dot(at->flat, s->shadow.view.back)));
}

static void to_eye(const flesh_view *v, const double p[3], double eye[3])
{
  for (int d = 0; d < 3; d++) eye[d] = v->distance > 0 ? v->target[d] + v->distance * v->back[d] - p[d] : v->back[d];
  flesh_view_normalise(eye);
}

static void light_up(const scene *s, const spot *at, int inside, double rgb[3])
{
  const double *sun = s->shadow.view.back, side = inside ? -1 : 1;
  double face[3] = {0, 0, 0}, eye[3], half[3];
  for (int d = 0; d < 3; d++)
    for (int i = 0; i < 3; i++) face[d] += side * at->b[i] * at->normals[i][d];
  flesh_view_normalise(face);
  to_eye(&s->view, at->p, eye);
  double light = flesh_vec3_dot(face, sun), facing = fmax(flesh_vec3_dot(face, eye), 0);
  double shadow = light > 0 ? lit_part(s, at, side) : 0;
  for (int d = 0; d < 3; d++) half[d] = eye[d] + sun[d];
  flesh_view_normalise(half);
  double sky = 0.5 + 0.5 * flesh_vec3_dot(face, s->view.zenith), rim = pow(1 - facing, 4);
  double gloss = shadow * 0.10 * pow(fmax(flesh_vec3_dot(face, half), 0), 36);
  double diffuse = 0.20 + 0.18 * sky + 0.13 * facing + 0.70 * fmax(light, 0) * shadow;
  const int values = at->surface->colours != NULL;
  for (int d = 0; d < 3; d++) {
    if (values) rgb[d] *= (inside ? 0.7 : 1) * (0.42 + 0.58 * fmin(diffuse, 1));
    else rgb[d] = (inside ? 0.45 : 1) * (rgb[d] * diffuse + gloss + 0.14 * rim * (0.4 + 0.6 * rgb[d]));
  }
}

/* Returns how opaque a surface is at a point: fully in the middle of the picture, less and less outwards if it
 * fades. */
static double opacity(const scene *s, const spot *at)
{
  static const double FULL = 0.45; /* fraction of the distance `fade` up to which it is opaque */
  if (!(at->surface->fade > 0)) return 1;
  double away = 0;
  for (int d = 0; d < 3; d++) away += pow(at->p[d] - s->view.target[d], 2);
  double part = fmin(fmax((1 - sqrt(away) / at->surface->fade) / (1 - FULL), 0), 1);
  return part * part * (3 - 2 * part);
}

/* Computes the colour of the background, bright at the top and darker at the bottom. */
static void backdrop(double part, double rgb[3])
{
  static const double top[3] = {0.965, 0.970, 0.980}, bottom[3] = {0.80, 0.82, 0.85};
  for (int d = 0; d < 3; d++) rgb[d] = top[d] + part * part * (bottom[d] - top[d]);
}

static void shade(const scene *s, int number, double x, double y, double rgb[3])
{
  const flesh_render_point *c = s->eye + 3 * (size_t)number;
  spot at;
  find_spot(s, number, x, y, &at);
  base_colour(at.surface, at.triangle, at.b, rgb);
  /* The point is seen from behind if the triangle is: interpolated normals may turn earlier. */
  if (!s->style->flat) light_up(s, &at, flesh_projected_area(c) > 0, rgb);
  const double there = opacity(s, &at);
  if (there < 1) {
    double wall[3];
    backdrop(y / s->seen.height, wall);
    for (int d = 0; d < 3; d++) rgb[d] = there * rgb[d] + (1 - there) * wall[d];
  }
  if (!at.surface->edges) return;
  const unsigned hidden = at.surface->hidden ? at.surface->hidden[at.triangle] : 0;
  double near = edge_distance(c, at.screen, hidden) / s->style->samples; /* pixels */
  if (near < 0.55)
    for (int d = 0; d < 3; d++) rgb[d] *= 0.62;
}

static void resolve(const scene *s, uint32_t *pixels)
{
  const int samples = s->style->samples;
  for (int y = 0; y < s->seen.height / samples; y++)
    for (int x = 0; x < s->seen.width / samples; x++) {
      double sum[3] = {0, 0, 0}, rgb[3];
      for (int j = 0; j < samples; j++)
        for (int i = 0; i < samples; i++) {
          size_t row = (size_t)y * (size_t)samples + (size_t)j, column = (size_t)x * (size_t)samples + (size_t)i;
          size_t at = row * (size_t)s->seen.width + column;
          int number = s->seen.triangle[at];
          if (number < 0) backdrop((row + 0.5) / s->seen.height, rgb);
          else shade(s, number, (double)column + 0.5, (double)row + 0.5, rgb);
          for (int d = 0; d < 3; d++) {
            if (s->veil) rgb[d] = s->veil[at][d] + s->veil[at][3] * rgb[d];
            sum[d] += fmin(rgb[d], 1);
          }
        }
      uint32_t packed = 0;
      for (int d = 0; d < 3; d++)
        packed = packed << 8 | (uint32_t)(255 * flesh_srgb_encode(sum[d] / (samples * samples)) + 0.5);
      *pixels++ = packed;
    }
}

/* Adds surface k, as seen from behind, to the veil where it lies before everything else. */
static void lay_veil(scene *s, int k, const flesh_raster *glass)
{
  static const double HIDES = 0.26;
  const flesh_render_surface *f = &s->surfaces[k];
  const size_t count = (size_t)s->seen.width * (size_t)s->seen.height;
  for (size_t at = 0; at < count; at++) {
    if (glass->triangle[at] < 0 || glass->depth[at] >= s->seen.depth[at]) continue;
    spot spot;
    double eye[3];
    find_spot(s, glass->triangle[at], (double)(at % (size_t)s->seen.width) + 0.5,
              (double)(at / (size_t)s->seen.width) + 0.5, &spot);
    to_eye(&s->view, spot.p, eye);
    double tone = s->style->flat ? 1 : 0.65 + 0.35 * fabs(flesh_vec3_dot(spot.flat, eye));
    const double hides = HIDES * opacity(s, &spot);
    for (int d = 0; d < 3; d++)
      s->veil[at][d] = (float)((1 - hides) * s->veil[at][d] + hides * tone * f->plain[d]);
    s->veil[at][3] *= (float)(1 - hides);
  }
}

/* Draws every triangle into the depth buffer, except those of glass that are seen from behind, which are added to the
 * veil. */
static int draw_seen(scene *s)
{
  flesh_raster glass = {0};
  int behind = 0, status = FLESH_OK;
  for (int k = 0; k < s->count; k++)
    for (int t = s->first[k]; t < s->first[k + 1]; t++) {
      const flesh_render_point *c = s->eye + 3 * (size_t)t;
      const double area = flesh_projected_area(c);
      if (!s->surfaces[k].glass || area < 0) flesh_raster_fill(&s->seen, c, t);
      behind |= s->surfaces[k].glass && area > 0;
    }
  if (!behind) return FLESH_OK;
  const size_t count = (size_t)s->seen.width * (size_t)s->seen.height;
  s->veil = flesh_arena_take(&s->memory, count * sizeof *s->veil);
  status = s->veil ? flesh_raster_open(&glass, s->seen.width, s->seen.height) : flesh_picture_no_memory();
  for (size_t at = 0; at < count && !status; at++) s->veil[at][3] = 1;
  for (int k = 0; k < s->count && !status; k++) {
    int drawn = 0;
    for (int t = s->first[k]; t < s->first[k + 1] && s->surfaces[k].glass; t++) {
      const flesh_render_point *c = s->eye + 3 * (size_t)t;
      if (!(flesh_projected_area(c) > 0)) continue;
      flesh_raster_fill(&glass, c, t);
      drawn = 1;
    }
    if (!drawn) continue;
    lay_veil(s, k, &glass);
    flesh_raster_clear(&glass);
  }
  flesh_raster_close(&glass);
  return status;
}

/* Draws the lamp's depth buffer over the places that are seen, of which it looks at one sample per pixel. */
static int cast_shadows(scene *s)
{
  enum { LEAST = 256, MOST = 2048 };
  const int samples = s->style->samples;
  const double size = 1.5 * (s->seen.width > s->seen.height ? s->seen.width : s->seen.height);
  flesh_shadow_begin(&s->view, &s->shadow);
  if (s->style->flat || s->style->no_shadow) return FLESH_OK;
  flesh_view_fit seen = flesh_view_fit_along(&s->shadow.view);
  for (int y = samples / 2; y < s->seen.height; y += samples)
    for (int x = samples / 2; x < s->seen.width; x += samples) {
      int number = s->seen.triangle[(size_t)y * (size_t)s->seen.width + (size_t)x];
      spot at;
      if (number < 0) continue;
      find_spot(s, number, x + 0.5, y + 0.5, &at);
      flesh_view_fit_add(&seen, 1, at.p);
    }
  return flesh_shadow_cast(&s->shadow, &seen, (int)fmin(fmax(size, LEAST), MOST), s->count, s->surfaces);
}

static int scene_open(scene *s, const flesh_view *view, int count, const flesh_render_surface *surfaces,
                      const flesh_render_style *style)
{
  *s = (scene){.count = count, .surfaces = surfaces, .style = style, .view = *view};
  s->view.width_px *= style->samples;
  s->view.height_px *= style->samples;
  s->first = flesh_arena_take(&s->memory, ((size_t)count + 1) * sizeof *s->first);
  if (!s->first) return flesh_picture_no_memory();
  for (int k = 0; k < count; k++) s->first[k + 1] = s->first[k] + surfaces[k].triangles;
  const size_t corners = 3 * (size_t)s->first[count];
  s->normals = flesh_arena_take(&s->memory, corners * sizeof *s->normals);
  s->eye = flesh_arena_take(&s->memory, corners * sizeof *s->eye);
  if (!s->normals || !s->eye) return flesh_picture_no_memory();
  for (int k = 0; k < count; k++)
    for (int c = 0; c < 3 * surfaces[k].triangles; c++)
      s->eye[3 * (size_t)s->first[k] + (size_t)c] =
          flesh_project_point(&s->view, surfaces[k].x + 3 * (size_t)surfaces[k].corners[c]);
  int status = flesh_raster_open(&s->seen, s->view.width_px, s->view.height_px);
  for (int k = 0; k < count && !status; k++)
    status = make_normals(&surfaces[k], s->normals + 3 * (size_t)s->first[k]);
  return status;
}

int flesh_render(const flesh_view *view, int count, const flesh_render_surface *surfaces,
                 const flesh_render_style *style, uint32_t *pixels)
{
  scene s;
  int status = scene_open(&s, view, count, surfaces, style);
  if (!status) status = draw_seen(&s);
  if (!status) status = cast_shadows(&s);
  if (!status) resolve(&s, pixels);
  flesh_arena_free(&s.memory);
  flesh_raster_close(&s.seen);
  flesh_raster_close(&s.shadow.map);
  return status;
}
