/* contact.c: contact with an obstacle: a barrier that keeps the body's nodes out of it, and lagged friction. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "effect/contact.h"
#include "effect/effect.h"
#include "effect/environment.h"
#include "flesh/contact.h"
#include "geometry/obstacle.h"
#include "geometry/obstacle_bounds.h"
#include "math/eig3.h"
#include "math/mat3.h"

typedef flesh_contact contact;

static const flesh_cells *contact_cells(const flesh_effect *effect)
{
  const contact *self = effect->data;
  return self->core.points ? &self->core.faces : NULL;
}

/* Friction of a node: its normal force at the lagged state, and its tangential velocity relative to the obstacle. */
typedef struct node_friction {
  double force;              /* friction coefficient times normal force, N; 0: no friction */
  double normal[3];
  double u[3], speed, across; /* m/s; `across`: normal component of the relative velocity */
} node_friction;

/* Computes the obstacle's velocity under a node that was in contact at `was`, moving with `speed`, at the lagged state.
 * If the obstacle has turned since, a sticking node moves with it, and a slipping one is followed for half of the time
 * with its own velocity, as the mean velocity of a step does; using `was` itself would turn the friction by as much as
 * the obstacle turns. Statics use the mean velocity over a step, because the obstacle may be at rest at its end. */
static void velocity_under(const contact *self, const flesh_frame *frame, const flesh_frame *lagged,
                           const flesh_point *point, const double was[3], const double speed[3], double v[3])
{
  /* At a keyframe the velocity jumps: take the value before it, unless a step starts here. */
  const double t = flesh_environment_of(point)->starts ? point->t : nextafter(point->t, -INFINITY);
  const double half = (point->t - point->lagged.t) / 2, past = flesh_environment_of(point)->past;
  double y[3];
  if (past > 0) {
    flesh_obstacle_mean_velocity(self->obstacle, point->t - past, point->t, was, v);
    return;
  }
  flesh_frame_enter(lagged, was, y);
  if (memcmp(frame->R, lagged->R, sizeof frame->R)) {
    double slip = 0, now[3];
    flesh_obstacle_velocity(self->obstacle, point->lagged.t, y, v);
    for (int c = 0; c < 3; c++) slip += (speed[c] - v[c]) * (speed[c] - v[c]), now[c] = was[c] + half * speed[c];
    if (slip > self->slip_speed * self->slip_speed) flesh_frame_enter(frame, now, y);
  }
  flesh_obstacle_velocity(self->obstacle, t, y, v);
}

static node_friction friction_of(const contact *self, const flesh_frame *frame, const flesh_frame *lagged,
                                 const flesh_point *point, int k)
{
  node_friction result = {0};
  flesh_barrier barrier;
  const int i = 3 * self->nodes[k];
  if (flesh_contact_barrier_at(self, lagged, point->lagged.x + i, &barrier) || barrier.distance == INFINITY)
    return result;
  double n[3], v[3], push = sqrt(flesh_vec3_dot(barrier.gradient, barrier.gradient));
  if (!(push > 0)) return result;
  velocity_under(self, frame, lagged, point, point->lagged.x + i, point->lagged.v + i, v);
  for (int c = 0; c < 3; c++) n[c] = barrier.gradient[c] / push;
  if (lagged->moved) flesh_mat3_times(lagged->R, n, result.normal);
  else memcpy(result.normal, n, sizeof n);
  for (int c = 0; c < 3; c++) result.u[c] = point->v[i + c] - v[c];
  result.across = flesh_vec3_dot(result.u, result.normal);
  for (int c = 0; c < 3; c++) result.u[c] -= result.across * result.normal[c];
  result.speed = sqrt(flesh_vec3_dot(result.u, result.u));
  result.force = self->friction * flesh_contact_weight(self, k) * push;
  return result;
}

/* One evaluation. The nodes are divided into parts, one for each task; the division does not depend on the number of
 * threads. */
enum { MOST_PARTS = 64, NODES_OF_PART = 64 };

