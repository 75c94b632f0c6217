/* derivative_check.c: fourth-order central differences of an effect's potential, energy and residual. */
#include "system/derivative_check.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/effect.h"
#include "effect/environment.h"
#include "linear/block_matrix.h"
#include "system/pattern.h"

const flesh_shift flesh_check_shifts[FLESH_CHECK_SHIFTS] = {{.x = 1}, {.x = 0.5, .v = 60, .a = 7200}};

enum { DIRECTIONS = 2, POWER_STEPS = 80 };
/* The last two are for forces: their slopes have kinks, and many components, of which rounding hides no error. */
static const double step_lengths[] = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8};
enum { STEP_LENGTHS = sizeof step_lengths / sizeof step_lengths[0], POTENTIAL_STEP_LENGTHS = STEP_LENGTHS - 2 };

/* Weights of differences: f'(0) is the sum of weight * f(offset * s) / s. */
static const double offsets[] = {-2, -1, 1, 2}, weights[] = {1.0 / 12, -2.0 / 3, 2.0 / 3, -1.0 / 12};

typedef struct check {
  const flesh_effect *effect;
  size_t unknowns;
  double edge, t;
  const double *x;
  double *v, *a;             /* the point */
  double *x_lag, *v_lag;     /* a state near x, and an arbitrary one */
  double *w, *x_frozen, *v_frozen; /* frozen state, as a change w of the unknown from the point */
  double *multipliers;       /* for an effect that has multipliers, a tenth of its penalty in size */
  double *xs, *vs, *as;      /* the displaced point */
  double *du, *r, *dr, *Kdu; /* a direction, and the differences along it */
  unsigned long long random;
  int zero;                  /* 1: all residuals so far were 0 */
  int physical;              /* 1: the energy is checked, at rest, with nothing lagged, frozen or enforced */
  flesh_environment environment; /* with the effect's caches as in a run, if it needs any */
  flesh_pattern pattern;
  int *slots;
  flesh_block_matrix K;
} check;

static double uniform(unsigned long long *state) /* splitmix64; [-1, 1) */
{
  unsigned long long z = (*state += 0x9e3779b97f4a7c15ULL);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL, z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return (double)((z ^ (z >> 31)) >> 11) * 0x1p-52 - 1;
}

static void randomize(check *c, double *vector, double size)
{
  for (size_t d = 0; d < c->unknowns; d++) vector[d] = size * uniform(&c->random);
}

static double dot(const check *c, const double *p, const double *q)
{
  double sum = 0;
  for (size_t d = 0; d < c->unknowns; d++) sum += p[d] * q[d];
  return sum;
}

static double dot_absolute(const check *c, const double *p, const double *q)
{
  double sum = 0;
  for (size_t d = 0; d < c->unknowns; d++) sum += fabs(p[d] * q[d]);
  return sum;
}

/* Returns the point after a change s*du of the unknown; v and a are 0 where the shift says statics, as an unknown that does
 * not move them gives no potential for terms that depend on them. */
static flesh_point moved(check *c, const flesh_shift *shift, double s)
{
  for (size_t d = 0; d < c->unknowns; d++) {
    c->xs[d] = c->x[d] + s * shift->x * c->du[d];
    c->vs[d] = shift->v != 0 ? c->v[d] + s * shift->v * c->du[d] : 0;
    c->as[d] = shift->a != 0 ? c->a[d] + s * shift->a * c->du[d] : 0;
    c->x_frozen[d] = c->x[d] + shift->x * c->w[d];
    c->v_frozen[d] = c->v[d] + shift->v * c->w[d];
  }
  flesh_point point = flesh_point_at(c->t, c->xs, c->vs, c->as);
  point.environment = &c->environment;
  if (c->physical) return point.lagged.x = c->x, point;
  point.lagged = (flesh_lagged){0, c->x_lag, c->v_lag};
  point.frozen = (flesh_frozen){c->x_frozen, shift->v != 0 ? c->v_frozen : NULL};
  point.multipliers = c->multipliers;
  point.penalty = 3;
  return point;
}

