// TEST quick
/* test_contact_secant.c: Hessians of contact lead to the gap with the expected force, and a pressed sheet comes to rest
 * in equally few iterations however deep it starts. */
#include "geometry/contact_secant.h"

#include "facing.h"
#include "geometry/barrier.h"

static facing f; /* large */
static const flesh_contact_law law = {3e4, 0.05, FLESH_CONTACT_EDGE_THICKNESS * 0.05};

/* Makes two sheets of 1 m^2, the second one above the first. */
static void make_sheets(flesh_contact_set *set, flesh_contact_secant *secant)
{
  facing_add_sheet(&f, 4, 0, 0, 1, 0, 1, 0.3);
  facing_add_sheet(&f, 5, 0, 0, 1, 1, 0, 0.3);
  facing_finish(&f);
  CHECK_OK(flesh_contact_set_create(&f.surface, f.X, &law, set));
  CHECK_OK(flesh_contact_secant_create(&f.surface, secant));
}

static void clear_sheets(flesh_contact_set *set, flesh_contact_secant *secant)
{
  flesh_contact_secant_clear(secant);
  flesh_contact_set_clear(set);
  facing_clear(&f);
}

/* Places the upper sheet `gap` thicknesses above the lower one, and displaces it by `aside` along the sheet. */
static void place(double gap, double aside, double *x)
{
  memcpy(x, f.X, 3 * (size_t)f.nodes * sizeof *x);
  for (int i = 0; i < f.nodes; i++)
    if (f.body[i]) x[3 * i] += aside, x[3 * i + 2] = gap * law.thickness;
}

static double pressure_at(double gap)
{
  double value, first = 0, second;
  if (gap < 1) flesh_barrier_law(gap, &value, &first, &second);
  return -first;
}

/* Returns how much more the upper sheet is pressed, over the law's stiffness, if the gap is smaller by a thickness. */
static double slope_of(const flesh_contact_set *set, const double *x)
{
  double sum = 0, H[144];
  for (int k = 0; k < set->count; k++) {
    CHECK_OK(flesh_contact_pair_hessian(&set->pairs[k], &set->closest[k], x, FLESH_FILTER_NONE, H));
    for (int a = 0; a < 4; a++)
      for (int b = 0; b < 4; b++)
        if (set->pairs[k].nodes[a] >= 0 && set->pairs[k].nodes[b] >= 0 && f.body[set->pairs[k].nodes[a]] &&
            f.body[set->pairs[k].nodes[b]])
          sum += H[12 * (3 * a + 2) + 3 * b + 2];
  }
  return sum * law.thickness / law.stiffness;
}

/* Predicts from x_lag by the force there; once more at the same position; the tangent if nothing moves. */
static void secants_lead_to_the_force_before(void)
{
  static double x[3 * FACING_NODES], x_lag[3 * FACING_NODES];
  static const double gaps[][2] = {{0.4, 0.9}, {0.9, 0.4}, {0.7, 0.7}, {0.5, 1.3}, {0.999, 0.9999}};
  flesh_contact_set set;
  flesh_contact_secant secant;
  make_sheets(&set, &secant);
  for (size_t k = 0; k < sizeof gaps / sizeof *gaps; k++) {
    const double from = gaps[k][0], to = fmin(gaps[k][1], 1);
    double value, first, slope = 0;
    flesh_barrier_law(from, &value, &first, &slope);
    if (from != to) slope = (pressure_at(from) - pressure_at(to)) / (to - from);
    place(gaps[k][0], 0, x);
    place(gaps[k][1], 0, x_lag);
    CHECK_OK(flesh_contact_set_update(&set, &f.candidates, x, NULL));
    flesh_contact_secant_forget(&secant);
    for (int again = 0; again < 2; again++) {
      if (!again) flesh_contact_secant_predict(&secant, &set, x_lag);
      flesh_contact_secant_apply(&secant, &set);
      for (int p = 0; p < set.count; p++) CHECK_NEAR(set.pairs[p].expected, to, 1e-9);
      CHECK_NEAR(slope_of(&set, x), slope, 1e-6 * slope);
    }
  }
  clear_sheets(&set, &secant);
}

/* Returns the change of the forces across the sheets when these tilt: the sum of the magnitudes of all entries that
 * couple directions along and across them. */
static double turning_of(const flesh_contact_set *set, const double *x, double expected)
{
  double sum = 0, H[144];
  for (int k = 0; k < set->count; k++) {
    flesh_contact_pair pair = set->pairs[k];
    pair.expected = expected;
    CHECK_OK(flesh_contact_pair_hessian(&pair, &set->closest[k], x, FLESH_FILTER_NONE, H));
    for (int a = 0; a < 4; a++)
      for (int b = 0; b < 4; b++) sum += fabs(H[12 * (3 * a + 2) + 3 * b]);
  }
  return sum / law.stiffness;
}

/* The force that turns with the features is the expected one, because the secant leads there: from any gap as from the
 * expected one. */
static void expected_forces_turn(void)
{
  static double x[3 * FACING_NODES];
  flesh_contact_set set;
  flesh_contact_secant secant;
  make_sheets(&set, &secant);
  place(0.8, 0.1, x);
  CHECK_OK(flesh_contact_set_update(&set, &f.candidates, x, NULL));
  const double there = turning_of(&set, x, 0);
  CHECK(there > 1e-3 && turning_of(&set, x, 1) <= 1e-12 * there && turning_of(&set, x, 2) <= 1e-12 * there);
  place(0.3, 0.1, x);
  CHECK_OK(flesh_contact_set_update(&set, &f.candidates, x, NULL));
  CHECK_NEAR(turning_of(&set, x, 0.8), there, 1e-9 * there);
  CHECK(turning_of(&set, x, 0) > 10 * there);
  clear_sheets(&set, &secant);
}

/* Puts a weight on the upper sheet, and a spring with a stiffness of several weights per thickness. Returns the
 * iterations to 1e-9 of the weight, from half of the thickness. Tangents take one more for each factor of four in the
 * weight: 15 and more for the lightest. */
static int count_iterations(double weight, double spring, double lag)
{
  static double x[3 * FACING_NODES], x_lag[3 * FACING_NODES];
  flesh_contact_set set;
  flesh_contact_secant secant;
  double gap = 0.5;
  int count = 0;
  make_sheets(&set, &secant);
  place(lag, 0, x_lag);
  for (; count < 30; count++) {
    const double force = weight - pressure_at(gap) - spring * weight * (1 - gap);
    if (fabs(force) <= 1e-9 * weight) break;
    place(gap, 0, x);
    CHECK_OK(flesh_contact_set_update(&set, &f.candidates, x, NULL));
    flesh_contact_secant_predict(&secant, &set, x_lag);
    flesh_contact_secant_apply(&secant, &set);
    gap -= force / (slope_of(&set, x) + spring * weight);
    CHECK(gap > 0);
  }
  clear_sheets(&set, &secant);
  return count;
}

static void iterations_do_not_grow_with_depth(void)
{
  for (double weight = 1e-2; weight > 3e-9; weight /= 10) {
    CHECK(count_iterations(weight, 0, 2) <= 4); /* the force is known after one iteration */
    CHECK(count_iterations(weight, 0.5, 2) <= 6);
    CHECK(count_iterations(weight, 0.5, 0.999) <= 6);
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(secants_lead_to_the_force_before), TEST(expected_forces_turn),
                   TEST(iterations_do_not_grow_with_depth));
}
