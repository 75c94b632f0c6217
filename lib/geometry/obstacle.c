/* obstacle.c: planes, spheres and capsules, and the motion of every obstacle. */
#include "geometry/obstacle.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "geometry/motion.h"
#include "geometry/obstacle_mesh.h"
#include "geometry/obstacle_shape.h"
#include "math/mat3.h"
#include "math/nearest.h"

static int is_finite(const double p[3]) { return fabs(p[0]) + fabs(p[1]) + fabs(p[2]) < INFINITY; }

static int new_obstacle(flesh_obstacle_shape shape, const double a[3], const double b[3],
                        double radius, flesh_obstacle **obstacle)
{
  *obstacle = NULL;
  if (!is_finite(a) || !is_finite(b))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "a point or direction of the obstacle is not finite: (%g, %g, %g) or (%g, %g, %g)",
                      a[0], a[1], a[2], b[0], b[1], b[2]);
  *obstacle = calloc(1, sizeof **obstacle);
  if (!*obstacle) return flesh_fail(FLESH_ERR_MEMORY, "no memory for an obstacle");
  (*obstacle)->shape = shape;
  (*obstacle)->radius = radius;
  memcpy((*obstacle)->a, a, sizeof (*obstacle)->a);
  memcpy((*obstacle)->b, b, sizeof (*obstacle)->b);
  return FLESH_OK;
}