static int residual_at(check *c, const flesh_shift *shift, double s, double *r)
{
  flesh_point point = moved(c, shift, s);
  memset(r, 0, c->unknowns * sizeof *r);
  const int status = c->effect->operations->residual ? c->effect->operations->residual(c->effect, &point, r) : FLESH_OK;
  for (size_t d = 0; d < c->unknowns && c->zero; d++) c->zero = r[d] == 0;
  return status;
}

static double ratio(double error, double scale) { return error > 0 ? error / scale : error; }

/* Returns the ratio of an error of differences over s to `scale`, given the size of their terms: where the value should be
 * zero, rounding alone is no error. */
static double difference_ratio(double error, double scale, double terms, double s)
{
  double rounding = 32 * DBL_EPSILON * terms / fmax(s, 1e-6);
  return error <= rounding && scale <= rounding ? 0 : ratio(error, scale);
}

/* Checks the potential or, where c->physical says so, the energy. */
static int check_potential(check *c, const flesh_shift *shift, double *worst)
{
  const flesh_effect_operations *can = c->effect->operations;
  int status = residual_at(c, shift, 0, c->r), last = FLESH_OK;
  if (status) return status;
  double expected = dot(c, c->r, c->du), scale = dot_absolute(c, c->r, c->du), best = INFINITY;
  for (int l = 0; l < POTENTIAL_STEP_LENGTHS; l++) {
    double s = step_lengths[l], slope = 0, terms = 0;
    for (int k = 0; k < 4 && !status; k++) {
      flesh_point point = moved(c, shift, offsets[k] * s);
      double phi = 0, magnitude = 0;
      status = c->physical ? can->energy(c->effect, &point, &phi)
                           : can->potential(c->effect, &point, shift, &phi, &magnitude);
      slope += weights[k] * phi / s;
      terms = fmax(terms, fmax(magnitude, fabs(phi)));
    }
    if ((last = status) < 0) return status;
    status = FLESH_OK;
    if (last) continue; /* a shorter step may stay where there is a value, near an obstacle */
    best = fmin(best, difference_ratio(fabs(slope - expected), scale, terms, s));
  }
  if (last && best == INFINITY) return last;
  *worst = fmax(*worst, best);
  return FLESH_OK;
}

/* Assembles at the point after a change s*du. */
static int assemble(check *c, const flesh_shift *shift, double s)
{
  memset(c->K.values, 0, 9 * sizeof(double) * (size_t)c->K.row_start[c->K.rows]);
  if (!c->effect->operations->jacobian) return FLESH_OK;
  flesh_point point = moved(c, shift, s);
  return c->effect->operations->jacobian(c->effect, &point, shift, &c->K, c->slots);
}

static int check_jacobian(check *c, const flesh_shift *shift, double *worst)
{
  flesh_block_multiply(&c->K, c->du, c->Kdu);
  double scale = sqrt(dot(c, c->Kdu, c->Kdu)), best = INFINITY;
  int last = FLESH_OK;
  for (int l = 0; l < STEP_LENGTHS; l++) {
    double s = step_lengths[l], error = 0, terms = 0;
    memset(c->dr, 0, c->unknowns * sizeof *c->dr);
    last = FLESH_OK;
    for (int k = 0; k < 4; k++) {
      last = residual_at(c, shift, offsets[k] * s, c->r);
      if (last) break;
      for (size_t d = 0; d < c->unknowns; d++) c->dr[d] += weights[k] * c->r[d] / s;
      terms = fmax(terms, sqrt(dot(c, c->r, c->r)));
    }
    if (last < 0) return last;
    if (last) continue; /* as in check_potential */
    for (size_t d = 0; d < c->unknowns; d++) error += (c->dr[d] - c->Kdu[d]) * (c->dr[d] - c->Kdu[d]);
    best = fmin(best, difference_ratio(sqrt(error), scale, terms, s));
  }
  if (last && best == INFINITY) return last;
  *worst = fmax(*worst, best);
  return FLESH_OK;
}

