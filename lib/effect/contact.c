/* contact.c: a barrier that keeps the body's nodes out of an obstacle, and lagged friction on it. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "effect/contact_core.h"
#include "effect/effect.h"
#include "effect/obstacle.h"
#include "math/eig3.h"
#include "math/mat3.h"

typedef struct contact {
  flesh_obstacle *obstacle;
  double thickness, friction, slip_speed;
  int count;      /* nodes of tets */
  int *nodes;     /* [count] ascending */
  double *weight; /* [count] stiffness times the node's area, N */
  flesh_contact_core core;
} contact;

static const flesh_cells *contact_cells(const flesh_effect *effect)
{
  const contact *self = effect->data;
  return self->core.points ? &self->core.faces : NULL;
}

/* The barrier at the place of a node; FLESH_UNDEFINED within the obstacle. */
static int barrier_at(const contact *self, const flesh_frame *frame, const double *x,
                      flesh_barrier *barrier)
{
  double y[3];
  flesh_frame_enter(frame, x, y);
  flesh_obstacle_barrier(self->obstacle, y, self->thickness, barrier);
  return barrier->distance > 0 ? FLESH_OK : FLESH_UNDEFINED;
}

/* Friction of a node: its normal force as the lagged state has it, and how its tangential velocity
 * relative to the obstacle rubs. */
typedef struct rub {
  double force;              /* friction * normal force, N; 0: none */
  double normal[3];
  double u[3], speed;        /* m/s */
} rub;

static rub rub_of(const contact *self, const flesh_frame *lagged, const flesh_point *point, int k)
{
  rub result = {0};
  flesh_barrier barrier;
  const int i = 3 * self->nodes[k];
  if (barrier_at(self, lagged, point->x_lag + i, &barrier) || barrier.distance == INFINITY)
    return result;
  double y[3], v[3], push = sqrt(flesh_vec3_dot(barrier.gradient, barrier.gradient));
  if (!(push > 0)) return result;
  flesh_frame_enter(lagged, point->x_lag + i, y);
  flesh_obstacle_velocity(self->obstacle, point->t, y, v);
  for (int c = 0; c < 3; c++) result.normal[c] = barrier.gradient[c] / push;
  if (lagged->moved) {
    memcpy(y, result.normal, sizeof y);
    flesh_mat3_times(lagged->R, y, result.normal);
  }
  for (int c = 0; c < 3; c++) result.u[c] = point->v[i + c] - v[c];
  double across = flesh_vec3_dot(result.u, result.normal);
  for (int c = 0; c < 3; c++) result.u[c] -= across * result.normal[c];
  result.speed = sqrt(flesh_vec3_dot(result.u, result.u));
  result.force = self->friction * self->weight[k] * push;
  return result;
}

/* The integral of f(y) = min(1, 2 y/e - (y/e)^2), and f(y)/y. */
static double slip_potential(double y, double e)
{
  return y < e ? y * y / e * (1 - y / (3 * e)) : y - e / 3;
}

static double slip_ratio(double y, double e) { return y < e ? (2 - y / e) / e : 1 / y; }

/* One evaluation: a part of the nodes by each task; parts are as large as is worth handing out, whatever the number of
 * threads. */
enum { MOST_PARTS = 64, NODES_OF_PART = 64 };

typedef struct job {
  const contact *self;
  const flesh_point *point;
  const flesh_shift *shift; /* of the matrix, and of the potential of friction */
  flesh_frame frame, lagged;
  double *r;            /* NULL: not asked for */
  int rubbing, summing; /* friction; what potentials are made of */
  flesh_block_matrix *K;
  int parts;
  struct {
    int undefined;
    double energy, friction, size; /* of barriers; potential of friction, and the sizes of its terms */
  } found[MOST_PARTS];
} job;

static void open_job(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, job *j)
{
  *j = (job){.self = effect->data, .point = point, .shift = shift};
  j->rubbing = j->self->friction > 0;
  const int parts = j->self->count / NODES_OF_PART;
  j->parts = parts < 1 ? 1 : parts < MOST_PARTS ? parts : MOST_PARTS;
  flesh_obstacle_frame(j->self->obstacle, point->t, &j->frame);
  flesh_obstacle_frame(j->self->obstacle, point->t_lag, &j->lagged);
}

static int first_of_part(const job *j, int task) { return (int)((int64_t)j->self->count * task / j->parts); }

