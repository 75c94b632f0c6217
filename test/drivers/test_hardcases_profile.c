// TEST quick sources=hardcases/profile.c
/* test_hardcases_profile.c: performance profiles and verdicts on costs whose answers are known. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "hardcases/profile.h"
#include "test.h"

static const char *const names[] = {"clamp", "absolute", "auto"};

static int has(const char *text, const char *part)
{
  if (!strstr(text, part)) printf("# no '%s' in: %s\n", part, text);
  return strstr(text, part) != NULL;
}

/* Four problems by hand: the second is solved by one way alone, the third by none, the fourth was not run by all. */
static void shares_are_those_by_hand(void)
{
  const double cost[] = {2, 1, 4, INFINITY, 5, INFINITY, INFINITY, INFINITY, INFINITY, 1, 1, NAN};
  const flesh_profile p = {4, 3, cost, names};
  int unsolved;
  CHECK(flesh_profile_problems(&p, &unsolved) == 3 && unsolved == 1);
  CHECK(flesh_profile_solved(&p, 0) == 1 && flesh_profile_solved(&p, 1) == 2 && flesh_profile_solved(&p, 2) == 1);
  CHECK_NEAR(flesh_profile_share(&p, 0, 1), 0, 0);
  CHECK_NEAR(flesh_profile_share(&p, 0, 2), 1. / 3, 1e-15);
  CHECK_NEAR(flesh_profile_share(&p, 1, 1), 2. / 3, 1e-15);
  CHECK_NEAR(flesh_profile_share(&p, 2, 3.99), 0, 0);
  CHECK_NEAR(flesh_profile_share(&p, 2, 1e9), 1. / 3, 1e-15);
  CHECK_NEAR(flesh_profile_ratio(&p, 2, 1), 4, 1e-14);
  CHECK(isnan(flesh_profile_ratio(&(flesh_profile){1, 2, cost + 3, names}, 0, 1)));
  CHECK_NEAR(flesh_profile_share(&(flesh_profile){0, 3, cost, names}, 0, 1), 0, 0);
}

/* Two-sided tails of fair coins. */
static void chances_are_binomial(void)
{
  CHECK_NEAR(flesh_profile_chance(0, 0), 1, 0);
  CHECK_NEAR(flesh_profile_chance(5, 5), 1, 1e-12);
  CHECK_NEAR(flesh_profile_chance(1, 0), 1, 1e-12);
  CHECK_NEAR(flesh_profile_chance(10, 0), 2. / 1024, 1e-15);
  CHECK_NEAR(flesh_profile_chance(8, 2), 2 * 56. / 1024, 1e-14); /* 45 + 10 + 1 */
  CHECK_NEAR(flesh_profile_chance(2, 8), flesh_profile_chance(8, 2), 0);
}

enum { MANY = 40 };

/* Verdict on MANY problems whose costs of three ways `make` gives. */
static void judge(void (*make)(int problem, double *cost), char text[1000])
{
  double cost[3 * MANY];
  for (int k = 0; k < MANY; k++) make(k, cost + 3 * k);
  flesh_profile_verdict(&(flesh_profile){MANY, 3, cost, names}, text, 1000);
}

static void best_second(int k, double *cost) { cost[0] = 30 + k, cost[1] = 15 + 0.5 * k, cost[2] = 18 + 0.6 * k; }
static void alternating(int k, double *cost) { cost[0] = k % 2 ? 10 : 20, cost[1] = k % 2 ? 20 : 10, cost[2] = 15; }
static void equal_last(int k, double *cost) { cost[0] = 30 + k, cost[1] = cost[2] = 10 + k; }
static void all_equal(int k, double *cost) { cost[0] = cost[1] = cost[2] = 10 + k; }
/* Cheaper where it solves, but it does so in one of four. */
static void cheap_but_failing(int k, double *cost) { cost[0] = k % 4 ? INFINITY : 1, cost[1] = 10, cost[2] = 10.1; }
static void hair(int k, double *cost) { cost[0] = 100 + k, cost[1] = 97 + k, cost[2] = 200 + k; }
static void unsolvable(int k, double *cost)
{
  for (int w = 0; w < 3; w++) cost[w] = k < 35 ? INFINITY : 1 + w;
}
static void cycle(int k, double *cost)
{
  for (int w = 0; w < 3; w++) cost[w] = pow(2, (w + k) % 3);
}
static void rare(int k, double *cost) { cost[0] = k < 6 ? 10 : 20, cost[1] = 20, cost[2] = 20; }

static void verdicts_follow_from_the_costs(void)
{
  char text[1000];
  judge(best_second, text);
  CHECK(has(text, "absolute is not beaten by any.") && has(text, "clamp is beaten by absolute in 40 of 40") &&
        has(text, "costs 2.00 times") && has(text, "auto is beaten by absolute in 40 of 40") && has(text, "1.20 times"));
  judge(alternating, text);
  CHECK(has(text, "No decision between clamp, absolute and auto.") && !strstr(text, "beaten"));
  judge(equal_last, text);
  CHECK(has(text, "absolute (the same in every run: auto) is not beaten by any. clamp is beaten"));
  judge(all_equal, text);
  CHECK(!strcmp(text, "All do the same in every run."));
  judge(cheap_but_failing, text);
  CHECK(has(text, "No decision between absolute and auto.") && has(text, "clamp is beaten by") &&
        has(text, "in 30 of 40") && has(text, "0.10 times as much where both solve"));
  judge(hair, text); /* 3 % or less is no win */
  CHECK(has(text, "No decision between clamp and absolute. auto is beaten"));
  judge(unsolvable, text);
  CHECK(!strcmp(text, "No verdict: 5 problems that any filter solved are too few; it takes 10."));
  judge(cycle, text); /* 2 of 3 wins of 40 are no chance below 0.01, and no order either */
  CHECK(has(text, "No decision between clamp, absolute and auto."));
  judge(rare, text); /* six of six: chance 1/32 */
  CHECK(has(text, "No decision between clamp and absolute (the same in every run: auto)."));
}

/* A text that is too short for the words ends in order. */
static void short_texts_are_ended(void)
{
  double cost[3 * MANY];
  for (int k = 0; k < MANY; k++) best_second(k, cost + 3 * k);
  const flesh_profile p = {MANY, 3, cost, names};
  for (size_t size = 1; size < 200; size++) {
    char *text = malloc(size);
    flesh_profile_verdict(&p, text, size);
    CHECK(strlen(text) < size);
    free(text);
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(shares_are_those_by_hand), TEST(chances_are_binomial),
                   TEST(verdicts_follow_from_the_costs), TEST(short_texts_are_ended));
}