/* Compares blocks of the cells' pairs that are set, whatever was in them, with blocks that are added. */
static int check_anew(check *c, const flesh_shift *shift, double *worst)
{
  const flesh_effect_operations *can = c->effect->operations;
  const size_t numbers = 9 * (size_t)c->K.row_start[c->K.rows], pairs = flesh_pattern_pairs(can->cells(c->effect));
  flesh_block_matrix K = c->K;
  K.values = flesh_calloc(numbers + 1, sizeof *K.values);
  if (!K.values) return flesh_fail(FLESH_ERR_MEMORY, "no memory to check an effect");
  for (size_t k = 0; k < 9 * pairs; k++) K.values[9 * (size_t)c->slots[k / 9] + k % 9] = NAN;
  const flesh_point point = moved(c, shift, 0);
  const int status = flesh_effect_private_of(c->effect)->jacobian_assign(c->effect, &point, shift, &K, c->slots);
  double error = 0, size = 0;
  for (size_t k = 0; k < numbers; k++) {
    error += (K.values[k] - c->K.values[k]) * (K.values[k] - c->K.values[k]);
    size += c->K.values[k] * c->K.values[k];
  }
  flesh_free(K.values);
  *worst = fmax(*worst, error < INFINITY ? ratio(sqrt(error), sqrt(size)) : INFINITY); /* else some are not numbers */
  return status;
}

/* Checks what solves assemble for an effect that predicts its forces: the derivative where it predicts the present forces,
 * as where the last matrix was almost here, and a function of the point alone until the next prediction. */
static int check_predicted(check *c, const flesh_shift *shift, double *worst)
{
  const size_t bytes = 9 * sizeof(double) * (size_t)c->K.row_start[c->K.rows];
  double *x_lag = c->x_lag, *before = flesh_malloc(bytes);
  int status = before ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory to check an effect");
  c->x_lag = (double *)c->x; /* read only */
  for (double s = 1e-12; s >= 0 && !status; s -= 1e-12) {
    flesh_effect_private_of(c->effect)->predict(c->effect, (flesh_point[]){moved(c, shift, s)});
    status = assemble(c, shift, s);
  }
  if (!status) memcpy(before, c->K.values, bytes);
  if (!status) assemble(c, shift, step_lengths[STEP_LENGTHS - 1]); /* it may have no value there */
  if (!status) status = assemble(c, shift, 0);
  if (!status && memcmp(before, c->K.values, bytes)) *worst = INFINITY;
  if (!status) status = check_jacobian(c, shift, worst);
  c->x_lag = x_lag;
  flesh_free(before);
  return status;
}

/* Compares residual and potential of one pass with those of two. */
static int check_evaluate(check *c, const flesh_shift *shift, double *worst)
{
  const flesh_effect_operations *can = c->effect->operations;
  const flesh_point point = moved(c, shift, 0);
  double phi = 0, size = 0, phi_both = 0, size_both = 0, error = 0;
  *worst = INFINITY; /* also for an effect without the two */
  if (!can->residual || !can->potential) return FLESH_OK;
  memset(c->r, 0, c->unknowns * sizeof *c->r);
  memset(c->dr, 0, c->unknowns * sizeof *c->dr);
  int status = can->residual(c->effect, &point, c->r);
  if (!status) status = can->potential(c->effect, &point, shift, &phi, &size);
  if (!status) status = flesh_effect_private_of(c->effect)->evaluate(c->effect, &point, shift, c->dr, &phi_both, &size_both);
  if (status) return status;
  for (size_t d = 0; d < c->unknowns; d++) error += (c->dr[d] - c->r[d]) * (c->dr[d] - c->r[d]);
  const double off = fabs(phi_both - phi) + fabs(size_both - size);
  if (error + off < INFINITY) /* else some are not numbers */
    *worst = fmax(ratio(sqrt(error), sqrt(dot(c, c->r, c->r))), ratio(off, size));
  return FLESH_OK;
}

