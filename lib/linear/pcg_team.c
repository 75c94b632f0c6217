/* pcg_team.c: conjugate gradients of several ranks, arranged so that an iteration has one sum over all ranks (Chronopoulos
 * & Gear 1989): it multiplies A by u = M^-1 r and not by the direction p, and A p follows as s = A u + beta s.
 *
 * The sum has all that an iteration needs:
 * - r.u, u.A u and u.s, from which p.A p follows for the present p, also where rounding of M leaves directions not quite
 *   conjugate;
 * - products of r, A u and s with each other, from which the next residual's norm follows before that residual is made. The
 *   norm itself is summed up where it decides that the solve is over;
 * - P^T A u, from which the coarse level's next load P^T r follows: it is a recurrence, too. Its errors of single precision
 *   are relative to past residuals, so it is computed anew when r has become much smaller than these.
 *
 * u is consistent, and so are x and p. r, A u and s are collected, zero at ghosts. An iteration has two exchanges: the
 * ranks' parts of u, and A u, which is sent to all whose overlap has a node, so that r follows there as it does at its
 * owner. While the first is on its way, the coarse level is solved; while the second is, its next load is made.
 *
 * In single precision vectors are those of a scaled system, as on one rank (pcg.c). */
#include "linear/pcg_team.h"

#include <assert.h>
#include <math.h>

#include "linear/overlap_vectors.h"

/* Products of r, A u and s; the weighted ones come after them. */
enum { RR, RW, RS, WW, WS, SS, PRODUCTS, RU = 2 * PRODUCTS, US, UW, STOPS, SUMS };

static_assert((int)SUMS <= (int)FLESH_PCG_SUMS, "room for all sums");

/* Ratio of r to its size when the coarse load was computed, at which the load is computed anew. */
static const double FRESH = 1e-3;

typedef struct iteration {
  flesh_pcg_work *work;
  double *sums;                   /* [SUMS], followed by [unknowns] of P^T A u */
  double *load, *load_of_s;       /* [unknowns] P^T r, P^T s */
  const flesh_overlap *overlap;   /* the preconditioner's, in which r is kept, too; NULL: it has none */
  int unknowns;                   /* unknowns of the coarse level; 0: it has no part in this, or there is none */
  double norm, largest;           /* norm of r, and its largest since the load was computed */
} iteration;

/* Advances r, x and p by one step, with the last u and A u. */
static inline __attribute__((always_inline)) void advance_nodes(const flesh_pcg_work *w, int begin, int end, int single)
{
  const flesh_pcg_space *self = w->space;
  for (int i = begin; i < end; i++) {
    flesh_pcg_put(self->p, single, i, flesh_pcg_get(self->u, single, i) + w->beta * flesh_pcg_get(self->p, single, i));
    flesh_pcg_put(self->s, single, i, flesh_pcg_get(self->z, single, i) + w->beta * flesh_pcg_get(self->s, single, i));
    self->x[i] += w->downhill * flesh_pcg_get(self->p, single, i);
    const flesh_double4 r = flesh_pcg_get(self->r, single, i) - w->alpha * flesh_pcg_get(self->s, single, i);
    flesh_pcg_put(self->r, single, i, r);
    if (!single) self->rounded[i] = FLESH_LANES_NARROW(w->to_round * r);
  }
}

static void advance(void *data, int chunk)
{
  const flesh_pcg_work *w = data;
  int begin, end;
  flesh_pcg_range(w->space, chunk, &begin, &end);
  if (w->space->single) advance_nodes(w, begin, end, 1);
  else advance_nodes(w, begin, end, 0);
}

/* Receives the preconditioner's result in u. */
static void receive(void *data, int chunk)
{
  const flesh_pcg_work *w = data;
  flesh_float4 result[FLESH_PCG_CHUNK];
  void *u = w->space->u;
  int begin, end;
  flesh_pcg_range(w->space, chunk, &begin, &end);
  if (w->space->single) {
    flesh_preconditioner_result(w->request->preconditioner, begin, end, (float *)u + 4 * (size_t)begin);
    return;
  }
  flesh_preconditioner_result(w->request->preconditioner, begin, end, (float *)result);
  for (int i = begin; i < end; i++) flesh_pcg_put(u, 0, i, w->back * FLESH_LANES_WIDE(result[i - begin]));
}

static void round_product(void *data, int chunk)
{
  const flesh_pcg_work *w = data;
  const flesh_double4 *Au = w->space->z;
  int begin, end;
  flesh_pcg_range(w->space, chunk, &begin, &end);
  for (int i = begin; i < end; i++) w->space->rounded[i] = FLESH_LANES_NARROW(w->to_round * Au[i]);
}

