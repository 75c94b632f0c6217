// TEST quick
/* test_recovery.c: cutbacks and load increments on their own, without a solve: what is tried, in which order, and what
 * is reported when they give up. */
#include <math.h>

#include "body.h"
#include "parallel/body_figures.h"
#include "test.h"
#include "time/recovery/recovery.h"

/* Parts longer than `longest` that reach beyond `hard` fail, and all beyond `end` with another status. */
typedef struct course {
  double longest, hard, end;
  int quartered;   /* a failure halves twice */
  double at;       /* where the parts have led */
  int tries, parts, deepest, fatal;
  int apart;       /* a part did not start where the previous one ended, or had another length than reported */
} course;

static int take(course *c, const flesh_span *part, int depth)
{
  c->tries++;
  c->deepest = depth > c->deepest ? depth : c->deepest;
  c->apart |= part->begin != c->at || fabs(part->end - part->begin - part->h) > 1e-15;
  if (c->fatal == c->tries) return FLESH_ERR_BUDGET;
  if (part->end > c->end) return FLESH_UNDEFINED;
  if (part->h > c->longest && part->end > c->hard) return FLESH_NOT_CONVERGED;
  c->at = part->end;
  c->parts++;
  return FLESH_OK;
}

static const flesh_span span = {0.3, 0.3 + 1. / 60, 1. / 60};

static int walk(int max_cutbacks, course *c, int *failures)
{
  flesh_cutbacks cutbacks = flesh_cutbacks_of(span);
  int status;
  c->at = span.begin;
  do {
    status = take(c, &cutbacks.part, cutbacks.depth);
    *failures += status > 0;
  } while (flesh_cutbacks_next(&cutbacks, 1 + c->quartered, max_cutbacks, status));
  return status;
}

static void steps_that_fail_are_halved(void)
{
  for (int depth = 0; depth <= 8; depth++) {
    course c = {.longest = ldexp(span.h, -depth) * 1.001, .end = INFINITY};
    int failures = 0;
    CHECK_OK(walk(8, &c, &failures));
    /* The largest part that may succeed is tried first: if all of one depth do, the longer ones fail once. */
    CHECK(c.at == span.end && !c.apart && c.deepest == depth && c.parts == 1 << depth);
    CHECK(failures == c.tries - c.parts && c.tries >= c.parts + depth);
  }
}

/* All parts have the necessary length, or half of it. */
static void steps_that_fail_are_halved_twice(void)
{
  for (int depth = 0; depth <= 8; depth++) {
    course c = {.longest = ldexp(span.h, -depth) * 1.001, .end = INFINITY, .quartered = 1};
    int failures = 0;
    CHECK_OK(walk(8, &c, &failures));
    CHECK(c.at == span.end && !c.apart && c.deepest >= depth && c.deepest <= depth + 1);
    CHECK(c.parts >= 1 << depth && c.parts <= 2 << depth && failures == c.tries - c.parts);
  }
  /* Half of the span fails once, its quarter succeeds; the last halving is not skipped. */
  course c = {.longest = span.h / 1.9, .end = INFINITY, .quartered = 1};
  int failures = 0;
  CHECK_OK(walk(8, &c, &failures));
  CHECK(c.parts == 3 && failures == 1 && c.deepest == 2);
  c = (course){.longest = span.h / 7.9, .end = INFINITY, .quartered = 1};
  failures = 0;
  CHECK_OK(walk(3, &c, &failures));
  CHECK(c.parts == 8 && c.deepest == 3);
}

/* A step that is hard only at its end is halved only there: 1/2, 1/4, 1/8, 1/8 of the span. */
static void parts_are_as_long_as_may_be(void)
{
  course c = {.longest = span.h / 7.9, .hard = span.begin + 0.8 * span.h, .end = INFINITY};
  int failures = 0;
  CHECK_OK(walk(8, &c, &failures));
  CHECK(c.parts == 4 && c.deepest == 3 && c.at == span.end && failures == 3);
}

static void steps_are_given_up_at_the_greatest_depth(void)
{
  course c = {.longest = 1, .end = span.begin + 0.4 * span.h};
  int failures = 0;
  CHECK(walk(3, &c, &failures) == FLESH_UNDEFINED);
  /* 3/8 of the span succeeded, the next eighth did not. */
  CHECK(c.deepest == 3 && fabs(c.at - span.begin - 0.375 * span.h) < 1e-15 && !c.apart);
  c = (course){.longest = 1, .end = 0};
  CHECK(walk(0, &c, &failures) == FLESH_UNDEFINED && c.tries == 1);
}

