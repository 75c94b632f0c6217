// TEST quick seconds=60
/* test_near_drift.c: bounds of the relative motion of near features: never too small, and small if they move as a
 * whole, turn or bend. */
#include "geometry/near_drift.h"

#include "soups.h"

#include "geometry/near_pairs.h"

static unsigned long long state = 20261123;

/* A surface with its former positions X and its present ones, for the bound. */
typedef struct drifting {
  soup s;
  flesh_near_finder *finder;
  flesh_near_drift drift;
  double *from, *x; /* [3*nodes] */
} drifting;

static void open_drifting(soup s, drifting *d)
{
  *d = (drifting){.s = s, .from = malloc(3 * (size_t)s.nodes * sizeof(double)),
                  .x = malloc(3 * (size_t)s.nodes * sizeof(double))};
  CHECK_OK(flesh_near_finder_create(&d->s.surface, s.X, NULL, 0, NULL, &d->finder));
  memcpy(d->from, s.X, 3 * (size_t)s.nodes * sizeof(double));
  memcpy(d->x, s.X, 3 * (size_t)s.nodes * sizeof(double));
}

static void close_drifting(drifting *d)
{
  flesh_near_drift_clear(&d->drift);
  flesh_near_finder_destroy(&d->finder);
  soup_clear(&d->s);
  free(d->from);
  free(d->x);
}

static double bound(drifting *d, double within)
{
  return flesh_near_drift_bound(&d->drift, d->finder, d->from, d->x, within);
}

static double length(const double v[3]) { return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

/* A corner of a face, or any point of it: its position and displacement. */
static void point_of(const drifting *d, int face, int any, double x[3], double u[3])
{
  double weights[3] = {1, 0, 0};
  if (any) {
    for (int k = 0; k < 3; k++) weights[k] = test_uniform(&state);
    const double sum = weights[0] + weights[1] + weights[2];
    for (int k = 0; k < 3; k++) weights[k] /= sum;
  }
  for (int c = 0; c < 3; c++) x[c] = u[c] = 0;
  for (int k = 0; k < 3; k++)
    for (int c = 0; c < 3; c++) {
      const int at = 3 * d->s.surface.faces[3 * face + k] + c;
      x[c] += weights[k] * d->x[at];
      u[c] += weights[k] * (d->x[at] - d->s.X[at]);
    }
}

/* Returns the largest relative motion of points of faces that are this near each other. */
static double largest_found(const drifting *d, double within, int *near)
{
  double largest = 0, x[2][3], u[2][3];
  *near = 0;
  for (int f = 0; f < d->s.triangles; f++)
    for (int g = 0; g < d->s.triangles; g++)
      for (int any = 0; any < 3; any++) {
        double apart[3], moved[3];
        point_of(d, f, any, x[0], u[0]);
        point_of(d, g, any, x[1], u[1]);
        for (int c = 0; c < 3; c++) apart[c] = x[0][c] - x[1][c], moved[c] = u[0][c] - u[1][c];
        if (length(apart) > within) continue;
        *near += f != g;
        largest = fmax(largest, length(moved));
      }
  return largest;
}

/* Moves each node by a mixture of an affine motion, bending and noise. */
static void bounds_are_bounds(void)
{
  for (int round = 0; round < 12; round++) {
    const double chance = round % 3 == 0 ? 0 : round % 3 == 1 ? 1e-3 : 0.02, within = round % 2 ? 0.02 : 0.2;
    drifting d;
    open_drifting(soup_of_sheets(3, 10, 0.03), &d);
    double A[9];
    for (int k = 0; k < 9; k++) A[k] = (round < 6 ? 0.1 : 1) * (test_uniform(&state) - 0.5);
    for (int i = 0; i < d.s.nodes; i++)
      for (int c = 0; c < 3; c++) {
        const double *X = d.s.X + 3 * i;
        d.x[3 * i + c] += A[3 * c] * X[0] + A[3 * c + 1] * X[1] + A[3 * c + 2] * X[2] + 5 * c +
                          0.02 * sin(6 * X[(c + 1) % 3]) + chance * (test_uniform(&state) - 0.5);
      }
    int near;
    const double found = largest_found(&d, within, &near), bounded = bound(&d, within);
    printf("# %d near, moved by %.3g at most, bound %.3g\n", near, found, bounded);
    CHECK(near > 100 && found > 0);
    CHECK(bounded >= found);
    CHECK(bounded <= 20 * found);
    CHECK(bound(&d, within) == bounded);
    close_drifting(&d);
  }
}

/* Sheets that turn together by a large angle: the bound is |A| within, where |A|^2 = 8 sin(angle/2)^2, plus a tenth of
 * a percent for the remainder of the fit, which is slightly regularised. */
static void what_turns_together_drifts_little(void)
{
  const double angle = 0.5, within = 0.01;
  drifting d;
  open_drifting(soup_of_sheets(2, 16, 0.02), &d);
  for (int i = 0; i < d.s.nodes; i++) {
    const double *X = d.s.X + 3 * i;
    d.x[3 * i] = cos(angle) * X[0] - sin(angle) * X[2] + 7;
    d.x[3 * i + 2] = sin(angle) * X[0] + cos(angle) * X[2] - 3;
  }
  const double found = bound(&d, within), expected = sqrt(8) * sin(angle / 2) * within;
  printf("# bound %.4g, expected %.4g\n", found, expected);
  CHECK(found >= 0.5 * expected && found <= expected * 1.001 + 1e-3 * angle / 16);
  close_drifting(&d);
}

/* One sheet slides on the other: all of the motion is relative if they are within the distance asked for. */
static void what_slides_drifts(void)
{
  static const struct {
    double gap, within;
    int near;
  } cases[] = {{0.01, 0.02, 1}, {0.4, 0.5, 1}, {2, 0.02, 0}};
  const double slid = 0.03;
  for (int k = 0; k < 3; k++) {
    drifting d;
    open_drifting(soup_of_sheets(2, 16, cases[k].gap), &d);
    for (int i = 0; i < d.s.nodes; i++) d.x[3 * i] += d.s.body[i] ? slid : 0;
    const double found = bound(&d, cases[k].within);
    if (cases[k].near) CHECK(found >= slid && found < 3 * slid);
    else CHECK(found < 1e-6);
    close_drifting(&d);
  }
}

static void what_is_not_known_is_infinite(void)
{
  drifting d;
  open_drifting(soup_of_sheets(1, 4, 0), &d);
  CHECK(bound(&d, 0.1) < 1e-6);
  CHECK(bound(&d, -1) == INFINITY && bound(&d, NAN) == INFINITY);
  d.x[3 * 7 + 1] = 1e9; /* cubes are as large as the largest group */
  CHECK(bound(&d, 0.1) >= 0.05 && bound(&d, 0.1) < INFINITY);
  d.x[3 * 7 + 1] = NAN;
  CHECK(bound(&d, 0.1) == INFINITY);
  d.x[3 * 7 + 1] = INFINITY;
  CHECK(bound(&d, 0.1) == INFINITY);
  close_drifting(&d);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(bounds_are_bounds), TEST(what_turns_together_drifts_little), TEST(what_slides_drifts),
                   TEST(what_is_not_known_is_infinite));
}