int flesh_obstacle_plane(const double point[3], const double normal[3], flesh_obstacle **obstacle)
{
  FLESH_NEED({obstacle, "obstacle"});
  *obstacle = NULL;
  FLESH_NEED({point, "point"}, {normal, "normal"});
  double length = sqrt(flesh_vec3_dot(normal, normal));
  if (!(length > 0 && length < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "normal is (%g, %g, %g); it must be finite and not zero",
                      normal[0], normal[1], normal[2]);
  const double unit[3] = {normal[0] / length, normal[1] / length, normal[2] / length};
  return new_obstacle(FLESH_OBSTACLE_PLANE, point, unit, 0, obstacle);
}

/* The core's radius is half of this, so it must be a normal number. */
static int check_radius(double radius)
{
  return radius >= DBL_MIN && radius < INFINITY
             ? FLESH_OK
             : flesh_fail(FLESH_ERR_ARGUMENT, "radius is %g m; it must be positive", radius);
}

int flesh_obstacle_sphere(const double centre[3], double radius, flesh_obstacle **obstacle)
{
  FLESH_NEED({obstacle, "obstacle"});
  *obstacle = NULL;
  FLESH_NEED({centre, "centre"});
  const int status = check_radius(radius);
  return status ? status : new_obstacle(FLESH_OBSTACLE_SPHERE, centre, centre, radius, obstacle);
}

int flesh_obstacle_capsule(const double a[3], const double b[3], double radius,
                           flesh_obstacle **obstacle)
{
  FLESH_NEED({obstacle, "obstacle"});
  *obstacle = NULL;
  FLESH_NEED({a, "a"}, {b, "b"});
  enum { LONGEST = 100000 }; /* in radii: the core has two balls per radius */
  const int status = check_radius(radius);
  if (status) return status;
  int same = a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
  const double axis[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, length = sqrt(flesh_vec3_dot(axis, axis));
  if (is_finite(a) && is_finite(b) && !(length <= LONGEST * radius))
    return flesh_fail(FLESH_ERR_ARGUMENT, "the capsule is %g m long, with a radius of %g m; it must not be longer than "
                                          "%d radii", length, radius, LONGEST);
  return new_obstacle(same ? FLESH_OBSTACLE_SPHERE : FLESH_OBSTACLE_CAPSULE, a, b, radius, obstacle);
}

int flesh_obstacle_mesh(int nodes, const double *positions, int triangles,
                        const int *triangle_nodes, flesh_obstacle **obstacle)
{
  FLESH_NEED({obstacle, "obstacle"});
  *obstacle = NULL;
  FLESH_NEED({positions, "positions"}, {triangle_nodes, "triangle_nodes"});
  const double zero[3] = {0, 0, 0};
  int status = new_obstacle(FLESH_OBSTACLE_MESH, zero, zero, 0, obstacle);
  if (!status)
    status = flesh_obstacle_tree_create(nodes, positions, triangles, triangle_nodes,
                                        &(*obstacle)->tree);
  if (status) flesh_obstacle_destroy(obstacle);
  return status;
}

int flesh_obstacle_move(flesh_obstacle *obstacle, const flesh_motion *motion)
{
  FLESH_NEED({obstacle, "obstacle"}, {motion, "motion"});
  flesh_motion copy;
  int status = flesh_motion_copy(motion, &copy);
  if (status) return status;
  flesh_motion_clear(&obstacle->motion);
  obstacle->motion = copy;
  return FLESH_OK;
}

void flesh_obstacle_destroy(flesh_obstacle **obstacle)
{
  if (!obstacle || !*obstacle) return;
  flesh_motion_clear(&(*obstacle)->motion);
  flesh_obstacle_tree_destroy(&(*obstacle)->tree);
  free(*obstacle);
  *obstacle = NULL;
}

void flesh_obstacle_frame(const flesh_obstacle *obstacle, double t, flesh_frame *frame)
{
  const flesh_motion *motion = &obstacle->motion;
  frame->moved = motion->count > 0;
  if (!frame->moved) return;
  memcpy(frame->centre, motion->centre, sizeof frame->centre);
  flesh_motion_apply(motion, t, motion->centre, frame->origin);
  for (int k = 0; k < 3; k++) {
    double y[3] = {motion->centre[0], motion->centre[1], motion->centre[2]}, x[3];
    y[k] += 1;
    flesh_motion_apply(motion, t, y, x);
    for (int c = 0; c < 3; c++) frame->R[3 * c + k] = x[c] - frame->origin[c];
  }
}

void flesh_frame_enter(const flesh_frame *frame, const double x[3], double y[3])
{
  if (!frame->moved) {
    memcpy(y, x, 3 * sizeof *y);
    return;
  }
  const double d[3] = {x[0] - frame->origin[0], x[1] - frame->origin[1], x[2] - frame->origin[2]};
  flesh_mat3_transposed_times(frame->R, d, y);
  for (int c = 0; c < 3; c++) y[c] += frame->centre[c];
}

void flesh_frame_leave(const flesh_frame *frame, const double y[3], double x[3])
{
  if (!frame->moved) {
    memcpy(x, y, 3 * sizeof *x);
    return;
  }
  const double d[3] = {y[0] - frame->centre[0], y[1] - frame->centre[1], y[2] - frame->centre[2]};
  flesh_mat3_times(frame->R, d, x);
  for (int c = 0; c < 3; c++) x[c] += frame->origin[c];
}

int flesh_obstacle_moves(const flesh_obstacle *obstacle) { return obstacle->motion.count > 1; }

void flesh_obstacle_velocity(const flesh_obstacle *obstacle, double t, const double y[3],
                             double v[3])
{
  double a[3];
  v[0] = v[1] = v[2] = 0;
  if (flesh_obstacle_moves(obstacle)) flesh_motion_rates(&obstacle->motion, t, y, v, a);
}

/* Integrates by Gauss-Legendre quadrature with two points between keyframes. Exact for translations, whose velocities
 * are quadratic there. */
void flesh_obstacle_mean_velocity(const flesh_obstacle *obstacle, double begin, double end, const double x[3], double v[3])
{
  double y[3], part[3], to;
  flesh_frame frame;
  v[0] = v[1] = v[2] = 0;
  for (double from = begin; from < end; from = to) {
    to = fmin(end, flesh_obstacle_next_event(obstacle, from));
    for (int k = -1; k <= 1; k += 2) {
      const double t = (from + to) / 2 + k * (to - from) / sqrt(12); /* points of the quadrature */
      flesh_obstacle_frame(obstacle, t, &frame);
      flesh_frame_enter(&frame, x, y);
      flesh_obstacle_velocity(obstacle, t, y, part);
      for (int c = 0; c < 3; c++) v[c] += (to - from) / (2 * (end - begin)) * part[c];
    }
  }
}

double flesh_obstacle_next_event(const flesh_obstacle *obstacle, double t)
{
  return flesh_motion_next_event(&obstacle->motion, t);
}

size_t flesh_obstacle_memory(const flesh_obstacle *obstacle)
{
  return sizeof *obstacle + (size_t)obstacle->motion.count * sizeof *obstacle->motion.keyframes +
         (obstacle->tree ? flesh_obstacle_tree_memory(obstacle->tree) : 0);
}

const char *flesh_obstacle_name(const flesh_obstacle *obstacle)
{
  static const char *const names[] = {[FLESH_OBSTACLE_PLANE] = "plane", [FLESH_OBSTACLE_SPHERE] = "sphere",
                                      [FLESH_OBSTACLE_CAPSULE] = "capsule", [FLESH_OBSTACLE_MESH] = "mesh"};
  static_assert(sizeof names / sizeof *names == FLESH_OBSTACLE_MESH + 1, "a name of every shape");
  return names[obstacle->shape];
}

/* Finds the core's point (of a plane, centre or axis) nearest to y: the distance, the unit direction from it to y and,
 * if it is inside the axis, the axis' direction. Returns the core's dimension there (see flesh_barrier_core.flat). */
static int core(const flesh_obstacle *obstacle, const double y[3], double *distance,
                double direction[3], double axis[3])
{
  double foot[3];
  int flat = 0;
  memcpy(foot, obstacle->a, sizeof foot);
  if (obstacle->shape == FLESH_OBSTACLE_CAPSULE) {
    double weights[2], length = 0;
    flesh_nearest_on_segment(obstacle->a, obstacle->b, y, weights);
    flat = weights[0] > 0 && weights[1] > 0;
    for (int c = 0; c < 3; c++) {
      foot[c] = weights[0] * obstacle->a[c] + weights[1] * obstacle->b[c];
      axis[c] = obstacle->b[c] - obstacle->a[c];
      length += axis[c] * axis[c];
    }
    for (int c = 0; c < 3; c++) axis[c] /= sqrt(length);
  }
  for (int c = 0; c < 3; c++) direction[c] = y[c] - foot[c];
  if (obstacle->shape == FLESH_OBSTACLE_PLANE) {
    *distance = flesh_vec3_dot(direction, obstacle->b);
    memcpy(direction, obstacle->b, sizeof obstacle->b);
    return 2;
  }
  *distance = sqrt(flesh_vec3_dot(direction, direction));
  for (int c = 0; c < 3; c++) direction[c] /= *distance;
  return flat;
}

void flesh_obstacle_barrier(const flesh_obstacle *obstacle, const double y[3], double w,
                            flesh_barrier *barrier)
{
  *barrier = (flesh_barrier){.distance = INFINITY};
  if (obstacle->shape == FLESH_OBSTACLE_MESH) {
    flesh_obstacle_tree_barrier(obstacle->tree, y, w, barrier);
    return;
  }
  flesh_barrier_core near = {.radius = obstacle->radius};
  near.flat = core(obstacle, y, &near.distance, near.direction, near.axis);
  flesh_barrier_add(barrier, w, 1, &near);
}

int flesh_obstacle_core(const flesh_obstacle *o, double *radius, double *points)
{
  if (o->shape != FLESH_OBSTACLE_SPHERE && o->shape != FLESH_OBSTACLE_CAPSULE) return 0;
  double length = 0;
  *radius = o->radius / 2;
  for (int c = 0; c < 3; c++) length += (o->b[c] - o->a[c]) * (o->b[c] - o->a[c]);
  int parts = (int)ceil(sqrt(length) / *radius);
  for (int k = 0; points && k <= parts; k++)
    for (int c = 0; c < 3; c++)
      points[3 * k + c] = o->a[c] + (parts ? (double)k / parts : 0) * (o->b[c] - o->a[c]);
  return parts + 1;
}

double flesh_obstacle_depth(const flesh_obstacle *obstacle, const double y[3])
{
  double distance, direction[3], axis[3];
  if (obstacle->shape == FLESH_OBSTACLE_MESH) return 0;
  core(obstacle, y, &distance, direction, axis);
  return fmax(0, obstacle->radius - distance);
}

/* Returns the first root s in [0,1] of a s^2 + 2 b s + c, which is positive at 0 and decreasing; 1 if there is none.
 * Rounding may have made c negative for a step that starts outside; it is then taken as 0. */
static double first_root(double a, double b, double c)
{
  double discriminant = b * b - a * c;
  if (!(b < 0) || discriminant < 0) return 1;
  double s = fmax(c, 0) / (-b + sqrt(discriminant));
  return fmin(s, 1);
}

static double fraction_to_sphere(const double centre[3], double radius, const double y0[3],
                            const double y1[3])
{
  double e[3], d[3];
  for (int c = 0; c < 3; c++) e[c] = y1[c] - y0[c], d[c] = y0[c] - centre[c];
  double distance = sqrt(flesh_vec3_dot(d, d));
  return first_root(flesh_vec3_dot(e, e), flesh_vec3_dot(d, e),
                    (distance - radius) * (distance + radius));
}

/* Returns the fraction to the capsule: to the spheres at its ends and the cylinder between them. */
static double fraction_to_capsule(const flesh_obstacle *o, const double y0[3], const double y1[3])
{
  double e[3], d[3], n[3], s = fmin(fraction_to_sphere(o->a, o->radius, y0, y1),
                                    fraction_to_sphere(o->b, o->radius, y0, y1));
  for (int c = 0; c < 3; c++) e[c] = y1[c] - y0[c], d[c] = y0[c] - o->a[c], n[c] = o->b[c] - o->a[c];
  double nn = flesh_vec3_dot(n, n), along_d = flesh_vec3_dot(d, n) / nn, along_e = flesh_vec3_dot(e, n) / nn;
  for (int c = 0; c < 3; c++) d[c] -= along_d * n[c], e[c] -= along_e * n[c];
  double distance = sqrt(flesh_vec3_dot(d, d));
  if (distance <= o->radius) return s; /* within the infinite cylinder, so beyond an end */
  double side = first_root(flesh_vec3_dot(e, e), flesh_vec3_dot(d, e),
                           (distance - o->radius) * (distance + o->radius));
  double place = along_d + side * along_e;
  return side < s && place >= 0 && place <= 1 ? side : s;
}

double flesh_obstacle_max_feasible_step(const flesh_obstacle *o, const double y0[3], const double y1[3])
{
  if (o->shape == FLESH_OBSTACLE_MESH) return flesh_obstacle_tree_max_feasible_step(o->tree, y0, y1);
  if (o->shape == FLESH_OBSTACLE_SPHERE) return fraction_to_sphere(o->a, o->radius, y0, y1);
  if (o->shape == FLESH_OBSTACLE_CAPSULE) return fraction_to_capsule(o, y0, y1);
  double from = 0, to = 0;
  for (int c = 0; c < 3; c++) {
    from += o->b[c] * (y0[c] - o->a[c]);
    to += o->b[c] * (y1[c] - o->a[c]);
  }
  return to > 0 ? 1 : fmax(from, 0) / (fmax(from, 0) - to);
}
