/* volume_arc.c: second-order corrections (Nocedal & Wright 2006, section 18.3) of the volumes that stiff rows measure,
 * along the arc that they make of a step (Mayne & Polak 1982).
 *
 * With b the rows, a step q changes volumes by b.q to first order, as in Newton's model. A rotation also changes them to
 * second order, which costs so much energy that straight steps are cut to almost nothing. As volumes are cubic in
 * positions, Simpson's rule gives their exact change from b at three points. */
#include "newton/volume_arc.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "newton/line_search.h"
#include "newton/mechanisms.h"

enum { LENGTHS = 5, CORRECTIONS = 12 };

/* A straight step is kept if the energy of its volume error is less than this fraction of the predicted decrease. */
static const double SMALL = 0.01;
/* Corrections end when the error's energy is this small relative to the straight step's. */
static const double CORRECTED = 1e-6;
/* Energy of a start's error, relative to the potential's terms, below which it is not corrected. */
static const double NOTHING = 1e-10;

int flesh_volume_arc_init(flesh_equations *equations, flesh_direction *direction, flesh_volume_arc *self)
{
  *self = (flesh_volume_arc){.equations = equations, .direction = direction};
  if (!direction->rows.nodes_per_row || !flesh_uses(equations->options, FLESH_TECHNIQUE_VOLUME_ARCS)) return FLESH_OK;
  const size_t count = (size_t)direction->rows.count;
  self->trial = direction->rows;
  self->trial.values = flesh_huge_pages_calloc((3 * count * (size_t)self->trial.nodes_per_row + 1) * sizeof(float));
  self->wanted = flesh_huge_pages_calloc((2 * count + 1) * sizeof(float));
  if (!self->trial.values || !self->wanted) {
    flesh_volume_arc_clear(self);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the volumes of %zu tets", count);
  }
  self->error = self->wanted + count;
  return FLESH_OK;
}

void flesh_volume_arc_clear(flesh_volume_arc *self)
{
  flesh_free(self->trial.values);
  flesh_free(self->wanted);
  *self = (flesh_volume_arc){0};
}

/* Adds weight b.q of every row to y, over the free dofs. */
static void add_products(const flesh_volume_arc *self, const float *values, double weight, const double *q, float *y)
{
  const uint8_t *constrained = self->equations->constrained.is;
  const int m = self->trial.nodes_per_row;
  for (int e = 0; e < self->trial.count; e++) {
    double sum = 0;
    for (int a = 0; a < m; a++) {
      const size_t node = 3 * (size_t)self->trial.nodes[(size_t)m * (size_t)e + (size_t)a];
      const float *b = values + 3 * ((size_t)m * (size_t)e + (size_t)a);
      for (size_t c = 0; c < 3; c++) sum += constrained[node + c] ? 0 : (double)b[c] * q[node + c];
    }
    y[e] += (float)(weight * sum);
  }
}

/* Computes the rows at u + scale q. */
static void find_rows(flesh_volume_arc *self, const double *u, double scale, const double *q)
{
  double *at = self->equations->trial;
  flesh_step_to(self->equations, u, scale, q, at);
  const flesh_point point = flesh_equations_point(self->equations, at);
  flesh_system_stiff_values(self->equations->system, &point, &self->equations->stage.shift, &self->trial);
}

/* Computes the error of the volumes at u + q; returns its energy. `known`: the rows at u are K's. */
static double find_error(flesh_volume_arc *self, const double *u, int known, const double *q)
{
  static const struct {
    double scale, weight;
  } simpson[3] = {{0, 1. / 6}, {0.5, 4. / 6}, {1, 1. / 6}};
  double square = 0;
  for (int e = 0; e < self->trial.count; e++) self->error[e] = -self->wanted[e];
  if (known) add_products(self, self->direction->rows.values, simpson[0].weight, q, self->error);
  for (int k = known; k < 3; k++) {
    find_rows(self, u, simpson[k].scale, q);
    add_products(self, self->trial.values, simpson[k].weight, q, self->error);
  }
  for (int e = 0; e < self->trial.count; e++) square += (double)self->error[e] * (double)self->error[e];
  flesh_team_sum(self->equations->team, 1, &square);
  return square / 2;
}

/* Corrects the step q from u if the energy of its error exceeds `enough`. Returns whether it did. */
static int correct(flesh_volume_arc *self, const double *u, int known, double enough, double *q)
{
  double first = 0;
  for (int k = 0; k < CORRECTIONS; k++) {
    const double energy = find_error(self, u, known, q);
    if (!(energy < INFINITY)) return 0;
    if (k == 0 && !(energy > enough)) return 0;
    if (k == 0) first = energy;
    else if (energy < CORRECTED * first) break;
    if (!self->direction->linear->preconditioner_correct_volumes(self->direction->preconditioner, self->error, q)) return 0;
  }
  return 1;
}

void flesh_volume_arc_bend(flesh_volume_arc *self, const double *u, const double *b, double *p)
{
  flesh_equations *equations = self->equations;
  self->bent = 0;
  if (!self->wanted || self->direction->rows.projection_disabled) return;
  const double slope = -flesh_dot(equations->threads, equations->n, b, p);
  double start, value, magnitude, s = 1, *q = equations->work[0];
  if (!(slope < 0) || flesh_equations_potential(equations, u, &start, &magnitude)) return;
  for (int k = 0; k < LENGTHS; k++, s /= 2) {
    for (int d = 0; d < equations->n; d++) q[d] = s * p[d];
    memset(self->wanted, 0, (size_t)self->trial.count * sizeof *self->wanted);
    add_products(self, self->direction->rows.values, 1, q, self->wanted);
    if (!correct(self, u, 1, SMALL * -s * slope / 2, q) && k == 0) return;
    flesh_step_to(equations, u, 1, q, equations->trial);
    const int status = flesh_equations_potential(equations, equations->trial, &value, &magnitude);
    const double own = -flesh_dot(equations->threads, equations->n, b, q);
    if (status || !(own < 0) || !(value <= start + flesh_armijo * s * slope) || !(value <= start + flesh_armijo * own)) continue;
    flesh_copy(equations->threads, equations->n, q, p);
    self->bent = 1;
    return;
  }
}

int flesh_volume_arc_double(flesh_volume_arc *self, const double *u, const double *p, double *q)
{
  if (!self->bent) return 0;
  for (int d = 0; d < self->equations->n; d++) q[d] = 2 * p[d];
  for (int e = 0; e < self->trial.count; e++) self->wanted[e] *= 2;
  return correct(self, u, 1, 0, q);
}

void flesh_volume_arc_start(flesh_volume_arc *self, double *u)
{
  flesh_equations *equations = self->equations;
  double before, after, magnitude, *q = equations->work[0];
  if (!self->wanted || self->direction->rows.projection_disabled || !self->direction->prepared) return;
  if (equations->constrained.displacement > 0) return;
  if (flesh_equations_potential(equations, u, &before, &magnitude)) return;
  flesh_copy(equations->threads, equations->n, u, q);
  memset(self->wanted, 0, (size_t)self->trial.count * sizeof *self->wanted);
  if (!correct(self, equations->evaluation.zeros, 0, NOTHING * magnitude, q)) return;
  if (!flesh_equations_is_feasible(equations, q, 0)) return;
  if (!flesh_equations_evaluate(equations, q, &after, &magnitude) && after < before)
    flesh_copy(equations->threads, equations->n, q, u);
}
