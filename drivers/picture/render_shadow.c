/* render_shadow.c: the lamp's depth buffer, fitted to what is seen and what can darken it. */
#include "picture/render_shadow.h"

#include <math.h>

#include "math/area.h"
#include "math/mat3.h"

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

void flesh_shadow_window_clear(flesh_shadow_window *window)
{
  for (int k = 0; k < 3; k++) window->low[k] = INFINITY, window->high[k] = -INFINITY;
}

void flesh_shadow_window_add(const flesh_shadow *shadow, const double p[3], flesh_shadow_window *window)
{
  const double *axes[3] = {shadow->view.right, shadow->view.up, shadow->view.back};
  for (int k = 0; k < 3; k++) {
    double at = flesh_vec3_dot(p, axes[k]);
    if (!isfinite(at)) continue;
    window->low[k] = fmin(window->low[k], at);
    window->high[k] = fmax(window->high[k], at);
  }
}

/* Whether the triangle casts a shadow: a pane that is transparent from behind lets in light from that side. */
static int casts(const flesh_shadow *shadow, const flesh_render_surface *s, const int *corners)
{
  if (s->ground) return 0;
  if (!s->glass) return 1;
  double n[3];
  flesh_area_vector_at(s->x, corners, n);
  return flesh_vec3_dot(n, shadow->view.back) > 0;
}

/* Over what is both seen and below a caster, with a margin for the filter. False: nothing is. */
static int fit(flesh_shadow *shadow, const flesh_shadow_window *seen, const flesh_shadow_window *casters, int size)
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

int flesh_shadow_cast(flesh_shadow *shadow, const flesh_shadow_window *seen, int size, int count,
                      const flesh_render_surface *surfaces)
{
  flesh_shadow_window casters;
  flesh_shadow_window_clear(&casters);
  for (int k = 0; k < count; k++)
    for (int t = 0; t < surfaces[k].triangles; t++) {
      const int *corners = surfaces[k].corners + 3 * (size_t)t;
      if (!casts(shadow, &surfaces[k], corners)) continue;
      for (int c = 0; c < 3; c++)
        flesh_shadow_window_add(shadow, surfaces[k].x + 3 * (size_t)corners[c], &casters);
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

void flesh_shadow_close(flesh_shadow *shadow) { flesh_raster_close(&shadow->map); }

/* Four comparisons each way, weighted by a box of three texels about the place: continuous, unlike a count of texels,
 * whose steps show as bands along the edges of shadows. */
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
