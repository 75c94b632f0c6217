/* part_weights.c: how often errors of each connected part of a body count.
 *
 * If nothing holds a part that may touch something, along one axis at least or about its pins, each bounce also turns errors
 * of its vibrations into momentum, which carries the part on for a time T. A bounce at the speed v excites vibrations of v P,
 * 2 pi P being the part's period: an error of the share s of these is an error s v of the velocity, which leads the part s v
 * T = (s v P) T/P astray. So errors count T/P times. A part that welds and joints tie to a held part is held, too.
 *
 * T is the time in which the part goes its own length L at the largest speed so far, L/v: a part that has come to rest is no
 * reason for shorter steps. Where parts can touch only each other, v is relative to their mean. But a load that accelerates
 * the part by g ends a flight after 2 v/g, v being the speed along the load, and all flights, each by a factor r as fast as
 * the one before, after 2 v/(g (1 - r)): bodies that fall low are soon at rest again. So are bodies that are pressed between
 * others, by forces that cancel each other: g is the acceleration by these forces, where that is larger. A bounce lasts for
 * half a period, within which its speed is remembered.
 *
 * Contact begins between stages, and those after it may see smooth forces: a falling coil passed in one step through dozens
 * of bounces, whose error was 60 times its estimate. So a tenth of the first impulse of a held part counts as an error.
 *
 * Errors of positions count at most 20 times, as a stiff part's vibrations need not be resolved. But errors of impulses are
 * momentum all the same, and lead the part astray for T; so do those by residuals and friction if it flies on for hundreds of
 * its periods, or turns on for as long about the pins that hold it. */
#include "time/part_weights.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "math/mat3.h"
#include "system/one_effect.h"
#include "system/system.h"
#include "system/velocity_scale.h"

static const double most_times = 20; /* that errors of positions count */
static const double stiff = 200;     /* periods over 2 pi that a stiff part flies on for at least */
static const double lengths = 3;     /* own lengths that a stiff part flies on for at least if nothing may touch it */
static const double most_steps = 1000; /* steps whose residuals add up, at most */
static const double bounces = 4;     /* 1/(1 - r), chosen on blocks that slide and that lie on each other */
static const double unseen = 0.1;    /* share of the error that a step may make: smaller vibrations make no error of it */
static const double unresolved = 0.1; /* share of an impulse that may be an error where contact begins */
enum { SUMS = 21 }; /* over a part */

int flesh_part_weights_create(const flesh_rigid_parts *parts, flesh_part_weights *weights)
{
  const int count = parts->count < 1 ? 1 : parts->count;
  *weights = (flesh_part_weights){.parts = parts, .count = count, .of = calloc((size_t)count, sizeof *weights->of),
                                  .sums = calloc((size_t)count * SUMS, sizeof *weights->sums),
                                  .tied = calloc((size_t)count, sizeof *weights->tied)};
  if (weights->of && weights->sums && weights->tied) return FLESH_OK;
  return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d parts of a body", count);
}

void flesh_part_weights_clear(flesh_part_weights *weights)
{
  free(weights->of);
  free(weights->sums);
  free(weights->tied);
  *weights = (flesh_part_weights){0};
}

void flesh_part_weights_archive(flesh_part_weights *weights, flesh_archive *archive)
{
  flesh_archive_bytes(archive, weights->of, (size_t)weights->count * sizeof *weights->of);
  FLESH_ARCHIVE(archive, weights->meets);
  FLESH_ARCHIVE(archive, weights->forget);
  FLESH_ARCHIVE(archive, weights->stages);
}

/* Returns the sums [SUMS] of a node's part; NULL: the node has none, or is another rank's. */
static double *sums_of(const flesh_part_weights *weights, int node)
{
  const int part = node < weights->parts->own ? flesh_part_of(weights, node) : -1;
  return part < 0 ? NULL : weights->sums + SUMS * part;
}

