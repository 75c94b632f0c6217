// TEST quick needs=drivers
/* test_longest_step.c: which step of a run is reported as long. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "run/run_trace.h"
#include "test.h"

/* Makes a run whose steps took these Newton iterations, with this many linear iterations each, preceded by the
 * start. */
static flesh_longest_step longest_of(int count, const long *newton, long each, long unfinished)
{
  flesh_run_trace trace = {.count = count + 1, .room = count + 1};
  trace.rows = calloc((size_t)count + 1, sizeof *trace.rows);
  for (int k = 0; k < count; k++) {
    trace.rows[k + 1].t = 0.5 * (k + 1);
    trace.rows[k + 1].step = k + 1;
    trace.rows[k + 1].newton = newton[k];
    trace.rows[k + 1].linear = each * newton[k];
  }
  const flesh_longest_step found = flesh_longest_step_find(&trace, unfinished, each * unfinished);
  flesh_run_trace_clear(&trace);
  return found;
}

/* The median, by hand, of the steps with iterations; 100 times it is not reported, more is, with its cutbacks. */
static void the_limit_is_a_hundred_medians(void)
{
  char words[240];
  const long at[] = {10, 0, 1100, 0, 8, 12}, above[] = {10, 0, 1101, 0, 8, 12};
  flesh_longest_step longest = longest_of(6, at, 0, 0);
  CHECK(longest.step == 3 && longest.newton == 1100 && longest.linear == 0);
  CHECK_NEAR(longest.t, 1.5, 0);
  CHECK_NEAR(longest.ratio, 100, 1e-12);
  CHECK(!flesh_longest_step_tell(&longest, sizeof words, words) && !*words);
  longest = longest_of(6, above, 7, 0);
  CHECK(flesh_longest_step_tell(&longest, sizeof words, words));
  CHECK(!strcmp(words, "step 3 (to t = 1.5 s) took 1101 Newton and 7707 linear iterations, 100.1 times the median step"));
  longest.cuts = 3;
  CHECK(flesh_longest_step_tell(&longest, sizeof words, words) && strstr(words, " times the median step, with cuts: 3"));
}

/* Few Newton iterations with thousands of linear iterations each also make a long step. */
static void linear_iterations_count(void)
{
  flesh_run_trace trace = {.count = 5, .room = 5};
  trace.rows = calloc(5, sizeof *trace.rows);
  for (int k = 0; k < 5; k++) trace.rows[k].step = k, trace.rows[k].newton = 2, trace.rows[k].linear = k == 3 ? 3004 : 8;
  const flesh_longest_step longest = flesh_longest_step_find(&trace, 0, 0);
  CHECK(longest.step == 3 && longest.linear == 3004);
  CHECK_NEAR(longest.ratio, 300.6, 1e-12);
  flesh_run_trace_clear(&trace);
}

/* The step that ended the run has no end in time, and is not part of the median. */
static void a_step_that_was_not_finished_counts(void)
{
  char words[240];
  const long few[] = {10, 10, 10};
  flesh_longest_step longest = longest_of(3, few, 0, 5000);
  CHECK(longest.step == 4 && longest.newton == 5000 && isnan(longest.t));
  CHECK_NEAR(longest.ratio, 500, 0);
  CHECK(flesh_longest_step_tell(&longest, sizeof words, words) && strstr(words, "step 4 (not finished) took 5000"));
  longest = longest_of(3, few, 0, 9);
  CHECK(longest.step == 1 && longest.newton == 10);
  CHECK_NEAR(longest.ratio, 1, 0);
}

/* Two steps have no meaningful median, nor has a run without steps. */
static void few_steps_are_not_compared(void)
{
  char words[240] = "x";
  const long two[] = {1, 100000};
  flesh_longest_step longest = longest_of(2, two, 0, 0);
  CHECK(isnan(longest.ratio) && !flesh_longest_step_tell(&longest, sizeof words, words) && !*words);
  longest = longest_of(0, two, 0, 7);
  CHECK(longest.step == 0 && longest.newton == 0 && isnan(longest.ratio));
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(the_limit_is_a_hundred_medians), TEST(linear_iterations_count),
                   TEST(a_step_that_was_not_finished_counts), TEST(few_steps_are_not_compared));
}