static void errors_end_a_step_at_once(void)
{
  course c = {.longest = span.h / 3, .end = INFINITY, .fatal = 4};
  int failures = 0;
  CHECK(walk(8, &c, &failures) == FLESH_ERR_BUDGET && c.tries == 4 && failures == 2);
}

/* Increments longer than `longest` fail if they start before `easy`, and so do all beyond `end`. */
typedef struct load {
  double longest, easy, end, reached, place;
  int tries, steps, fatal, apart;
  double smallest, failed; /* where the previous failed increment ended; 0: none has failed */
} load;

static int take_load(load *l, const flesh_load_increment *increment)
{
  const double length = increment->to - increment->from;
  l->tries++;
  l->apart |= increment->from != l->reached || !(length > 0) || increment->to > 1;
  /* The depth is that of the requested increment, which the full load may limit. */
  l->apart |= length > ldexp(1, -increment->depth) * (1 + 1e-12);
  l->apart |= l->failed > 0 && increment->to >= l->failed; /* none is tried again */
  l->smallest = fmin(l->smallest, length);
  if (l->fatal == l->tries) return FLESH_ERR_MEMORY;
  if ((length > l->longest && increment->from < l->easy) || increment->to > l->end) {
    l->failed = increment->to;
    return FLESH_NOT_CONVERGED;
  }
  l->failed = 0;
  l->reached = increment->to;
  l->place += increment->fraction * (1 - l->place); /* the prescribed displacement advances by this fraction of its rest */
  l->steps++;
  return FLESH_OK;
}

static int raise_load(int max_cutbacks, load *l)
{
  flesh_load_increment increment = flesh_load_increment_first();
  int status;
  do status = take_load(l, &increment);
  while (flesh_load_increment_next(&increment, max_cutbacks, status));
  return status;
}

static void loads_are_raised_in_increments(void)
{
  for (int k = 1; k <= 8; k++) {
    load l = {.longest = ldexp(1, -k) * 1.01, .easy = 1, .end = 1, .smallest = 1};
    CHECK_OK(raise_load(8, &l));
    CHECK(l.reached == 1 && !l.apart && l.steps == 1 << k);
    CHECK_NEAR(l.place, 1, 1e-12); /* it moves along, and ends at the right position */
    CHECK(l.smallest >= ldexp(1, -k));
    /* After every success an increment twice as long is tried. */
    CHECK(l.tries <= 2 * l.steps + k);
  }
}

/* 1/2, 1/4 and 1/8 fail; then 1/16, 1/8, 1/4, 1/2 and the remainder. */
static void increments_grow_where_they_succeed(void)
{
  load l = {.longest = 0.1, .easy = 0.01, .end = 1, .smallest = 1};
  CHECK_OK(raise_load(8, &l));
  CHECK(l.reached == 1 && !l.apart && l.tries == 8 && l.steps == 5);
}

static void a_load_that_cannot_be_held_is_given_up(void)
{
  load l = {.longest = 1, .easy = 1, .end = 0.7, .smallest = 1};
  CHECK(raise_load(6, &l) == FLESH_NOT_CONVERGED);
  CHECK(l.reached <= 0.7 && l.reached > 0.7 - ldexp(1, -6) && l.smallest == ldexp(1, -6) && !l.apart);
  l = (load){.longest = 0.3, .easy = 1, .end = 1, .fatal = 3, .smallest = 1};
  CHECK(raise_load(6, &l) == FLESH_ERR_MEMORY && l.tries == 3);
}

/* Makes the recovery of a bar of two cells with the default options. */
static void open_recovery(test_body *b, flesh_solver_options *options, flesh_evaluation *evaluation, flesh_recovery *recovery)
{
  flesh_solver_options_default(options);
  CHECK_OK(test_body_create(test_box(2, 1, 1, 2, 1, 1), test_material(FLESH_ENERGY_S, 0.3), 1000, FLESH_MASS_LUMPED, 1, b));
  CHECK_OK(flesh_system_finalize(b->system));
  CHECK_OK(flesh_evaluation_create(b->system, NULL, evaluation));
  CHECK_OK(flesh_recovery_create(evaluation, NULL, options, recovery));
}