static void clear_sums(const flesh_part_weights *weights, double value)
{
  for (int k = 0; k < SUMS * weights->count; k++) weights->sums[k] = value;
}

/* Finds the lengths of parts, and in u [3*nodes] incompressible bending of each. */
static void bend(flesh_part_weights *weights, const flesh_system *system, double *u)
{
  const flesh_rigid_parts *parts = weights->parts;
  const double *X = flesh_mesh_positions(parts->mesh);
  const int nodes = flesh_system_unknowns(system) / 3;
  clear_sums(weights, -INFINITY);
  for (int i = 0; i < nodes; i++) {
    double *box = sums_of(weights, i); /* -least, most: the largest over all ranks is the part's */
    for (int c = 0; box && c < 3; c++) {
      box[c] = fmax(box[c], -X[3 * i + c]);
      box[3 + c] = fmax(box[3 + c], X[3 * i + c]);
    }
  }
  flesh_team_largest(parts->team, SUMS * weights->count, weights->sums);
  for (int k = 0; k < SUMS * weights->count; k++)
    if (k % SUMS < 3) weights->sums[k] *= -1;
  for (int p = 0; p < weights->count; p++) {
    const double *box = weights->sums + SUMS * p;
    weights->of[p].length = fmax(box[3] - box[0], fmax(box[4] - box[1], box[5] - box[2]));
  }
  for (int i = 0; i < nodes; i++) {
    const int part = flesh_part_of(weights, i);
    for (int c = 0; c < 3; c++) u[3 * i + c] = 0;
    if (part >= 0) flesh_bent_shape(weights->sums + SUMS * part, X + 3 * i, u + 3 * i);
  }
}

/* Finds parts that welds, joints and the like tie to each other, also by way of other ranks. */
static void tie(flesh_part_weights *weights, const flesh_system *system)
{
  int *tied = weights->tied, changed;
  for (int p = 0; p < weights->count; p++) tied[p] = p;
  for (int k = 0; k < flesh_system_effect_count(system); k++) {
    const flesh_effect *effect = flesh_system_effect(system, k);
    const flesh_effect_operations *operations = effect->operations;
    if (operations->role != FLESH_ROLE_OTHER || !operations->cells) continue;
    const flesh_cells *cells = operations->cells(effect);
    const int m = cells ? cells->nodes_per_cell : 1;
    for (int a = 0; cells && a < cells->count * m; a++) {
      const int first = flesh_part_of(weights, cells->nodes[a - a % m]), part = flesh_part_of(weights, cells->nodes[a]);
      if (first >= 0 && part >= 0) flesh_sets_join(tied, first, part);
    }
  }
  do {
    changed = 0;
    for (int p = 0; p < weights->count; p++) weights->sums[p] = -flesh_set_of(tied, p);
    flesh_team_largest(weights->parts->team, weights->count, weights->sums);
    for (int p = 0; p < weights->count; p++) {
      changed |= flesh_set_of(tied, p) != (int)-weights->sums[p];
      flesh_sets_join(tied, p, (int)-weights->sums[p]);
    }
  } while (flesh_team_any(weights->parts->team, changed));
  for (int p = 0; p < weights->count; p++) tied[p] = flesh_set_of(tied, p);
}

/* Computes the forces of elasticity at X + scale u, into r. */
static int strain(const flesh_part_weights *weights, const flesh_system *system, const double *u, double scale, double *x,
                  double *r)
{
  const double *X = flesh_mesh_positions(weights->parts->mesh);
  const int n = flesh_system_unknowns(system);
  for (int d = 0; d < n; d++) x[d] = X[d] + scale * u[d];
  const flesh_point point = flesh_point_at(0, x, u, u);
  return flesh_system_roles_residual(system, FLESH_ROLE_BIT(FLESH_ROLE_ELASTICITY), &point, r);
}