/* Compares an effect's own product, by the argument, with differences along du, and the transposed product with that. */
static int check_argument(check *c, flesh_argument argument, double *worst)
{
  const flesh_effect_partials *own = flesh_effect_private_of(c->effect)->partials;
  flesh_point point = moved(c, &flesh_check_shifts[1], 0);
  const double **const states[] = {&point.lagged.x, &point.lagged.v, &point.frozen.x, &point.frozen.v, &point.v, &point.x};
  const double *base = *states[argument];
  const size_t bytes = c->unknowns * sizeof(double);
  double *product = c->Kdu, *sum = c->dr, *other = c->as, error = 0, terms = 0; /* a is not read */
  int status = FLESH_OK;
  memset(product, 0, bytes);
  own->multiply(c->effect, &point, argument, 0, 1, c->du, product);
  memset(sum, 0, bytes);
  double *varied = flesh_malloc(bytes + 1);
  if (!varied) return flesh_fail(FLESH_ERR_MEMORY, "no memory to check an effect");
  *states[argument] = varied;
  const double s = 1e-3;
  for (int k = 0; k < 4 && !status; k++) {
    for (size_t d = 0; d < c->unknowns; d++) varied[d] = base[d] + offsets[k] * s * c->du[d];
    memset(c->r, 0, bytes);
    status = c->effect->operations->residual(c->effect, &point, c->r);
    for (size_t d = 0; d < c->unknowns; d++) sum[d] += weights[k] * c->r[d] / s;
    terms = fmax(terms, sqrt(dot(c, c->r, c->r)));
  }
  *states[argument] = base;
  flesh_free(varied);
  for (size_t d = 0; d < c->unknowns; d++) error += (sum[d] - product[d]) * (sum[d] - product[d]);
  *worst = fmax(*worst, difference_ratio(sqrt(error), sqrt(dot(c, sum, sum)), terms, s));
  randomize(c, other, 1);
  const double expected = dot(c, product, other), size = dot_absolute(c, product, other);
  memset(sum, 0, bytes);
  own->multiply(c->effect, &point, argument, 1, 1, other, sum);
  *worst = fmax(*worst, ratio(fabs(dot(c, sum, c->du) - expected), size));
  return status;
}

static double diagonal_asymmetry(const flesh_block_matrix *K)
{
  double largest = 0, asymmetry = 0;
  for (int i = 0; i < K->rows; i++) {
    const double *B = K->values + 9 * (size_t)K->row_start[i];
    for (int e = 0; e < 9; e++) {
      largest = fmax(largest, fabs(B[e]));
      asymmetry = fmax(asymmetry, fabs(B[e] - B[3 * (e % 3) + e / 3]));
    }
  }
  return ratio(asymmetry, largest);
}

/* Iterates powers from du, of shift*I - K when `shift` is not 0, else of K; returns the final Rayleigh quotient of K. */
static double extreme_curvature(check *c, double shift, double *lowest)
{
  double quotient = 0;
  for (int step = 0; step < POWER_STEPS; step++) {
    double norm = sqrt(dot(c, c->du, c->du));
    if (!(norm > 0)) break;
    for (size_t d = 0; d < c->unknowns; d++) c->du[d] /= norm;
    flesh_block_multiply(&c->K, c->du, c->Kdu);
    quotient = dot(c, c->du, c->Kdu);
    *lowest = fmin(*lowest, quotient);
    for (size_t d = 0; d < c->unknowns; d++) c->du[d] = shift > 0 ? shift * c->du[d] - c->Kdu[d] : c->Kdu[d];
  }
  return quotient;
}

static double negative_curvature(check *c)
{
  double lowest = 0;
  randomize(c, c->du, 1);
  double largest = fabs(extreme_curvature(c, 0, &lowest));
  if (!(largest > 0)) return 0;
  randomize(c, c->du, 1);
  extreme_curvature(c, largest, &lowest);
  return lowest < 0 ? -lowest / largest : 0;
}