/* What friction adds to the potential. */
static double friction_potential(const job *j, const rub *rubs, int i)
{
  const flesh_shift *shift = j->shift;
  const double e = j->self->slip_speed;
  if (shift->v != 0) return rubs->force * slip_potential(rubs->speed, e) / shift->v;
  double share = 0; /* an unknown that does not change velocities sees a constant force */
  for (int c = 0; c < 3 && shift->x != 0; c++)
    share += rubs->force * slip_ratio(rubs->speed, e) * rubs->u[c] *
             (j->point->x[i + c] - j->point->x_lag[i + c]) / shift->x;
  return share;
}

static void first_order_of_part(void *data, int task)
{
  job *j = data;
  const contact *self = j->self;
  double energy = 0, friction = 0, size = 0;
  for (int k = first_of_part(j, task), end = first_of_part(j, task + 1); k < end; k++) {
    const int i = 3 * self->nodes[k];
    flesh_barrier barrier;
    if (barrier_at(self, &j->frame, j->point->x + i, &barrier)) {
      j->found[task].undefined = 1;
      return;
    }
    energy += self->weight[k] * barrier.value;
    if (j->r && barrier.distance < INFINITY) {
      double gradient[3] = {barrier.gradient[0], barrier.gradient[1], barrier.gradient[2]};
      if (j->frame.moved) flesh_mat3_times(j->frame.R, barrier.gradient, gradient);
      for (int c = 0; c < 3; c++) j->r[i + c] += self->weight[k] * gradient[c];
    }
    if (!j->rubbing) continue;
    const rub rubs = rub_of(self, &j->lagged, j->point, k);
    if (rubs.force == 0) continue;
    const double ratio = rubs.force * slip_ratio(rubs.speed, self->slip_speed);
    for (int c = 0; c < 3 && j->r; c++) j->r[i + c] += ratio * rubs.u[c];
    if (!j->summing) continue;
    const double share = friction_potential(j, &rubs, i);
    friction += share;
    size += fabs(share);
  }
  j->found[task].energy = energy;
  j->found[task].friction = friction;
  j->found[task].size = size;
}

/* Adds to r and to the energy of the barriers what of them is not NULL. */
static int first_order(job *j, double *r, double *energy)
{
  j->r = r;
  j->summing = energy != NULL;
  flesh_threads_run(j->point->threads, j->parts, first_order_of_part, j);
  for (int p = 0; p < j->parts; p++) {
    if (j->found[p].undefined) return FLESH_UNDEFINED;
    if (energy) *energy += j->found[p].energy;
  }
  return flesh_contact_core_add(&j->self->core, &j->frame, j->point->x, energy, r);
}

static int contact_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  job j;
  open_job(effect, point, NULL, &j);
  return first_order(&j, r, NULL);
}

static int contact_evaluate(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *r,
                            double *phi, double *magnitude)
{
  job j;
  double energy = 0;
  open_job(effect, point, shift, &j);
  int status = first_order(&j, r, &energy);
  if (status) return status;
  if (shift->x != 0) {
    *phi += energy / shift->x;
    *magnitude += fabs(energy / shift->x);
  }
  for (int p = 0; p < j.parts; p++) {
    *phi += j.found[p].friction;
    *magnitude += j.found[p].size;
  }
  return FLESH_OK;
}

static int contact_potential(const flesh_effect *effect, const flesh_point *point,
                             const flesh_shift *shift, double *phi, double *magnitude)
{
  return shift->x != 0 || shift->v != 0 ? contact_evaluate(effect, point, shift, NULL, phi, magnitude) : FLESH_OK;
}

static int contact_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  job j;
  open_job(effect, point, NULL, &j);
  j.rubbing = 0;
  *energy = 0;
  return first_order(&j, NULL, energy);
}

/* K = R H R^T, with its negative eigenvalues filtered. */
static void place_hessian(const flesh_frame *frame, int project, const double H[9], double K[9])
{
  double half[9], w[3], Q[9];
  if (frame->moved) {
    flesh_mat3_multiply_transposed(H, frame->R, half);
    flesh_mat3_multiply(frame->R, half, K);
  } else {
    memcpy(K, H, 9 * sizeof *K);
  }
  if (project == FLESH_PROJECTED_NOT) return;
  flesh_eigh3(K, w, Q);
  if (w[0] >= 0) return;
  memset(K, 0, 9 * sizeof *K);
  for (int e = 0; e < 3; e++) {
    double value = w[e] >= 0 ? w[e] : project == FLESH_PROJECTED_ABSOLUTE ? -w[e] : 0;
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) K[3 * i + j] += value * Q[3 * i + e] * Q[3 * j + e];
  }
}

