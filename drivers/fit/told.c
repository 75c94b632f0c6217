/* told.c: which states of an experiment tell what was measured, and by which weights. */
#include "fit/told.h"

#include <math.h>

#include "base/error.h"
#include "base/memory.h"

int flesh_fit_told_add(flesh_fit_told *told, double t)
{
  if (!flesh_grow(&told->times, sizeof *told->times, told->count, &told->room))
    return flesh_fail(FLESH_ERR_MEMORY, "out of memory for the derivatives of a fit");
  told->times[told->count++] = t;
  return FLESH_OK;
}

/* The weight of state s for what is measured at t, NaN: at the end; between states on a straight line. */
static double weight_of(const flesh_fit_told *told, int s, double t)
{
  const double *times = told->times;
  const int last = told->count - 1;
  if (isnan(t) || t >= times[last]) return s == last;
  if (t == times[s]) return 1;
  if (t < times[s]) return s && t > times[s - 1] ? (t - times[s - 1]) / (times[s] - times[s - 1]) : s == 0;
  return t < times[s + 1] ? (times[s + 1] - t) / (times[s + 1] - times[s]) : 0;
}

void flesh_fit_told_visit(const flesh_fit_told *told, int s, flesh_fit_told_see *see, void *data)
{
  int row = 0;
  for (int k = 0; k < told->e->measured_count; k++) {
    const flesh_fit_measured *m = &told->e->measured[k];
    const int of_probes = m->table == FLESH_FIT_OF_PROBES;
    for (int i = 0; i < m->count; i++, row++) {
      const double weight = weight_of(told, s, m->data[i].t);
      if (weight != 0) see(data, m, &m->data[i], row, weight, of_probes ? m->first_column + m->data[i].quantity : -1);
    }
  }
}

static size_t entry(const flesh_fit_measured *m, const flesh_fit_datum *d, int a)
{
  return 3 * (size_t)m->points[d->row].nodes[a] + (size_t)(*m->quantities[d->quantity].name - 'x');
}

double flesh_fit_told_position(const flesh_fit_measured *m, const flesh_fit_datum *d, const double *x)
{
  double sum = 0;
  for (int a = 0; a < m->points[d->row].count; a++) sum += m->points[d->row].weights[a] * x[entry(m, d, a)];
  return sum;
}

void flesh_fit_told_give(const flesh_fit_measured *m, const flesh_fit_datum *d, double y, double *x)
{
  for (int a = 0; a < m->points[d->row].count; a++) x[entry(m, d, a)] += m->points[d->row].weights[a] * y;
}