void flesh_part_weights_measure(flesh_part_weights *weights, const flesh_system *system, double length, double period,
                                double *const room[3])
{
  static const double little = 1e-6; /* strain */
  const double scale = little / length;
  double *u = room[0], *r = room[2];
  const flesh_part_weight like_all = {.length = length, .period = period, .lasts = period, .times = 1, .drifts = period};
  for (int p = 0; p < weights->count; p++) weights->of[p] = like_all;
  if (weights->count == 1) return;
  tie(weights, system);
  bend(weights, system, u);
  clear_sums(weights, 0); /* sums of u.K u, masses, u.M u, M u */
  for (int sign = -1; sign <= 1; sign += 2) {
    if (strain(weights, system, u, sign * scale, room[1], r)) return;
    for (int d = 0; d < flesh_system_unknowns(system); d++) {
      double *sums = sums_of(weights, d / 3);
      if (sums) sums[0] += sign * u[d] * r[d] / (2 * scale);
    }
  }
  for (int d = 0; d < flesh_system_unknowns(system); d++) {
    double *sums = sums_of(weights, d / 3);
    if (!sums) continue;
    const double Mu = weights->parts->mass[d / 3] * u[d];
    sums[1] += d % 3 ? 0 : weights->parts->mass[d / 3];
    sums[2] += u[d] * Mu;
    sums[3 + d % 3] += Mu;
  }
  flesh_team_sum(weights->parts->team, SUMS * weights->count, weights->sums);
  for (int p = 0; p < weights->count; p++) {
    const double *s = weights->sums + SUMS * p;
    const double bent = s[2] - (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]) / s[1]; /* without its mean, which is a rigid motion */
    if (s[0] > 0 && bent > 0) weights->of[p].period = weights->of[p].lasts = sqrt(bent / s[0]);
  }
  for (int p = 0; p < weights->count; p++)
    if (weights->tied[p] != p) weights->of[p].lasts = weights->of[weights->tied[p]].lasts = period;
}

/* Returns whether parts may touch only each other. */
static int meets_parts(const flesh_system *system)
{
  int meets = 1;
  for (int k = 0; k < flesh_system_effect_count(system); k++) {
    const flesh_effect_operations *operations = flesh_system_effect(system, k)->operations;
    if (operations->role == FLESH_ROLE_CONTACT) meets &= operations->barrier && operations->barrier->coupled;
  }
  return meets;
}

/* Adds the constraint of component c of the place d to the Gram matrix [6][6], by upper rows, of all such constraints on
 * translations and rotations. */
static void add_constraint(const double d[3], int c, double *gram)
{
  double row[6] = {0};
  row[c] = 1;
  row[3 + (c + 1) % 3] = d[(c + 2) % 3];
  row[3 + (c + 2) % 3] = -d[(c + 1) % 3];
  for (int i = 0; i < 6; i++)
    for (int j = i; j < 6; j++) *gram++ += row[i] * row[j];
}

/* Returns whether constraints of that Gram matrix leave no rigid motion: whether it is positive definite. */
static int clamps(const double *gram)
{
  double a[6][6], trace = 0;
  for (int i = 0; i < 6; trace += a[i][i], i++)
    for (int j = i; j < 6; j++) a[i][j] = *gram++;
  for (int k = 0; k < 6; k++) {
    if (!(a[k][k] > 1e-10 * trace)) return 0;
    for (int i = k + 1; i < 6; i++)
      for (int j = i; j < 6; j++) a[i][j] -= a[k][i] * a[k][j] / a[k][k];
  }
  return 1;
}

