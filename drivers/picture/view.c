/* view.c: places a camera so that it sees everything. */
#include <math.h>

#include "picture/view.h"
#include "math/mat3.h"

static const double MARGIN = 1.06;

void flesh_view_normalise(double a[3])
{
  double length = sqrt(flesh_vec3_dot(a, a));
  for (int d = 0; d < 3; d++) a[d] = length > 0 ? a[d] / length : 0;
}

/* Turns `a` by the smallest rotation that takes z to the unit vector u. */
static void rotate_z_to(const double u[3], double a[3])
{
  const double axis[3] = {-u[1], u[0], 0}; /* z x u */
  double once[3], twice[3];
  if (u[2] < -1 + 1e-12) {
    a[1] = -a[1], a[2] = -a[2];
    return;
  }
  flesh_vec3_cross(axis, a, once);
  flesh_vec3_cross(axis, once, twice);
  for (int d = 0; d < 3; d++) a[d] += once[d] + twice[d] / (1 + u[2]);
}

flesh_view_fit flesh_view_fit_along(const flesh_view *axes)
{
  flesh_view_fit fit = {.view = *axes};
  for (int k = 0; k < 4; k++) fit.sides[k] = -INFINITY;
  for (int k = 0; k < 3; k++) fit.low[k] = INFINITY, fit.high[k] = -INFINITY;
  return fit;
}

void flesh_view_fit_begin(const flesh_camera *camera, int width_px, int height_px, flesh_view_fit *fit)
{
  const double degree = acos(-1) / 180;
  double ca = cos(camera->azimuth * degree), sa = sin(camera->azimuth * degree);
  double ce = cos(camera->elevation * degree), se = sin(camera->elevation * degree);
  *fit = flesh_view_fit_along(&(flesh_view){.right = {ca, sa, 0},
                                            .up = {-sa * se, ca * se, ce},
                                            .back = {sa * ce, -ca * ce, se},
                                            .zenith = {0, 0, 1},
                                            .width_px = width_px,
                                            .height_px = height_px});
  double length = sqrt(flesh_vec3_dot(camera->up, camera->up));
  if (length > 0) { /* else z is up, also if the length is NaN */
    flesh_view *v = &fit->view;
    for (int d = 0; d < 3; d++) v->zenith[d] = camera->up[d] / length;
    rotate_z_to(v->zenith, v->right);
    rotate_z_to(v->zenith, v->up);
    rotate_z_to(v->zenith, v->back);
  }
  fit->slope[1] = tan(0.5 * camera->field_of_view * degree);
  fit->slope[0] = fit->slope[1] * width_px / height_px;
}

/* An eye at (r, u, b) sees a point (x, y, z) if |x - r| <= slope (b - z) and the same holds upwards: these are four
 * half spaces, for each of which only the farthest point matters. */
void flesh_view_fit_add(flesh_view_fit *fit, int count, const double *points)
{
  for (int i = 0; i < count; i++) {
    const double *p = points + 3 * (size_t)i;
    double c[3] = {flesh_vec3_dot(p, fit->view.right), flesh_vec3_dot(p, fit->view.up),
                   flesh_vec3_dot(p, fit->view.back)};
    if (!isfinite(c[0] + c[1] + c[2])) continue;
    for (int axis = 0; axis < 2; axis++) {
      fit->sides[2 * axis] = fmax(fit->sides[2 * axis], c[axis] + fit->slope[axis] * c[2]);
      fit->sides[2 * axis + 1] = fmax(fit->sides[2 * axis + 1], -c[axis] + fit->slope[axis] * c[2]);
    }
    for (int k = 0; k < 3; k++) {
      fit->low[k] = fmin(fit->low[k], c[k]);
      fit->high[k] = fmax(fit->high[k], c[k]);
    }
  }
}

double flesh_view_fit_shape(const flesh_view_fit *fit)
{
  double height = fit->high[1] - fit->low[1];
  return height > 0 ? (fit->high[0] - fit->low[0]) / height : 1;
}

void flesh_view_fit_end(const flesh_view_fit *fit, const flesh_camera *camera, flesh_view *view)
{
  *view = fit->view;
  const double *slope = fit->slope, *sides = fit->sides;
  double c[3] = {0, 0, 0}, height = camera->height; /* c: the target in the camera's axes */
  int empty = !(fit->high[0] >= fit->low[0]), given = !isnan(camera->target[0]);
  double shape[2] = {(double)view->width_px / view->height_px, 1}, needed = 0;
  /* For parallel rays, the sides are those of the box. */
  for (int k = 0; k < 2 && !empty && !given; k++) c[k] = 0.5 * (sides[2 * k] - sides[2 * k + 1]);
  if (!empty && !given) c[2] = 0.5 * (fit->low[2] + fit->high[2]);
  if (given) {
    c[0] = flesh_vec3_dot(camera->target, view->right);
    c[1] = flesh_vec3_dot(camera->target, view->up);
    c[2] = flesh_vec3_dot(camera->target, view->back);
  }
  for (int k = 0; k < 2 && !empty; k++) {
    double one = sides[2 * k] - c[k], other = sides[2 * k + 1] + c[k];
    needed = fmax(needed, 2 * MARGIN * (fmax(one, other) - slope[k] * c[2]) / shape[k]);
  }
  if (isnan(height)) height = needed;
  if (!(height > 0)) height = 1;
  for (int d = 0; d < 3; d++)
    view->target[d] = c[0] * view->right[d] + c[1] * view->up[d] + c[2] * view->back[d];
  view->height = height;
  view->distance = slope[1] > 0 ? height / (2 * slope[1]) : 0;
  const double depth = fmax(0, c[2] - fit->low[2]); /* the view is wider farther from the eye */
  view->misses_all = !empty && slope[1] > 0 && fit->low[2] - c[2] > view->distance;
  int dots = 0;
  for (int k = 0; k < 2 && !empty; k++) {
    const double half = 0.5 * shape[k] * height + slope[k] * depth;
    view->misses_all |= fit->low[k] - c[k] > half || c[k] - fit->high[k] > half;
    dots += fit->high[k] - fit->low[k] < height / view->height_px;
  }
  view->misses_all |= dots == 2;
}