static int check_shift(check *c, int s, flesh_derivative_report *report)
{
  const flesh_effect_operations *operations = c->effect->operations;
  const flesh_effect_private *library = flesh_effect_private_of(c->effect);
  const flesh_shift *shift = &flesh_check_shifts[s];
  int status = assemble(c, shift, 0);
  if (status) return status;
  report->asymmetry = fmax(report->asymmetry, diagonal_asymmetry(&c->K));
  if (operations->jacobian && library->jacobian_assign && c->slots)
    status = check_anew(c, shift, &report->jacobian[s]);
  for (int d = 0; d < DIRECTIONS && !status; d++) {
    randomize(c, c->du, c->edge);
    if (operations->potential) status = check_potential(c, shift, &report->potential[s]);
    if (!status && operations->residual) status = check_jacobian(c, shift, &report->jacobian[s]);
    c->physical = s == 0 && operations->energy && operations->residual && !flesh_effect_in_time(c->effect)->carry;
    if (!status && c->physical) status = check_potential(c, shift, &report->potential[s]);
    c->physical = 0;
  }
  if (!status && c->environment.near && library->predict) status = check_predicted(c, shift, &report->jacobian[s]);
  const int multiplies = library->partials && library->partials->multiply && shift->v != 0;
  const int arguments = flesh_effect_has_trait(c->effect, FLESH_FREEZES) ? FLESH_ARGUMENTS : FLESH_OWN_V; /* K has x and v */
  for (int k = 0; k < arguments && !status && multiplies; k++)
    status = check_argument(c, (flesh_argument)k, &report->jacobian[s]);
  if (!status && library->evaluate) status = check_evaluate(c, shift, &report->evaluate[s]);
  if (status) return status;
  flesh_shift projected = *shift;
  projected.filter = 1;
  status = assemble(c, &projected, 0);
  if (!status) report->negative = fmax(report->negative, negative_curvature(c));
  return status;
}

/* Allocates vectors, and a run's caches of near pairs. */
static int check_open(check *c, const flesh_mesh *mesh)
{
  const flesh_effect_operations *operations = c->effect->operations;
  double **vectors[] = {&c->v,  &c->a,  &c->x_lag, &c->v_lag, &c->w, &c->x_frozen, &c->v_frozen,
                        &c->xs, &c->vs, &c->as,    &c->du,    &c->r, &c->dr,       &c->Kdu};
  int enough = 1, changed;
  for (size_t k = 0; k < sizeof vectors / sizeof vectors[0]; k++)
    enough &= (*vectors[k] = flesh_calloc(c->unknowns + 1, sizeof(double))) != NULL;
  const size_t tets = (size_t)flesh_mesh_tet_count(mesh);
  if (operations->constraints) enough &= (c->multipliers = flesh_malloc((tets + 1) * sizeof(double))) != NULL;
  if (!enough) return flesh_fail(FLESH_ERR_MEMORY, "no memory to check an effect");
  const flesh_effect_barrier *barrier = flesh_effect_as_barrier(c->effect);
  if (!barrier->remember) return FLESH_OK;
  const int status = barrier->remember(c->effect, NULL, &c->environment.near);
  return status || !barrier->follow ? status : barrier->follow(c->environment.near, 0, c->t, c->x, &changed);
}

/* Makes the matrix, with the pairs coupled at the point. */
static int make_matrix(check *c, const flesh_mesh *mesh)
{
  const int nodes = flesh_mesh_node_count(mesh);
  const flesh_effect_operations *operations = c->effect->operations;
  const flesh_cells *own = operations->cells ? operations->cells(c->effect) : NULL, *cells[2] = {own};
  int count = own != NULL, status = own ? flesh_pattern_check(operations->name, nodes, own) : FLESH_OK;
  const flesh_effect_barrier *barrier = flesh_effect_as_barrier(c->effect);
  if (!status && c->environment.near && barrier->coupled) {
    const flesh_point point = moved(c, &flesh_check_shifts[0], 0);
    status = barrier->coupled(c->effect, &point, NULL, &cells[count++]);
  }
  if (!status) status = flesh_pattern_create(nodes, count, cells, &c->pattern);
  if (!status && own) status = flesh_pattern_slots(&c->pattern, own, &c->slots);
  if (status) return status;
  double *values = flesh_calloc(9 * (size_t)c->pattern.row_start[nodes] + 1, sizeof *values);
  c->K = flesh_pattern_matrix(&c->pattern, values);
  return values ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory to check an effect");
}