/* Finds the held parts that may rotate, as on a line of pins; `fixed` [3*nodes]: the constrained dofs. */
static void find_turning(flesh_part_weights *weights, const uint8_t *fixed)
{
  int held = 0;
  for (int p = 0; p < weights->count; p++) weights->of[p].turns = 0;
  for (int p = 0; p < weights->count; p++) held |= weights->of[p].held > 0;
  if (!held) return;
  const flesh_rigid_parts *parts = weights->parts;
  const double *X = flesh_mesh_positions(parts->mesh);
  double centre[3];
  clear_sums(weights, 0);
  for (int p = 0; p < weights->count; p++) {
    flesh_rigid_parts_extent(parts, weights->tied[p], X, centre);
    for (int k = parts->first[p]; k < parts->first[p + 1]; k++) {
      const int i = parts->nodes[k];
      double d[3];
      for (int c = 0; c < 3; c++) d[c] = (X[3 * i + c] - centre[c]) / weights->of[weights->tied[p]].length;
      for (int c = 0; c < 3 && i < parts->own; c++)
        if (fixed[3 * i + c]) add_constraint(d, c, weights->sums + SUMS * weights->tied[p]);
    }
  }
  flesh_team_sum(parts->team, SUMS * weights->count, weights->sums);
  for (int p = 0; p < weights->count; p++)
    weights->of[p].turns = weights->of[p].held > 0 && !clamps(weights->sums + SUMS * weights->tied[p]);
}

void flesh_part_weights_hold(flesh_part_weights *weights, const flesh_system *system, double t)
{
  uint8_t *fixed = weights->parts->constrained;
  const int axes = flesh_system_holds(system, t);
  weights->meets = !flesh_team_any(weights->parts->team, axes) && meets_parts(system);
  clear_sums(weights, 0); /* whether something holds a part along each axis */
  for (int c = 0; c < 3; c++) weights->sums[c] = weights->count == 1 && axes >> c & 1;
  flesh_system_fixed(system, t, fixed);
  for (int d = 0; weights->count > 1 && axes && d < flesh_system_unknowns(system); d++) {
    double *sums = sums_of(weights, d / 3);
    if (sums && fixed[d]) sums[d % 3] = 1;
  }
  flesh_team_largest(weights->parts->team, SUMS * weights->count, weights->sums);
  for (int k = 0; k < 3 * weights->count; k++) {
    double *all = &weights->sums[SUMS * weights->tied[k / 3] + k % 3];
    *all = fmax(*all, weights->sums[SUMS * (k / 3) + k % 3]);
  }
  for (int p = 0; p < weights->count; p++) {
    const double *along = weights->sums + SUMS * weights->tied[p];
    weights->of[p].held = fmin(along[0], fmin(along[1], along[2]));
    weights->of[p].loose = !(fmax(along[0], fmax(along[1], along[2])) > 0);
  }
  find_turning(weights, fixed);
}

void flesh_part_weights_clear_contact(flesh_part_weights *weights)
{
  for (int p = 0; p < weights->count; p++)
    for (int k = 0; k < 5; k++) weights->of[p].push[k] = 0;
  weights->stages = 0;
}

void flesh_part_weights_touch(flesh_part_weights *weights, const double *forces)
{
  for (int i = 0; i < weights->parts->own; i++) {
    const int p = flesh_part_of(weights, i);
    const double *force = forces + 3 * i;
    if (p < 0) continue;
    for (int c = 0; c < 3; c++) weights->of[p].push[c] += force[c];
    weights->of[p].push[3] += sqrt(flesh_vec3_dot(force, force));
    for (int c = 0; c < 3; c++)
      if (!weights->parts->constrained[3 * i + c]) weights->of[p].push[4] += force[c] * force[c] / weights->parts->mass[i];
  }
  weights->stages++;
}

void flesh_part_weights_accept(flesh_part_weights *weights, double h)
{
  weights->forget = h;
  for (int p = 0; p < weights->count; p++) weights->sums[p] = weights->of[p].push[3];
  flesh_team_largest(weights->parts->team, weights->count, weights->sums);
  for (int p = 0; p < weights->count; p++) weights->of[p].touched = weights->sums[p] > 0;
}

double flesh_part_weights_met(const flesh_part_weights *weights, double h, double mass)
{
  double square = 0;
  for (int p = 0; p < weights->count; p++)
    if (!weights->of[p].touched && weights->of[p].held > weights->of[p].turns)
      square += pow(unresolved * h * weights->of[p].drifts, 2) * weights->of[p].push[4] / (weights->stages * mass);
  flesh_team_sum(weights->parts->team, 1, &square);
  return sqrt(square);
}