typedef struct job {
  const contact *self;
  const flesh_point *point;
  const flesh_shift *shift; /* arguments of the Jacobian, and of the potential of friction */
  flesh_frame frame, lagged;
  double *r;            /* NULL: the residual is not wanted */
  int has_friction, with_potential;
  flesh_block_matrix *K;
  int parts;
  struct {
    int undefined;
    double energy, friction, size; /* energy of the barriers; potential of friction and sum of the magnitudes of its terms */
  } found[MOST_PARTS];
} job;

static void open_job(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, job *j)
{
  *j = (job){.self = effect->data, .point = point, .shift = shift};
  j->has_friction = j->self->friction > 0;
  const int parts = j->self->count / NODES_OF_PART;
  j->parts = parts < 1 ? 1 : parts < MOST_PARTS ? parts : MOST_PARTS;
  flesh_obstacle_frame(j->self->obstacle, point->t, &j->frame);
  flesh_obstacle_frame(j->self->obstacle, point->lagged.t, &j->lagged);
}

/* Whether the obstacle is at least `reach` away from nodes k to end-1 at x. */
static int is_far(const contact *self, const flesh_frame *frame, int k, int end, const double *x, double reach)
{
  const flesh_bounds world = flesh_bounds_of(end - k, self->nodes + k, x), own = flesh_bounds_enter(frame, &world);
  return flesh_obstacle_is_far(self->obstacle, &own, reach);
}

/* Whether nodes k to end-1 are out of reach now and, with friction, at the lagged state, so that no force acts on them. */
static int is_inactive(const job *j, int k, int end)
{
  const contact *self = j->self;
  return is_far(self, &j->frame, k, end, j->point->x, self->thickness) &&
         (!j->has_friction || is_far(self, &j->lagged, k, end, j->point->lagged.x, self->thickness));
}

static int first_of_part(const job *j, int task) { return (int)((int64_t)j->self->count * task / j->parts); }

/* Returns the potential of a node's friction. */
static double friction_potential(const job *j, const node_friction *of_node, int i)
{
  const flesh_shift *shift = j->shift;
  const double e = j->self->slip_speed;
  if (shift->v != 0) return of_node->force * flesh_slip_potential(of_node->speed, e) / shift->v;
  double share = 0; /* if the unknown does not change velocities, the force is constant */
  for (int c = 0; c < 3 && shift->x != 0; c++)
    share += of_node->force * flesh_slip_ratio(of_node->speed, e) * of_node->u[c] *
             (j->point->x[i + c] - j->point->lagged.x[i + c]) / shift->x;
  return share;
}

static void residual_of_part(void *data, int task)
{
  job *j = data;
  const contact *self = j->self;
  double energy = 0, friction = 0, size = 0;
  for (int k = first_of_part(j, task), end = first_of_part(j, task + 1), box = k; k < end; k++) {
    if (k == box && is_inactive(j, k, box = flesh_contact_end_of_box(k, end))) {
      k = box - 1;
      continue;
    }
    const int i = 3 * self->nodes[k];
    flesh_barrier barrier;
    if (flesh_contact_barrier_at(self, &j->frame, j->point->x + i, &barrier)) {
      j->found[task].undefined = 1;
      return;
    }
    energy += flesh_contact_weight(self, k) * barrier.value;
    if (j->r && barrier.distance < INFINITY) {
      double gradient[3] = {barrier.gradient[0], barrier.gradient[1], barrier.gradient[2]};
      if (j->frame.moved) flesh_mat3_times(j->frame.R, barrier.gradient, gradient);
      for (int c = 0; c < 3; c++) j->r[i + c] += flesh_contact_weight(self, k) * gradient[c];
    }
    if (!j->has_friction) continue;
    const node_friction of_node = friction_of(self, &j->frame, &j->lagged, j->point, k);
    if (of_node.force == 0) continue;
    const double ratio = of_node.force * flesh_slip_ratio(of_node.speed, self->slip_speed);
    for (int c = 0; c < 3 && j->r; c++) j->r[i + c] += ratio * of_node.u[c];
    if (!j->with_potential) continue;
    const double share = friction_potential(j, &of_node, i);
    friction += share;
    size += fabs(share);
  }
  j->found[task].energy = energy;
  j->found[task].friction = friction;
  j->found[task].size = size;
}

