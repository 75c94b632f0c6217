/* render_raster.c: projects, draws triangles into a depth buffer, and draws the lamp's depth buffer, fitted to what is
 * seen and what can shade it. */
#include "picture/render.h"

#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "math/area.h"
#include "math/mat3.h"

int flesh_picture_no_memory(void) { return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a picture"); }

int flesh_raster_open(flesh_raster *raster, int width, int height)
{
  size_t count = (size_t)width * (size_t)height;
  *raster = (flesh_raster){width, height, malloc(count * sizeof *raster->depth),
                           malloc(count * sizeof *raster->triangle)};
  if (!raster->depth || !raster->triangle) return flesh_picture_no_memory();
  flesh_raster_clear(raster);
  return FLESH_OK;
}

void flesh_raster_clear(flesh_raster *raster)
{
  size_t count = (size_t)raster->width * (size_t)raster->height;
  for (size_t k = 0; k < count; k++) raster->depth[k] = INFINITY, raster->triangle[k] = -1;
}

void flesh_raster_close(flesh_raster *raster)
{
  free(raster->depth);
  free(raster->triangle);
  *raster = (flesh_raster){0};
}

flesh_render_point flesh_project_point(const flesh_view *view, const double p[3])
{
  double q[3] = {p[0] - view->target[0], p[1] - view->target[1], p[2] - view->target[2]};
  double scale = view->height_px / view->height, away = -flesh_vec3_dot(q, view->back);
  flesh_render_point r = {.w = 1, .depth = away};
  if (view->distance > 0) {
    double z = view->distance + away;
    r.w = z > 1e-3 * view->distance ? view->distance / z : NAN; /* behind the eye: not drawn */
    r.depth = -r.w;
  }
  r.x = 0.5 * view->width_px + scale * r.w * flesh_vec3_dot(q, view->right);
  r.y = 0.5 * view->height_px - scale * r.w * flesh_vec3_dot(q, view->up);
  return r;
}

int flesh_projected_weights(const flesh_render_point c[3], double x, double y, double b[3])
{
  const double area = flesh_projected_area(c);
  if (!(fabs(area) > 1e-12)) return 0;
  b[1] = ((x - c[0].x) * (c[2].y - c[0].y) - (y - c[0].y) * (c[2].x - c[0].x)) / area;
  b[2] = ((c[1].x - c[0].x) * (y - c[0].y) - (c[1].y - c[0].y) * (x - c[0].x)) / area;
  b[0] = 1 - b[1] - b[2];
  return 1;
}

static void put(flesh_raster *target, int x, int y, float depth, int number)
{
  if (x < 0 || y < 0 || x >= target->width || y >= target->height) return;
  const size_t at = (size_t)y * (size_t)target->width + (size_t)x;
  if (depth >= target->depth[at]) return;
  target->depth[at] = depth;
  target->triangle[at] = number;
}

static void draw_edges(flesh_raster *target, const flesh_render_point c[3], int number)
{
  for (int k = 0; k < 3; k++) {
    const flesh_render_point *p = &c[k], *q = &c[(k + 1) % 3];
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

void flesh_raster_fill(flesh_raster *target, const flesh_render_point c[3], int number)
{
  double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY}, b[3], bx[3], by[3];
  for (int k = 0; k < 3; k++) {
    if (!isfinite(c[k].x + c[k].y)) return;
    low[0] = fmin(low[0], c[k].x), high[0] = fmax(high[0], c[k].x);
    low[1] = fmin(low[1], c[k].y), high[1] = fmax(high[1], c[k].y);
  }
  if (high[0] < 0 || high[1] < 0 || low[0] > target->width || low[1] > target->height) return;
  if (fabs(flesh_projected_area(c)) <= 1e-3 * hypot(high[0] - low[0], high[1] - low[1])) {
    draw_edges(target, c, number);
    return;
  }
  int x0 = (int)fmax(0, floor(low[0] - 0.5)), x1 = (int)fmin(target->width - 1, ceil(high[0]));
  int y0 = (int)fmax(0, floor(low[1] - 0.5)), y1 = (int)fmin(target->height - 1, ceil(high[1]));
  /* The weights are linear in x and y: two more points give their slopes. */
  if (!flesh_projected_weights(c, x0 + 0.5, y0 + 0.5, b) || !flesh_projected_weights(c, x0 + 1.5, y0 + 0.5, bx) ||
      !flesh_projected_weights(c, x0 + 0.5, y0 + 1.5, by))
    return;
  for (int y = y0; y <= y1; y++)
    for (int x = x0; x <= x1; x++) {
      double i = x - x0, j = y - y0, w[3];
      for (int k = 0; k < 3; k++) w[k] = b[k] + i * (bx[k] - b[k]) + j * (by[k] - b[k]);
      if (w[0] < 0 || w[1] < 0 || w[2] < 0) continue;
      put(target, x, y, (float)(w[0] * c[0].depth + w[1] * c[1].depth + w[2] * c[2].depth), number);
    }
}

void flesh_shadow_begin(const flesh_view *camera, flesh_shadow *shadow)
{
  flesh_view *lamp = &shadow->view;
  *shadow = (flesh_shadow){0};
  for (int d = 0; d < 3; d++) lamp->back[d] = camera->back[d] + 0.9 * camera->up[d] - 0.65 * camera->right[d];
  flesh_view_normalise(lamp->back);
  flesh_vec3_cross(camera->up, lamp->back, lamp->right); /* never parallel */
  flesh_view_normalise(lamp->right);
  flesh_vec3_cross(lamp->back, lamp->right, lamp->up);
}

/* Returns whether the triangle casts a shadow: glass lets light through from behind. */
static int casts(const flesh_shadow *shadow, const flesh_render_surface *s, const int *corners)
{
  if (s->ground) return 0;
  if (!s->glass) return 1;
  double n[3];
  flesh_area_vector_at(s->x, corners, n);
  return flesh_vec3_dot(n, shadow->view.back) > 0;
}

/* Fits the lamp's view to what is both seen and below a caster, with a margin for the filter. Returns 0 if there is
 * nothing. */
static int fit(flesh_shadow *shadow, const flesh_view_fit *seen, const flesh_view_fit *casters, int size)
{
  enum { EDGE = 4, LEAST = 16 };
  flesh_view *view = &shadow->view;
  double low[2], extent[2], larger;
  for (int k = 0; k < 2; k++) {
    low[k] = fmax(seen->low[k], casters->low[k]);
    extent[k] = fmin(seen->high[k], casters->high[k]) - low[k];
    if (!(extent[k] >= 0)) return 0;
  }
  larger = fmax(extent[0], extent[1]);
  const double texel = larger / (size - 2 * EDGE);
  if (!(texel > 0)) return 0;
  view->width_px = (int)fmax(LEAST, ceil(extent[0] / texel) + 2 * EDGE);
  view->height_px = (int)fmax(LEAST, ceil(extent[1] / texel) + 2 * EDGE);
  view->height = view->height_px * texel;
  for (int d = 0; d < 3; d++)
    view->target[d] = (low[0] + 0.5 * extent[0]) * view->right[d] + (low[1] + 0.5 * extent[1]) * view->up[d] +
                      0.5 * (casters->low[2] + casters->high[2]) * view->back[d];
  return 1;
}

int flesh_shadow_cast(flesh_shadow *shadow, const flesh_view_fit *seen, int size, int count,
                      const flesh_render_surface *surfaces)
{
  flesh_view_fit casters = flesh_view_fit_along(&shadow->view);
  for (int k = 0; k < count; k++)
    for (int t = 0; t < surfaces[k].triangles; t++) {
      const int *corners = surfaces[k].corners + 3 * (size_t)t;
      if (!casts(shadow, &surfaces[k], corners)) continue;
      for (int c = 0; c < 3; c++) flesh_view_fit_add(&casters, 1, surfaces[k].x + 3 * (size_t)corners[c]);
    }
  if (!fit(shadow, seen, &casters, size)) return FLESH_OK;
  int status = flesh_raster_open(&shadow->map, shadow->view.width_px, shadow->view.height_px);
  for (int k = 0; k < count && !status; k++)
    for (int t = 0; t < surfaces[k].triangles; t++) {
      const int *corners = surfaces[k].corners + 3 * (size_t)t;
      flesh_render_point p[3];
      if (!casts(shadow, &surfaces[k], corners)) continue;
      for (int c = 0; c < 3; c++) p[c] = flesh_project_point(&shadow->view, surfaces[k].x + 3 * (size_t)corners[c]);
      flesh_raster_fill(&shadow->map, p, t);
    }
  return status;
}

/* Compares four depths each way, weighted by a box of three texels around the point: unlike a count of texels, whose
 * steps appear as bands along the edges of shadows, this is continuous. */
double flesh_shadow_lit(const flesh_shadow *shadow, const double p[3], double facing)
{
  enum { TAPS = 4 };
  const flesh_raster *map = &shadow->map;
  if (!map->depth) return 1;
  const flesh_render_point at = flesh_project_point(&shadow->view, p);
  const double texel = shadow->view.height / map->height;
  const double slope = sqrt(fmax(0, 1 - facing * facing)) / fmax(facing, 0.05);
  const double limit = at.depth - texel * (0.5 + 2 * slope);
  const double x = floor(at.x - 0.5), y = floor(at.y - 0.5), fx = at.x - 0.5 - x, fy = at.y - 0.5 - y;
  if (!(x >= 1 && y >= 1 && x < map->width - 2 && y < map->height - 2)) return 1;
  const double wx[TAPS] = {1 - fx, 1, 1, fx}, wy[TAPS] = {1 - fy, 1, 1, fy};
  double lit = 0;
  for (int j = 0; j < TAPS; j++) {
    const float *row = map->depth + ((size_t)y + (size_t)j - 1) * (size_t)map->width + (size_t)x - 1;
    for (int i = 0; i < TAPS; i++) lit += wy[j] * wx[i] * (limit <= row[i]);
  }
  return lit / 9;
}