/* Adds up a part's sums [SUMS]: mass, load, forces of contact, the sum of their sizes, and m v v. */
typedef struct figures {
  double mass, load[3], push[3], pushes, vv[6]; /* vv: 11, 12, 13, 22, 23, 33 */
} figures;

static void add_node(double mass, const double v[3], const double load[3], figures *f)
{
  f->mass += mass;
  for (int c = 0, k = 0; c < 3; c++) {
    f->load[c] += load[c];
    for (int b = c; b < 3; b++) f->vv[k++] += mass * v[c] * v[b];
  }
}

/* Finds the speed of a part, by root mean square, and along its load if there is one. */
static void find_speeds(const figures *f, double *speed, double *along)
{
  const double *l = f->load, *q = f->vv, pull = flesh_vec3_dot(l, l);
  *speed = *along = sqrt((q[0] + q[3] + q[5]) / f->mass);
  if (pull > 0)
    *along = sqrt(fmax(0, l[0] * l[0] * q[0] + l[1] * l[1] * q[3] + l[2] * l[2] * q[5] +
                          2 * (l[0] * l[1] * q[1] + l[0] * l[2] * q[2] + l[1] * l[2] * q[4])) / (pull * f->mass));
}

/* Returns the acceleration that ends flights: of a load, or of forces that cancel each other. */
static double find_press(const figures *f)
{
  const double all[3] = {f->load[0] + f->push[0], f->load[1] + f->push[1], f->load[2] + f->push[2]};
  const double pull = sqrt(flesh_vec3_dot(f->load, f->load));
  return fmax(pull, (pull + f->pushes - sqrt(flesh_vec3_dot(all, all))) / 2) / f->mass;
}

/* Finds the weights of a part's errors in a step that may err by `allowed`, m, and within h s of which the part begins
 * to fall. */
static void weigh(flesh_part_weight *part, const figures *f, double h, double forget, double allowed, int touches)
{
  double speed, along;
  find_speeds(f, &speed, &along);
  part->fastest = fmax(part->fastest, speed);
  part->lately = fmax(along, part->lately * exp(-forget / (M_PI * part->period)));
  const double press = find_press(f), far = part->length / part->fastest;
  const double low = press > 0 ? 2 * bounces * (part->lately / press + h) : INFINITY;
  const double flight = fmax(0, fmin(far, low) - stiff * part->period);
  const int held = part->held > part->turns;
  const int seen = (part->fastest + press * h) * part->period > unseen * allowed;
  part->flies = held || !(part->fastest > 0) ? 0 : touches ? flight : lengths * flight;
  part->drifts = fmax(part->period, held || !seen ? 0 : fmin(far, low));
  part->times = fmin(most_times, part->drifts / part->period);
}

/* Finds the velocity that counts as rest: 0, or the mean of all parts if these may touch only each other. */
static void find_frame(const flesh_part_weights *weights, const double *v, double frame[3])
{
  const double *mass = weights->parts->mass;
  double sums[4] = {0};
  for (int i = 0; i < weights->parts->own && weights->meets; i++) {
    if (flesh_part_of(weights, i) < 0) continue;
    for (int c = 0; c < 3; c++) sums[c] += mass[i] * v[3 * i + c];
    sums[3] += mass[i];
  }
  if (weights->meets) flesh_team_sum(weights->parts->team, 4, sums);
  for (int c = 0; c < 3; c++) frame[c] = sums[3] > 0 ? sums[c] / sums[3] : 0;
}

