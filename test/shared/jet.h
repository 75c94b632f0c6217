/* jet.h: functions of the three rest coordinates with their exact first and second derivatives (up to rounding) under
 * sums, products and sines. */
#ifndef FLESH_TEST_JET_H
#define FLESH_TEST_JET_H

#include <math.h>

typedef struct jet {
  double value, first[3], second[3][3];
} jet;

/* Returns the coordinate X[c]. */
static inline jet jet_coordinate(const double X[3], int c)
{
  jet r = {.value = X[c]};
  r.first[c] = 1;
  return r;
}

/* Returns a x + b y. */
static inline jet jet_sum(double a, jet x, double b, jet y)
{
  jet r = {.value = a * x.value + b * y.value};
  for (int i = 0; i < 3; i++) {
    r.first[i] = a * x.first[i] + b * y.first[i];
    for (int j = 0; j < 3; j++) r.second[i][j] = a * x.second[i][j] + b * y.second[i][j];
  }
  return r;
}

static inline jet jet_product(jet x, jet y)
{
  jet r = {.value = x.value * y.value};
  for (int i = 0; i < 3; i++) {
    r.first[i] = x.first[i] * y.value + x.value * y.first[i];
    for (int j = 0; j < 3; j++)
      r.second[i][j] = x.second[i][j] * y.value + x.first[i] * y.first[j] + x.first[j] * y.first[i] +
                       x.value * y.second[i][j];
  }
  return r;
}

/* Returns sin(k x + phase). */
static inline jet jet_sine(double k, jet x, double phase)
{
  const double s = sin(k * x.value + phase), c = k * cos(k * x.value + phase);
  jet r = {.value = s};
  for (int i = 0; i < 3; i++) {
    r.first[i] = c * x.first[i];
    for (int j = 0; j < 3; j++) r.second[i][j] = c * x.second[i][j] - k * k * s * x.first[i] * x.first[j];
  }
  return r;
}

#endif