/* d2 Psi / dv2, positive semi-definite as it is. */
static void add_friction(const contact *self, const rub *rubs, double scale, double *block)
{
  const double e = self->slip_speed, y = rubs->speed, ratio = slip_ratio(y, e);
  /* (f' - f/y) / y^2, whose limit at rest is taken by no direction. */
  const double bend = y > 0 ? ((y < e ? 2 * (1 - y / e) / e : 0) - ratio) / (y * y) : 0;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      block[3 * i + j] += scale * rubs->force *
                          (ratio * ((i == j) - rubs->normal[i] * rubs->normal[j]) +
                           bend * rubs->u[i] * rubs->u[j]);
}

static void jacobian_of_part(void *data, int task)
{
  const job *j = data;
  const contact *self = j->self;
  const flesh_shift *shift = j->shift;
  for (int k = first_of_part(j, task), end = first_of_part(j, task + 1); k < end; k++) {
    double *block = j->K->values + 9 * (size_t)j->K->row_start[self->nodes[k]], placed[9];
    flesh_barrier barrier;
    /* Within the obstacle there is no residual that this could belong to: nothing is added. */
    int status = barrier_at(self, &j->frame, j->point->x + 3 * self->nodes[k], &barrier);
    if (!status && barrier.distance < INFINITY && shift->x != 0) {
      place_hessian(&j->frame, shift->project, barrier.hessian, placed);
      for (int e = 0; e < 9; e++) block[e] += shift->x * self->weight[k] * placed[e];
    }
    if (!j->rubbing || shift->v == 0) continue;
    const rub rubs = rub_of(self, &j->lagged, j->point, k);
    if (rubs.force > 0) add_friction(self, &rubs, shift->v, block);
  }
}

static int contact_jacobian(const flesh_effect *effect, const flesh_point *point,
                            const flesh_shift *shift, flesh_block_matrix *K, const int *slots)
{
  job j;
  open_job(effect, point, shift, &j);
  j.K = K;
  flesh_threads_run(point->threads, j.parts, jacobian_of_part, &j);
  if (shift->x != 0)
    flesh_contact_core_jacobian(&j.self->core, &j.frame, point->x, shift->x, shift->project, K, slots);
  return FLESH_OK;
}

static double contact_next_event(const flesh_effect *effect, double t)
{
  return flesh_obstacle_next_event(((const contact *)effect->data)->obstacle, t);
}

static double contact_way(const flesh_effect *effect, double t_from, const double *x_from,
                          double t_to, const double *x_to)
{
  const contact *self = effect->data;
  flesh_frame from, to;
  double way = 1, y0[3], y1[3];
  flesh_obstacle_frame(self->obstacle, t_from, &from);
  flesh_obstacle_frame(self->obstacle, t_to, &to);
  for (int k = 0; k < self->count; k++) {
    flesh_frame_enter(&from, x_from + 3 * self->nodes[k], y0);
    flesh_frame_enter(&to, x_to + 3 * self->nodes[k], y1);
    way = fmin(way, flesh_obstacle_way(self->obstacle, y0, y1));
  }
  return fmin(way, flesh_contact_core_way(&self->core, &from, x_from, &to, x_to));
}

/* Faces through the core; or nodes that touch neither before nor after: those that do slide around
 * corners, which a straight way cuts. */
static int contact_passed(const flesh_effect *effect, double t_from, const double *x_from,
                          double t_to, const double *x_to)
{
  const contact *self = effect->data;
  flesh_frame from, to;
  double y0[3], y1[3];
  flesh_barrier barrier;
  flesh_obstacle_frame(self->obstacle, t_from, &from);
  flesh_obstacle_frame(self->obstacle, t_to, &to);
  for (int k = 0; k < self->count; k++) {
    const int i = 3 * self->nodes[k];
    flesh_frame_enter(&from, x_from + i, y0);
    flesh_frame_enter(&to, x_to + i, y1);
    if (flesh_obstacle_way(self->obstacle, y0, y1) == 1) continue;
    barrier_at(self, &from, x_from + i, &barrier);
    if (barrier.distance < INFINITY) continue;
    barrier_at(self, &to, x_to + i, &barrier);
    if (barrier.distance == INFINITY) return 1;
  }
  return flesh_contact_core_way(&self->core, &from, x_from, &to, x_to) < 1;
}

/* Nodes go as far as they can, in the obstacle's frame: a moving one takes them along. */
static void contact_clear(const flesh_effect *effect, double t_from, const double *x_from,
                          double t_to, double *x_to)
{
  const contact *self = effect->data;
  flesh_frame from, to;
  double y0[3], y1[3];
  flesh_obstacle_frame(self->obstacle, t_from, &from);
  flesh_obstacle_frame(self->obstacle, t_to, &to);
  for (int k = 0; k < self->count; k++) {
    const int i = 3 * self->nodes[k];
    flesh_frame_enter(&from, x_from + i, y0);
    flesh_frame_enter(&to, x_to + i, y1);
    double way = flesh_obstacle_way(self->obstacle, y0, y1);
    if (way == 1) continue;
    for (int c = 0; c < 3; c++) y0[c] += flesh_way_kept * way * (y1[c] - y0[c]);
    flesh_frame_leave(&to, y0, x_to + i);
  }
}