static void failures_say_where(void)
{
  test_body b;
  flesh_solver_options options;
  flesh_evaluation evaluation;
  flesh_recovery recovery;
  open_recovery(&b, &options, &evaluation, &recovery);
  CHECK_OK(flesh_recovery_create_collective(&recovery));
  CHECK(recovery.untangler && recovery.tangled);
  const int worst = 7, *tet = flesh_mesh_tets(b.mesh) + 4 * worst;
  double centre[3] = {0};
  /* The tet's first corner passes through its opposite face. */
  for (int c = 0; c < 3; c++) {
    double middle = 0;
    for (int a = 1; a < 4; a++) middle += b.state.x[3 * tet[a] + c] / 3;
    b.state.x[3 * tet[0] + c] += 4 * (middle - b.state.x[3 * tet[0] + c]);
    for (int a = 0; a < 4; a++) centre[c] += b.state.x[3 * tet[a] + c] / 4;
  }
  recovery.failure = (flesh_failure){.status = FLESH_NOT_CONVERGED, .t = 0.5, .h = 0.25, .residual = 3, .target = 2};
  for (int k = 0; k < 2; k++) /* nothing adds up */
    recovery.failure.worst_tet = flesh_body_worst_tet(b.mesh, NULL, b.state.x, &recovery.failure.worst_J,
                                                      recovery.failure.worst_position);
  CHECK_NEAR(recovery.failure.worst_J, -3, 1e-12);
  const int *found = flesh_mesh_tets(b.mesh) + 4 * recovery.failure.worst_tet;
  for (int c = 0; c < 3; c++) {
    double mean = 0;
    for (int a = 0; a < 4; a++) mean += b.state.x[3 * found[a] + c] / 4;
    CHECK_NEAR(recovery.failure.worst_position[c], mean, 1e-12);
    if (recovery.failure.worst_tet == worst) CHECK_NEAR(mean, centre[c], 1e-12);
  }
  CHECK(flesh_recovery_fail(&recovery) == FLESH_ERR_SOLVE);
  CHECK_TEXT(flesh_error_text(), "at t = 0.5 s with h = 0.25 s");
  CHECK_TEXT(flesh_error_text(), "residual 3 N, wanted 2 N; smallest J = -3 in tet");
  recovery.failure.status = FLESH_NONFINITE;
  recovery.failure.worst_node = -1;
  CHECK(flesh_recovery_fail(&recovery) == FLESH_ERR_NONFINITE);
  CHECK_TEXT(flesh_error_text(), "there is no residual");
  flesh_recovery_clear(&recovery);
  options.techniques &= ~(unsigned)FLESH_TECHNIQUE_UNTANGLE;
  CHECK_OK(flesh_recovery_create(&evaluation, NULL, &options, &recovery));
  CHECK(!recovery.untangler);
  flesh_recovery_clear(&recovery);
  flesh_evaluation_clear(&evaluation);
  test_body_destroy(&b);
}

/* If softer materials do not help they are tried ever more rarely, until the body is no tangle. */
static void steps_in_vain_are_softened_seldom(void)
{
  test_body b;
  flesh_solver_options options;
  flesh_evaluation evaluation;
  flesh_recovery recovery;
  open_recovery(&b, &options, &evaluation, &recovery);
  for (int round = 0; round < 2; round++) {
    CHECK(!flesh_recovery_softens(&recovery, b.state.x));
    for (int d = 0; d < b.n; d += 3) b.state.x[d] *= -1; /* the mirror image */
    for (int k = 0; k <= 16; k++)
      CHECK(flesh_recovery_softens(&recovery, b.state.x) == (k <= 2 || k == 4 || k == 8 || k == 16));
    for (int d = 0; d < b.n; d += 3) b.state.x[d] *= -1;
  }
  flesh_recovery_clear(&recovery);
  flesh_evaluation_clear(&evaluation);
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(steps_that_fail_are_halved),
                   TEST(steps_that_fail_are_halved_twice), TEST(parts_are_as_long_as_may_be),
                   TEST(steps_are_given_up_at_the_greatest_depth), TEST(errors_end_a_step_at_once),
                   TEST(loads_are_raised_in_increments), TEST(increments_grow_where_they_succeed),
                   TEST(a_load_that_cannot_be_held_is_given_up), TEST(failures_say_where),
                   TEST(steps_in_vain_are_softened_seldom));
}