static double sum_of_lanes(flesh_double4 x) { return (x[0] + x[1]) + x[2]; }

static void add_products(const flesh_double4 v[3], flesh_double4 q, flesh_double4 *sums)
{
  for (int a = 0, k = 0; a < 3; a++)
    for (int b = a; b < 3; b++) sums[k++] += v[a] * v[b] * q;
}

/* Sums products over a chunk, into sums[chunk * SUMS]. */
static inline __attribute__((always_inline)) void multiply_nodes(const flesh_pcg_work *w, int chunk, int single)
{
  const flesh_pcg_space *self = w->space;
  const flesh_double4 one = {1, 1, 1, 1};
  flesh_double4 sums[US + 1] = {{0}};
  double *to = self->sums + (size_t)SUMS * (size_t)chunk;
  int begin, end;
  flesh_pcg_range(self, chunk, &begin, &end);
  for (int i = begin; i < end; i++) {
    const flesh_double4 v[3] = {flesh_pcg_get(self->r, single, i), flesh_pcg_get(self->z, single, i),
                                flesh_pcg_get(self->s, single, i)},
                        u = flesh_pcg_get(self->u, single, i);
    add_products(v, one, sums);
    if (w->weights) add_products(v, self->weights[i] * self->weights[i], sums + PRODUCTS);
    sums[RU] += v[0] * u;
    sums[US] += u * v[2];
  }
  for (int k = 0; k <= US; k++) to[k] = sum_of_lanes(sums[k]);
  for (int k = 0; k < PRODUCTS && !w->weights; k++) to[PRODUCTS + k] = w->common * w->common * to[k];
}

static void multiply_vectors(void *data, int chunk)
{
  const flesh_pcg_work *w = data;
  if (w->space->single) multiply_nodes(w, chunk, 1);
  else multiply_nodes(w, chunk, 0);
}

/* Sums up over all ranks the products that an iteration needs. */
static void sum_up(iteration *now, double curvature, int stops)
{
  const flesh_pcg_space *self = now->work->space;
  double *sums = now->sums;
  flesh_threads_run(self->threads, self->chunks, multiply_vectors, now->work);
  for (int k = 0; k < SUMS; k++) sums[k] = 0;
  for (int chunk = 0; chunk < self->chunks; chunk++)
    for (int k = 0; k <= US; k++) sums[k] += self->sums[SUMS * chunk + k];
  sums[UW] = curvature;
  sums[STOPS] = stops;
  flesh_team_sum(self->team, SUMS + now->unknowns, sums);
}

/* Predicts the square of r - alpha (A u + beta s), plain or weighted. */
static double predicted(const double *products, double alpha, double beta)
{
  const double rs = products[RW] + beta * products[RS],
               ss = products[WW] + beta * (2 * products[WS] + beta * products[SS]);
  return fmax(0, products[RR] + alpha * (alpha * ss - 2 * rs));
}

/* Computes the residual's norms and the coarse load anew; overwrites A u, which is no longer needed. */
static double look(iteration *now)
{
  flesh_preconditioner_load(now->work->request->preconditioner, (const float *)now->work->space->rounded,
                            1 / now->work->to_round, now->sums + SUMS);
  sum_up(now, 0, 0);
  for (int k = 0; k < now->unknowns; k++) now->load[k] = now->sums[SUMS + k];
  now->norm = now->largest = sqrt(now->sums[RR]);
  return sqrt(now->sums[PRODUCTS + RR]);
}

/* Sends A u, which is partial, to its owners and to all whose overlap has it; meanwhile restricts it to the coarse level. */
static void collect(iteration *now)
{
  flesh_pcg_work *w = now->work;
  const flesh_pcg_space *self = w->space;
  if (!now->overlap) {
    const flesh_team *team = flesh_preconditioner_team(w->request->preconditioner);
    team->operations->add_ghosts(team->data, &(flesh_team_vector){3, 4, self->place, self->z, 0});
    return;
  }
  flesh_overlap_collect_begin(now->overlap, self->single, self->z);
  if (now->unknowns && !self->single) flesh_threads_run(self->threads, self->chunks, round_product, w);
  if (now->unknowns)
    flesh_preconditioner_load(w->request->preconditioner, self->single ? self->z : (const float *)self->rounded,
                              1 / w->to_round, now->sums + SUMS);
  flesh_overlap_collect_end(now->overlap, self->single, self->z);
}