static int contact_check(const flesh_effect *effect, double t, const double *x)
{
  const contact *self = effect->data;
  flesh_frame frame;
  double y[3], depth, deepest = -1;
  int worst = 0, inside = 0;
  flesh_obstacle_frame(self->obstacle, t, &frame);
  for (int k = 0; k < self->count; k++) {
    flesh_barrier barrier;
    if (!barrier_at(self, &frame, x + 3 * self->nodes[k], &barrier)) continue;
    flesh_frame_enter(&frame, x + 3 * self->nodes[k], y);
    depth = flesh_obstacle_depth(self->obstacle, y);
    if (depth > deepest) deepest = depth, worst = 3 * self->nodes[k];
    inside++;
  }
  if (!inside && flesh_contact_core_add(&self->core, &frame, x, NULL, NULL))
    return flesh_fail(FLESH_ERR_ARGUMENT, "the middle of a %s that the body must stay out of lies in one of its faces",
                      flesh_obstacle_name(self->obstacle));
  if (!inside) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT,
                    "%d nodes are in the %s that they must stay out of; the deepest is node %d at "
                    "(%.6g, %.6g, %.6g), %.3g m below its surface",
                    inside, flesh_obstacle_name(self->obstacle), worst / 3, x[worst], x[worst + 1],
                    x[worst + 2], deepest);
}

static const char *const contact_report_names[] = {"gap", "nodes", "force", NULL};

/* Smallest distance to the obstacle, at most the thickness; nodes nearer than that; size of the sum
 * of their normal forces. */
static void contact_report(const flesh_effect *effect, const flesh_point *point, double *values)
{
  const contact *self = effect->data;
  flesh_frame frame;
  flesh_barrier barrier;
  double force[3] = {0, 0, 0};
  values[0] = self->thickness;
  values[1] = 0;
  flesh_obstacle_frame(self->obstacle, point->t, &frame);
  for (int k = 0; k < self->count; k++) {
    barrier_at(self, &frame, point->x + 3 * self->nodes[k], &barrier);
    values[0] = fmin(values[0], barrier.distance);
    values[1] += barrier.distance < INFINITY;
    for (int c = 0; c < 3; c++) force[c] += self->weight[k] * barrier.gradient[c];
  }
  values[2] = sqrt(flesh_vec3_dot(force, force));
}

static size_t contact_memory(const flesh_effect *effect)
{
  const contact *self = effect->data;
  const flesh_contact_core *core = &self->core;
  size_t bytes = sizeof *self + flesh_obstacle_memory(self->obstacle) +
                 (size_t)self->count * (sizeof *self->nodes + sizeof *self->weight);
  if (core->points)
    bytes += 3 * FLESH_CORE_POINTS * sizeof *core->centres +
             3 * (size_t)core->faces.count *
                 (sizeof *core->faces.nodes + sizeof *core->edge_weight + sizeof *core->vertex_weight);
  return bytes;
}

static void contact_destroy(void *data)
{
  contact *self = data;
  if (!self) return;
  flesh_obstacle_destroy(&self->obstacle);
  flesh_contact_core_clear(&self->core);
  free(self->nodes);
  free(self->weight);
  free(self);
}

static const flesh_effect_operations contact_operations = {
    .name = "contact",
    .cells = contact_cells,
    .residual = contact_residual,
    .jacobian = contact_jacobian,
    .potential = contact_potential,
    .evaluate = contact_evaluate,
    .energy = contact_energy,
    .next_event = contact_next_event,
    .way = contact_way,
    .passed = contact_passed,
    .clear = contact_clear,
    .check = contact_check,
    .report_names = contact_report_names,
    .report = contact_report,
    .memory = contact_memory,
    .destroy = contact_destroy,
};

const flesh_obstacle *flesh_effect_obstacle(const flesh_effect *effect)
{
  return effect->operations == &contact_operations ? ((const contact *)effect->data)->obstacle
                                                   : NULL;
}

void flesh_contact_options_default(flesh_contact_options *options)
{
  *options = (flesh_contact_options){.stiffness = NAN, .thickness = NAN, .slip_speed = 1e-3};
}

