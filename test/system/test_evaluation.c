// TEST quick
/* test_evaluation.c: a caller's state is recognised as that of the run if every bit agrees, at its time within a
 * tolerance. */
#include <math.h>

#include "incompressible.h"
#include "system/evaluation.h"

/* Whether the state is no longer recognised if one of its numbers is replaced by the next larger one, and is again
 * afterwards. */
static int notices(const flesh_evaluation *evaluation, const flesh_state *state, double *number)
{
  const double before = *number;
  *number = nextafter(before, INFINITY);
  const int noticed = !flesh_evaluation_is_at(evaluation, state, 0);
  *number = before;
  return noticed && flesh_evaluation_is_at(evaluation, state, 0);
}

static void a_state_is_told_from_others_by_its_bits(void)
{
  test_body b;
  flesh_evaluation evaluation;
  double *x, *v, *p;
  throw_block(&b);
  x = b.state.x, v = b.state.v, p = b.state.multipliers;
  CHECK_OK(flesh_evaluation_create(b.system, NULL, &evaluation));
  CHECK_OK(flesh_evaluation_keep_state(&evaluation));
  CHECK(!flesh_evaluation_is_at(&evaluation, &b.state, INFINITY)); /* nothing has been returned */
  b.state.t = 2;
  flesh_evaluation_remember(&evaluation, &b.state);
  CHECK(flesh_evaluation_is_at(&evaluation, &b.state, 0));
  CHECK(notices(&evaluation, &b.state, &b.state.t));
  for (int d = 0; d < b.n; d++) CHECK(notices(&evaluation, &b.state, &x[d]) && notices(&evaluation, &b.state, &v[d]));
  for (int k = 0; k < b.state.multiplier_count; k++) CHECK(notices(&evaluation, &b.state, &p[k]));
  b.state.t += 1e-9;
  CHECK(flesh_evaluation_is_at(&evaluation, &b.state, 2e-9) && !flesh_evaluation_is_at(&evaluation, &b.state, 5e-10));
  x[0] += 1, v[b.n - 1] += 1;
  const double moved = x[0];
  flesh_evaluation_restore(&evaluation, &b.state);
  CHECK(x[0] == moved - 1 && flesh_evaluation_is_at(&evaluation, &b.state, 2e-9));
  flesh_evaluation_clear(&evaluation);
  destroy(&b);
}

int main(int argc, char **argv) { return RUN_TESTS(argc, argv, TEST(a_state_is_told_from_others_by_its_bits)); }