static void choose_multipliers(check *c, int tets)
{
  if (!c->multipliers) return;
  c->effect->operations->constraints->stiffness(c->effect, c->multipliers);
  for (int k = 0; k < tets; k++) c->multipliers[k] *= 0.1 * uniform(&c->random);
}

static void check_close(check *c)
{
  if (c->environment.near) flesh_effect_as_barrier(c->effect)->forget(c->environment.near);
  flesh_pattern_clear(&c->pattern);
  flesh_free(c->slots);
  flesh_free(c->K.values);
  flesh_free(c->multipliers);
  double *vectors[] = {c->v,  c->a,  c->x_lag, c->v_lag, c->w, c->x_frozen, c->v_frozen,
                       c->xs, c->vs, c->as,    c->du,    c->r, c->dr,       c->Kdu};
  for (size_t k = 0; k < sizeof vectors / sizeof vectors[0]; k++) flesh_free(vectors[k]);
}

int flesh_effect_check_derivatives_or_zero(const flesh_effect *effect, const flesh_mesh *mesh, double t, const double *x,
                                           unsigned long long seed, flesh_derivative_report *report, int *zero)
{
  *report = (flesh_derivative_report){.potential = {NAN, NAN}, .jacobian = {NAN, NAN}, .evaluate = {NAN, NAN}};
  int status = flesh_effect_check_mesh(effect, mesh);
  if (status) return status;
  flesh_mesh_info info;
  flesh_mesh_inspect(mesh, &info);
  check c = {.effect = effect, .unknowns = 3 * (size_t)info.nodes, .edge = info.edge_mean, .t = t, .x = x,
             .random = seed, .zero = effect->operations->residual != NULL};
  const unsigned long said = flesh_fail_count();
  status = check_open(&c, mesh);
  if (!status) {
    randomize(&c, c.v, c.edge);
    randomize(&c, c.a, c.edge);
    /* The lagged state inverts no tet that the point does not, as energies may have no value there. */
    const double before = flesh_mesh_jacobian_bounds(mesh, x, NULL, NULL, NULL);
    double size = 0.2 * c.edge;
    do {
      randomize(&c, c.x_lag, size /= 2);
      for (size_t d = 0; d < c.unknowns; d++) c.x_lag[d] += x[d];
    } while (before > 0 && size > 1e-9 * c.edge && flesh_mesh_jacobian_bounds(mesh, c.x_lag, NULL, NULL, NULL) <= 0);
    randomize(&c, c.v_lag, c.edge);
    randomize(&c, c.w, 0.1 * c.edge);
    choose_multipliers(&c, flesh_mesh_tet_count(mesh));
    status = make_matrix(&c, mesh);
  }
  for (int s = 0; s < FLESH_CHECK_SHIFTS && !status; s++) status = check_shift(&c, s, report);
  check_close(&c);
  *zero = c.zero;
  return flesh_effect_returned(effect, said, status);
}

int flesh_effect_check_derivatives(const flesh_effect *effect, const flesh_mesh *mesh, double t, const double *x,
                                   unsigned long long seed, flesh_derivative_report *report)
{
  int zero = 0;
  FLESH_NEED({effect, "effect"}, {mesh, "mesh"}, {x, "x"}, {report, "report"});
  return flesh_effect_check_derivatives_or_zero(effect, mesh, t, x, seed, report, &zero);
}

int flesh_derivative_report_passes(const flesh_derivative_report *report, double tolerance)
{
  double worst = fmax(report->asymmetry, report->negative);
  for (int s = 0; s < FLESH_CHECK_SHIFTS; s++) { /* fmax skips NaN */
    worst = fmax(worst, fmax(report->potential[s], report->jacobian[s]));
    worst = fmax(worst, report->evaluate[s]);
  }
  return worst <= tolerance;
}