/* The nodes and their areas: shares of the rest surface, within the body what its share of the volume
 * gives. These meet the obstacle only where the body is crushed, and must not pass it then. *edge is
 * the mean length of the surface's edges, *share a node's mean area. */
static int collect_nodes(const flesh_mesh *mesh, contact *self, double *edge, double *share)
{
  int triangles;
  const int *surface = flesh_mesh_surface(mesh, &triangles), nodes = flesh_mesh_node_count(mesh);
  const double *X = flesh_mesh_positions(mesh);
  double *area = calloc((size_t)nodes + 1, sizeof *area);
  double *volume = calloc((size_t)nodes + 1, sizeof *volume);
  self->nodes = malloc(((size_t)nodes + 1) * sizeof *self->nodes);
  self->weight = malloc(((size_t)nodes + 1) * sizeof *self->weight);
  if (!area || !volume || !self->nodes || !self->weight) {
    free(area);
    free(volume);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the contact of %d triangles", triangles);
  }
  *edge = 0;
  for (int t = 0; t < triangles; t++) {
    const int *corner = surface + 3 * (size_t)t;
    double e[3], f[3], n[3];
    for (int c = 0; c < 3; c++) {
      e[c] = X[3 * corner[1] + c] - X[3 * corner[0] + c];
      f[c] = X[3 * corner[2] + c] - X[3 * corner[0] + c];
    }
    flesh_vec3_cross(e, f, n);
    for (int k = 0; k < 3; k++) area[corner[k]] += sqrt(flesh_vec3_dot(n, n)) / 6;
    *share += sqrt(flesh_vec3_dot(n, n)) / triangles; /* a mesh has half as many nodes as triangles */
    *edge += sqrt(flesh_vec3_dot(e, e)) / triangles; /* one side of each will do for a mean */
  }
  for (int k = 0; k < 4 * flesh_mesh_tet_count(mesh); k++)
    volume[flesh_mesh_tets(mesh)[k]] += flesh_mesh_tet_volumes(mesh)[k / 4] / 4;
  for (int i = 0; i < nodes; i++)
    if (volume[i] > 0) {
      self->nodes[self->count] = i;
      self->weight[self->count++] = area[i] > 0 ? area[i] : cbrt(volume[i] * volume[i]);
    }
  free(area);
  free(volume);
  return FLESH_OK;
}

/* Three times the largest shear modulus, which is Young's modulus of what keeps its volume. */
static double body_stiffness(const flesh_body *body)
{
  int count = body->materials ? 1 : 0;
  double largest = 0;
  for (int e = 0; body->tet_material && e < flesh_mesh_tet_count(body->mesh); e++)
    if (body->tet_material[e] >= count) count = body->tet_material[e] + 1;
  for (int m = 0; m < count; m++)
    if (body->materials[m].mu > largest) largest = body->materials[m].mu;
  return 3 * largest;
}

static int check_options(const flesh_contact_options *o)
{
  if (!(o->stiffness > 0 && o->stiffness < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "stiffness is %g Pa; it must be positive, and given where the body has no elasticity",
                      o->stiffness);
  if (!(o->thickness > 0 && o->thickness < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "thickness is %g m; it must be positive", o->thickness);
  if (!(o->friction >= 0 && o->friction < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "friction is %g; it must not be negative", o->friction);
  if (!(o->slip_speed > 0 && o->slip_speed < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "slip_speed is %g m/s; it must be positive", o->slip_speed);
  return FLESH_OK;
}

int flesh_effect_contact(const flesh_body *body, const flesh_contact_options *options,
                         flesh_obstacle **obstacle, flesh_effect **effect)
{
  double edge = 0, share = 0;
  flesh_contact_options own = *options;
  contact *self = calloc(1, sizeof *self);
  *effect = NULL;
  if (!self) {
    flesh_obstacle_destroy(obstacle);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for a contact effect");
  }
  self->obstacle = *obstacle;
  *obstacle = NULL;
  int status = collect_nodes(body->mesh, self, &edge, &share);
  if (!status) {
    if (isnan(own.stiffness)) own.stiffness = body_stiffness(body);
    if (isnan(own.thickness)) own.thickness = edge / 20;
    status = check_options(&own);
  }
  if (!status)
    status = flesh_contact_core_create(body->mesh, self->obstacle, own.stiffness * share,
                                       own.thickness, &self->core);
  if (status) {
    contact_destroy(self);
    return status;
  }
  for (int k = 0; k < self->count; k++) self->weight[k] *= own.stiffness;
  self->thickness = own.thickness;
  self->friction = own.friction;
  self->slip_speed = own.slip_speed;
  return flesh_effect_create(&contact_operations, self, effect);
}