/* Computes r and the energy of the barriers; either may be NULL. */
static int residual_kernel(job *j, double *r, double *energy)
{
  j->r = r;
  j->with_potential = energy != NULL;
  flesh_threads_run(j->point->threads, j->parts, residual_of_part, j);
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
  return residual_kernel(&j, r, NULL);
}

static int contact_evaluate(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *r,
                            double *phi, double *magnitude)
{
  job j;
  double energy = 0;
  open_job(effect, point, shift, &j);
  int status = residual_kernel(&j, r, &energy);
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
  j.has_friction = 0;
  *energy = 0;
  return residual_kernel(&j, NULL, energy);
}

/* Computes K = R H R^T and filters its negative eigenvalues. */
static void place_hessian(const flesh_frame *frame, int project, const double H[9], double K[9])
{
  double half[9], w[3], Q[9];
  if (frame->moved) {
    flesh_mat3_multiply_transposed(H, frame->R, half);
    flesh_mat3_multiply(frame->R, half, K);
  } else {
    memcpy(K, H, 9 * sizeof *K);
  }
  if (project == FLESH_FILTER_NONE) return;
  flesh_eigh3(K, w, Q);
  if (w[0] >= 0) return;
  memset(K, 0, 9 * sizeof *K);
  for (int e = 0; e < 3; e++) {
    double value = w[e] >= 0 ? w[e] : project == FLESH_FILTER_ABSOLUTE ? -w[e] : 0;
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) K[3 * i + j] += value * Q[3 * i + e] * Q[3 * j + e];
  }
}

/* Adds d2 Psi / dv2, or what the matrix of this number expects of it; both are positive semi-definite. */
static void add_friction(const contact *self, const node_friction *of_node, double scale,
                         flesh_slip_expected *expected, int matrix, double *block)
{
  const double e = self->slip_speed, ratio = flesh_slip_ratio(of_node->speed, e);
  double stiffness[9];
  flesh_slip_stiffness(expected, matrix, of_node->u, of_node->normal, e, stiffness);
  for (int k = 0; k < 9; k++)
    block[k] += scale * of_node->force * (stiffness[k] - ratio * of_node->normal[k / 3] * of_node->normal[k % 3]);
}