/* Computes u, A u and the iteration's sums. */
static void precondition(iteration *now, int stops)
{
  flesh_pcg_work *w = now->work;
  flesh_pcg_space *self = w->space;
  const flesh_team *team = flesh_preconditioner_team(w->request->preconditioner);
  const float *r = (const float *)self->rounded;
  if (now->overlap) flesh_preconditioner_solve_for(w->request->preconditioner, r, now->load, w->to_round);
  else flesh_preconditioner_solve(w->request->preconditioner, r);
  flesh_threads_run(self->threads, self->chunks, receive, w);
  if (!now->overlap) team->operations->update_ghosts(team->data, &(flesh_team_vector){3, 4, self->place, self->u, 0});
  const double curvature =
      flesh_pcg_product(self, w->request->A, flesh_preconditioner_scale(w->request->preconditioner), NULL, self->u);
  collect(now);
  sum_up(now, curvature, stops);
}

/* Advances to the next residual; returns its weighted norm. */
static double descend_in_team(iteration *now)
{
  flesh_pcg_work *w = now->work;
  const flesh_pcg_space *self = w->space;
  for (int k = 0; k < now->unknowns; k++) {
    now->load_of_s[k] = now->sums[SUMS + k] + w->beta * now->load_of_s[k];
    now->load[k] -= w->alpha * now->load_of_s[k];
  }
  now->norm = sqrt(predicted(now->sums, w->alpha, w->beta));
  const double residual = sqrt(predicted(now->sums + PRODUCTS, w->alpha, w->beta));
  if (!self->single) w->to_round = flesh_power_to_one(now->norm);
  flesh_threads_run(self->threads, self->chunks, advance, w);
  if (now->overlap) flesh_overlap_advance(now->overlap, self->single, w->alpha, w->beta);
  now->largest = fmax(now->largest, now->norm);
  const int stale = now->unknowns && now->norm < FRESH * now->largest;
  return stale || residual <= w->request->tolerance ? look(now) : residual;
}

int flesh_pcg_in_team(flesh_pcg_work *w, flesh_pcg_result *result)
{
  enum { ASK_EVERY = 16 };
  const flesh_pcg_request *request = w->request;
  const int unknowns = flesh_preconditioner_unknowns(w->request->preconditioner);
  double *room = flesh_preconditioner_room(w->request->preconditioner), rz_before = 0, pMp = 0, pAp = 0;
  iteration now = {w, room, room + SUMS + unknowns, room + SUMS + 2 * unknowns,
                   flesh_preconditioner_overlap(w->request->preconditioner), unknowns, 0, 0};
  const double scale = flesh_preconditioner_scale(w->request->preconditioner);
  int last = request->max_iterations, status = FLESH_NOT_CONVERGED, asked = FLESH_OK;
  for (int k = 0; k < unknowns; k++) now.load_of_s[k] = 0;
  w->alpha = w->beta = w->downhill = 0;
  flesh_threads_run(w->space->threads, w->space->chunks, advance, w);
  if (now.overlap) flesh_overlap_keep(now.overlap, w->space->single, w->space->r);
  result->first = result->residual = look(&now);
  if (result->residual <= request->tolerance) return FLESH_OK;
  while (result->iterations < last) {
    const int asks = request->stop && result->iterations % ASK_EVERY == 0;
    if (asks) asked = request->stop(request->stop_data);
    w->back = w->space->single ? 1 : scale / w->to_round;
    precondition(&now, asked != FLESH_OK);
    if (now.sums[STOPS] > 0) return flesh_team_agree(w->space->team, asked);
    const double rz = now.sums[RU], beta = w->beta = result->iterations ? rz / rz_before : 0;
    pAp = now.sums[UW] + beta * (2 * now.sums[US] + beta * pAp);
    /* A direction without curvature is the last one. */
    if (!(fabs(rz) < INFINITY && fabs(pAp) < INFINITY))
      return status == FLESH_NOT_POSITIVE ? status : FLESH_NONFINITE;
    pMp = rz + beta * beta * pMp;
    if (!(pAp > FLESH_PCG_FLAT * pMp) && status == FLESH_NOT_CONVERGED) {
      status = FLESH_NOT_POSITIVE;
      if (request->after_indefinite == 0) break;
      if (request->after_indefinite < request->max_iterations - result->iterations)
        last = result->iterations + request->after_indefinite;
    }
    w->alpha = rz / pAp;
    w->downhill = status == FLESH_NOT_POSITIVE ? rz / fmax(fabs(pAp), pMp) : w->alpha;
    result->iterations++;
    result->residual = descend_in_team(&now);
    w->downhill = 0; /* x already includes it */
    if (result->residual <= request->tolerance) return status == FLESH_NOT_POSITIVE ? status : FLESH_OK;
    rz_before = rz;
  }
  return status;
}