double flesh_part_weights_aim(flesh_part_weights *weights, const flesh_system *system, const flesh_state *state, double h,
                              double allowed, int flights, double *load)
{
  const flesh_point point = flesh_point_at(state->t, state->x, state->v, state->v);
  const int n = flesh_system_unknowns(system);
  const int touches = flesh_system_has_role(system, FLESH_ROLE_CONTACT);
  double largest = 1, held = !touches, frame[3];
  weights->flies = 0;
  for (int p = 0; p < weights->count; p++) {
    weights->of[p].times = 1; /* what it counted before it was held, if it is, is over */
    weights->of[p].drifts = weights->of[p].period;
    weights->of[p].flies = 0;
    held = fmin(held, weights->of[p].held - weights->of[p].turns);
  }
  if (held > 0) return 1;
  find_frame(weights, state->v, frame);
  clear_sums(weights, 0);
  if (flesh_system_load(system, &point, load)) memset(load, 0, (size_t)n * sizeof *load);
  for (int i = 0; i < n / 3; i++) {
    figures *f = (figures *)sums_of(weights, i);
    const double v[3] = {state->v[3 * i] - frame[0], state->v[3 * i + 1] - frame[1], state->v[3 * i + 2] - frame[2]};
    if (f) add_node(weights->parts->mass[i], v, load + 3 * i, f);
  }
  for (int p = 0; p < weights->count && weights->stages > 0; p++)
    for (int k = 0; k < 4; k++) weights->sums[SUMS * p + 4 + k] = weights->of[p].push[k] / weights->stages;
  flesh_team_sum(weights->parts->team, SUMS * weights->count, weights->sums);
  for (int p = 0; p < weights->count; p++) {
    weigh(&weights->of[p], (const figures *)(weights->sums + SUMS * p), h, weights->forget, allowed, touches);
    weights->flies = fmax(weights->flies, weights->of[p].flies);
    if (!touches && !flights) weights->of[p].flies = 0;
    if (touches) largest = fmax(largest, weights->of[p].times);
  }
  weights->forget = 0;
  return largest;
}

void flesh_part_weights_count(const flesh_part_weights *weights, const double *e, int velocities, double *weighted)
{
  for (int i = 0; i < flesh_mesh_node_count(weights->parts->mesh); i++) {
    const int p = flesh_part_of(weights, i);
    const double times = p < 0 ? 0 : velocities ? weights->of[p].drifts : weights->of[p].times;
    for (int c = 0; c < 3; c++) weighted[3 * i + c] = times * e[3 * i + c];
  }
}

void flesh_part_weights_add_up(const flesh_part_weights *weights, const double *e, int counted, double radians, double *sums)
{
  for (int i = 0; i < flesh_mesh_node_count(weights->parts->mesh); i++) {
    const int p = flesh_part_of(weights, i);
    const double times = p < 0 ? 1 : weights->of[p].times, all = hypot(times, sqrt(times) * radians);
    const double factor = p < 0 ? 0 : counted ? all / times : all;
    for (int c = 0; c < 3; c++) sums[3 * i + c] = factor * e[3 * i + c];
  }
}

/* Returns for how long the velocity that a residual causes in a stage by g leads a part astray. If something may touch,
 * residuals add up like impulses, by up to `most` times as much as errors; elsewhere (0), in free flight, less
 * coherently. Residuals of stiff parts add up for as long as these fly. */
static double of_residuals(const flesh_part_weight *part, double g, double most)
{
  const double counts = most > 0 ? part->times * fmin(part->times, most) : pow(part->times, 2. / 3);
  return fmax(counts * fmax(g, part->lasts), fmin(part->flies, most_steps * g));
}

double flesh_part_weights_of_residuals(const flesh_part_weights *weights, double g, double most, double *of)
{
  double least = INFINITY;
  for (int p = 0; p < weights->count; p++) least = fmin(least, of_residuals(&weights->of[p], g, most));
  for (int i = 0; i < flesh_mesh_node_count(weights->parts->mesh) && weights->count > 1; i++) {
    const int p = flesh_part_of(weights, i);
    const double counts = p < 0 ? 1 : of_residuals(&weights->of[p], g, most) / least;
    for (int c = 0; c < 3; c++) of[3 * i + c] = counts;
  }
  return least;
}