static void jacobian_of_part(void *data, int task)
{
  const job *j = data;
  const contact *self = j->self;
  const flesh_shift *shift = j->shift;
  void *predicted = flesh_environment_of(j->point)->tangents ? NULL : flesh_environment_of(j->point)->predicted;
  for (int k = first_of_part(j, task), end = first_of_part(j, task + 1), box = k; k < end; k++) {
    if (k == box && is_inactive(j, k, box = flesh_contact_end_of_box(k, end))) {
      k = box - 1;
      continue;
    }
    double *block = j->K->values + 9 * (size_t)j->K->row_start[self->nodes[k]], placed[9];
    flesh_barrier barrier;
    /* Inside the obstacle the residual is undefined: nothing is added. */
    int status = flesh_contact_barrier_at(self, &j->frame, j->point->x + 3 * self->nodes[k], &barrier);
    if (!status && barrier.distance < INFINITY && shift->x != 0) {
      place_hessian(&j->frame, shift->filter, barrier.hessian, placed);
      const double scale = shift->x * flesh_contact_weight(self, k) * flesh_contact_softness(self, predicted, k, &barrier);
      for (int e = 0; e < 9; e++) block[e] += scale * placed[e];
    }
    if (!j->has_friction || shift->v == 0) continue;
    const node_friction of_node = friction_of(self, &j->frame, &j->lagged, j->point, k);
    if (!(of_node.force > 0)) continue;
    int matrix = 0;
    flesh_slip_expected *expected = predicted ? flesh_contact_slip(self, predicted, k, &matrix) : NULL;
    add_friction(self, &of_node, shift->v, expected, matrix, block);
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
    flesh_contact_core_jacobian(&j.self->core, &j.frame, point->x, shift->x, shift->filter, K, slots);
  return FLESH_OK;
}

/* Computes w [9], the derivative of a node's velocity relative to the obstacle by the lagged state. It is linear on
 * either side of a kink. */
static void velocity_by_lagged(const job *j, flesh_argument argument, int i, double w[9])
{
  const flesh_lagged *lagged = &j->point->lagged;
  const double step = 1e-2 * (argument == FLESH_LAGGED_X ? j->self->thickness : j->self->slip_speed);
  memset(w, 0, 9 * sizeof *w);
  if (!flesh_obstacle_moves(j->self->obstacle)) return;
  for (int k = 0; k < 6; k++) {
    double state[2][3], v[3];
    memcpy(state[0], lagged->x + i, sizeof state[0]);
    memcpy(state[1], lagged->v + i, sizeof state[1]);
    state[argument == FLESH_LAGGED_V][k / 2] += k % 2 ? step : -step;
    velocity_under(j->self, &j->frame, &j->lagged, j->point, state[0], state[1], v);
    for (int c = 0; c < 3; c++) w[3 * c + k / 2] -= (k % 2 ? 1 : -1) * v[c] / (2 * step);
  }
}

/* Computes the derivative of a node's friction r = N f(|u|)/|u| u by the lagged state. N is proportional to the norm of
 * the barrier's gradient g, and u is the part of the relative velocity w orthogonal to n = g/|g|. */
static void friction_by_lagged(const job *j, flesh_argument argument, int k, const node_friction *of_node, double block[9])
{
  const double *n = of_node->normal, *u = of_node->u, e = j->self->slip_speed, speed = of_node->speed;
  const double ratio = of_node->force * flesh_slip_ratio(speed, e),
               bend = speed > 0 ? of_node->force * flesh_slip_fall(speed, e) / (speed * speed) : 0;
  const int i = 3 * j->self->nodes[k];
  double turned[9] = {0}, w[9], push = 1;
  flesh_barrier barrier = {0};
  velocity_by_lagged(j, argument, i, w);
  if (argument == FLESH_LAGGED_X && !flesh_contact_barrier_at(j->self, &j->lagged, j->point->lagged.x + i, &barrier)) {
    push = sqrt(flesh_vec3_dot(barrier.gradient, barrier.gradient));
    place_hessian(&j->lagged, FLESH_FILTER_NONE, barrier.hessian, turned);
  }
  for (int c = 0; c < 3; c++) { /* derivative by component c of the lagged state */
    const double dg[3] = {turned[c], turned[3 + c], turned[6 + c]}, dw[3] = {w[c], w[3 + c], w[6 + c]};
    const double pushed = flesh_vec3_dot(n, dg) / push;
    double dn[3], du[3];
    for (int a = 0; a < 3; a++) dn[a] = dg[a] / push - pushed * n[a];
    const double lost = flesh_vec3_dot(n, dw) + flesh_vec3_dot(u, dn);
    for (int a = 0; a < 3; a++) du[a] = dw[a] - lost * n[a] - of_node->across * dn[a];
    const double faster = bend * flesh_vec3_dot(u, du) + ratio * pushed;
    for (int a = 0; a < 3; a++) block[3 * a + c] = ratio * du[a] + faster * u[a];
  }
}

static int contact_couple(const flesh_effect *effect, const flesh_point *point, flesh_argument argument, flesh_block_add add,
                          void *to)
{
  job j;
  double block[9];
  int status = FLESH_OK;
  open_job(effect, point, NULL, &j);
  for (int k = 0; k < j.self->count && j.has_friction && !status; k++) {
    const node_friction of_node = friction_of(j.self, &j.frame, &j.lagged, point, k);
    if (of_node.force == 0) continue;
    friction_by_lagged(&j, argument, k, &of_node, block);
    status = add(to, j.self->nodes[k], j.self->nodes[k], block);
  }
  return status;
}

/* Computes how far the obstacle carries its points under the nodes; nodes out of reach have no force, so theirs are
 * irrelevant. */
static int contact_carry(const flesh_effect *effect, const flesh_point *point, double t_from, double t_to, double *dx)
{
  const contact *self = effect->data;
  flesh_frame at, from, to;
  double y[3], begin[3], end[3];
  if (!flesh_obstacle_moves(self->obstacle)) return 0;
  flesh_obstacle_frame(self->obstacle, point->t, &at);
  flesh_obstacle_frame(self->obstacle, t_from, &from);
  flesh_obstacle_frame(self->obstacle, t_to, &to);
  if (!memcmp(from.R, to.R, sizeof to.R) && !memcmp(from.origin, to.origin, sizeof to.origin)) return 0;
  for (int k = 0; k < self->count; k++) {
    const int i = 3 * self->nodes[k];
    flesh_frame_enter(&at, point->x + i, y);
    flesh_frame_leave(&from, y, begin);
    flesh_frame_leave(&to, y, end);
    for (int c = 0; c < 3; c++) dx[i + c] = end[c] - begin[c];
  }
  return 1;
}

static double contact_next_event(const flesh_effect *effect, double t)
{
  return flesh_obstacle_next_event(((const contact *)effect->data)->obstacle, t);
}

static const char *const contact_report_names[] = {"gap", "nodes", "force", NULL};

/* Computes minus the least distance (at most the thickness), the number of nodes within the thickness, and their normal
 * force. */
static void contact_report_part(const flesh_effect *effect, const flesh_point *point, flesh_rank_numbers *numbers)
{
  const contact *self = effect->data;
  flesh_frame frame;
  flesh_barrier barrier;
  double gap = self->thickness;
  flesh_obstacle_frame(self->obstacle, point->t, &frame);
  for (int k = 0, box = 0; k < self->count; k++) {
    if (k == box && is_far(self, &frame, k, box = flesh_contact_end_of_box(k, self->count), point->x, self->thickness)) {
      k = box - 1;
      continue;
    }
    flesh_contact_barrier_at(self, &frame, point->x + 3 * self->nodes[k], &barrier);
    gap = fmin(gap, barrier.distance);
    numbers->sums[0] += barrier.distance < INFINITY;
    for (int c = 0; c < 3; c++) numbers->sums[1 + c] += flesh_contact_weight(self, k) * barrier.gradient[c];
  }
  numbers->largest[0] = -gap;
}

/* Writes the least distance, the number of nodes in contact, and the magnitude of the force. */
static void contact_report_whole(const flesh_effect *effect, const flesh_rank_numbers *numbers, double *values)
{
  (void)effect;
  values[0] = -numbers->largest[0];
  values[1] = numbers->sums[0];
  values[2] = sqrt(flesh_vec3_dot(numbers->sums + 1, numbers->sums + 1));
}

static void contact_report(const flesh_effect *effect, const flesh_point *point, double *values)
{
  flesh_rank_numbers numbers = {0};
  contact_report_part(effect, point, &numbers);
  contact_report_whole(effect, &numbers, values);
}

const flesh_effect_operations flesh_contact_operations = {
    .name = "contact",
    .role = FLESH_ROLE_CONTACT,
    .cells = contact_cells,
    .residual = contact_residual,
    .jacobian = contact_jacobian,
    .potential = contact_potential,
    .energy = contact_energy,
    .destroy = flesh_contact_destroy,
    .time = &(const flesh_effect_time){.carry = contact_carry, .next_event = contact_next_event},
    .barrier = &flesh_contact_barrier,
    .figures = &(const flesh_effect_figures){.report_names = contact_report_names, .report = contact_report,
                                             .memory = flesh_contact_memory},
    .library = &(const flesh_effect_private){
        .evaluate = contact_evaluate, .predict = flesh_contact_predict, .predictions = flesh_contact_predictions,
        .partials = &(const flesh_effect_partials){.couple = contact_couple},
        .ranks = &(const flesh_effect_ranks){.restrict_to_part = flesh_contact_restrict, .count = flesh_contact_count,
                                             .take = flesh_contact_take, .report_part = contact_report_part,
                                             .report_whole = contact_report_whole}},
};
