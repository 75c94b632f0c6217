// TEST quick needs=drivers
/* test_hardcases_profile.c: performance profiles and verdicts (data/studies/profiles.sql) on costs whose answers are known. */
#include "results.h"

#include <math.h>
#include <string.h>


enum { WAYS = 3, MANY = 40 };

static const char tables[] =
    "CREATE TABLE runs (number INTEGER PRIMARY KEY, name, seed DEFAULT 1, poisson DEFAULT 0.45, step DEFAULT 1, energy DEFAULT "
    "'S', constants DEFAULT 'matched', element DEFAULT 'tet4', mesh DEFAULT '', solver, outcome, newton, linear DEFAULT 1, "
    "cpu_s DEFAULT 1, grp DEFAULT 'rest', code DEFAULT 'FLESH_OK', inverted_end DEFAULT 0)";

/* Returns the verdict on the costs [problems][WAYS]; INFINITY: not solved; NaN: not run. */
static char *judge(int problems, const double *cost, char **csv)
{
  static const char *const names[WAYS] = {"clamp", "absolute", "auto"};
  sqlite3 *database = results_open(tables);
  for (int k = 0; k < problems * WAYS; k++) {
    char *sql = sqlite3_mprintf("INSERT INTO runs (name, solver, outcome, newton) VALUES ('p%d', %Q, %Q, %.17g)", k / WAYS,
                                names[k % WAYS], isnan(cost[k]) ? "not run" : isinf(cost[k]) ? "stopped" : "recovered",
                                isfinite(cost[k]) ? cost[k] : 1);
    CHECK(!sqlite3_exec(database, sql, NULL, NULL, NULL));
    sqlite3_free(sql);
  }
  return results_make(database, "profiles", NULL, "profiles.csv", csv);
}

/* Four problems by hand: the second is solved by one method only, the third by none, the fourth was not run by all. */
static void shares_are_those_by_hand(void)
{
  const double cost[] = {2, 1, 4, INFINITY, 5, INFINITY, INFINITY, INFINITY, INFINITY, 1, 1, NAN};
  char *csv, *text = judge(4, cost, &csv);
  CHECK_TEXT(text, "tet4: 3 of 4 problems run with all filters; 1 solved by none");
  CHECK_TEXT(text, "nu 0.45: 3\n    clamp                        1\n    absolute                     2\n    auto                         1\n");
  CHECK_TEXT(text, "    clamp                       1     0.0 %           33.3 %          1.000\n");
  CHECK_TEXT(text, "    absolute                    2    66.7 %           66.7 %          0.500\n");
  CHECK_TEXT(text, "    auto                        1     0.0 %            0.0 %          2.000\n");
  CHECK_TEXT(csv, "\ntet4,newton,auto,3.830413122794295,0\ntet4,newton,auto,4,0.3333333333333333\n");
  free(text), free(csv);
  text = judge(1, (const double[]){INFINITY, 5, INFINITY}, NULL); /* no ratio for two that solve nothing in common */
  CHECK_TEXT(text, "    absolute                    1   100.0 %          100.0 %\n");
  free(text);
  text = judge(1, (const double[]){NAN, 5, 2}, NULL);
  CHECK_TEXT(text, "tet4: 0 of 1 problems run with all filters; 0 solved by none");
  CHECK_TEXT(text, "    absolute                    0     0.0 %            0.0 %\n");
  free(text);
}

/* A load that ends away from rest counts as solved; a problem that no method can start does not count. */
static void loads_and_what_is_refused(void)
{
  sqlite3 *database = results_open(tables);
  CHECK(!sqlite3_exec(database, "INSERT INTO runs (name, solver, outcome, newton, grp, code, inverted_end) VALUES "
    "('a', 'clamp', 'not recovered', 4, 'load', 'FLESH_OK', 0), ('a', 'absolute', 'not recovered', 2, 'load', 'FLESH_OK', 1),"
    "('b', 'clamp', 'not recovered', 4, 'rest', 'FLESH_OK', 0), ('b', 'absolute', 'recovered', 2, 'rest', 'FLESH_OK', 0),"
    "('c', 'clamp', 'stopped', 0, 'rest', 'FLESH_UNDEFINED', 0), ('c', 'absolute', 'stopped', 0, 'rest', 'FLESH_UNDEFINED', 0),"
    "('b', 'clamp-bare', 'recovered', 4, 'rest', 'FLESH_OK', 0), ('b', 'absolute-bare', 'stopped', 9, 'rest', 'FLESH_UNDEFINED', 0)",
                      NULL, NULL, NULL));
  char *text = results_make(database, "profiles", NULL, NULL, NULL);
  CHECK_TEXT(text, "tet4 load: 1 of 1 problems run with all filters; 0 solved by none\n  solved of         nu 0.45: 1\n"
                   "    clamp                        1\n    absolute                     0\n");
  CHECK_TEXT(text, "tet4: 1 of 1 problems run with all filters; 0 solved by none\n  solved of         nu 0.45: 1\n"
                   "    clamp                        0\n    absolute                     1\n");
  CHECK_TEXT(text, "tet4 bare: 1 of 1 problems run with all filters; 0 solved by none\n  solved of         nu 0.45: 1\n"
                   "    clamp                        1\n    absolute                     0\n");
  free(text);
}

/* Two-sided tails of tosses of a fair coin. */
static void chances_are_binomial(void)
{
  static const struct {
    int wins, losses;
    double chance;
  } rows[] = {{0, 0, 1}, {5, 5, 1}, {1, 0, 1}, {10, 0, 2. / 1024}, {8, 2, 2 * 56. / 1024}, {2, 8, 2 * 56. / 1024}};
  for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
    char sql[200];
    snprintf(sql, sizeof sql, "-- to verdict.txt\nSELECT printf('%%!.17g', sign_test(%d, %d));", rows[k].wins, rows[k].losses);
    char *text = results_make(results_open(tables), NULL, sql, NULL, NULL);
    CHECK_NEAR(strtod(text, NULL), rows[k].chance, 1e-12);
    free(text);
  }
}

/* Returns the verdict on MANY problems with costs of three methods from `make`. */
static char *judge_many(void (*make)(int problem, double *cost))
{
  double cost[WAYS * MANY];
  for (int k = 0; k < MANY; k++) make(k, cost + WAYS * k);
  return judge(MANY, cost, NULL);
}

static void best_second(int k, double *cost) { cost[0] = 30 + k, cost[1] = 15 + 0.5 * k, cost[2] = 18 + 0.6 * k; }
static void alternating(int k, double *cost) { cost[0] = k % 2 ? 10 : 20, cost[1] = k % 2 ? 20 : 10, cost[2] = 15; }
static void equal_last(int k, double *cost) { cost[0] = 30 + k, cost[1] = cost[2] = 10 + k; }
static void all_equal(int k, double *cost) { cost[0] = cost[1] = cost[2] = 10 + k; }
/* Cheaper if it solves a problem, but it solves one in four. */
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

static void stronger(int k, double *cost) { cost[0] = 100, cost[1] = k < 30 ? 50 : 100, cost[2] = 50; }

static void verdicts_follow_from_the_costs(void)
{
  char *text = judge_many(best_second);
  CHECK_TEXT(text, "    absolute is not beaten by any. clamp is beaten by absolute in 40 of 40 problems that tell them apart and costs 2.00 times");
  CHECK_TEXT(text, "auto is beaten by absolute in 40 of 40");
  CHECK_TEXT(text, "1.20 times");
  free(text);
  text = judge_many(alternating);
  CHECK_TEXT(text, "No decision between clamp, absolute and auto.");
  CHECK(!strstr(text, "beaten"));
  free(text);
  text = judge_many(equal_last);
  CHECK_TEXT(text, "absolute (the same in every run: auto) is not beaten by any. clamp is beaten");
  free(text);
  text = judge_many(all_equal);
  CHECK_TEXT(text, "    All do the same in every run.\n");
  CHECK(!strstr(text, "decision"));
  free(text);
  text = judge_many(cheap_but_failing);
  CHECK_TEXT(text, "No decision between absolute and auto. clamp is beaten by");
  CHECK_TEXT(text, "in 30 of 40");
  CHECK_TEXT(text, "0.10 times as much where both solve");
  free(text);
  text = judge_many(hair); /* a difference of 3 % or less does not count as a win */
  CHECK_TEXT(text, "No decision between clamp and absolute. auto is beaten");
  free(text);
  text = judge_many(unsolvable);
  CHECK_TEXT(text, "    No verdict: 5 problems that any filter solved are too few; it takes 10.\n");
  free(text);
  text = judge_many(cycle); /* 2 wins of 3, of 40 problems: not below a chance of 0.01, so no order */
  CHECK_TEXT(text, "No decision between clamp, absolute and auto.");
  free(text);
  text = judge_many(stronger); /* the one with most wins is named */
  CHECK_TEXT(text, "auto is not beaten by any. clamp is beaten by auto in 40 of 40");
  free(text);
  text = judge_many(rare); /* six wins of six: chance 1/32 */
  CHECK_TEXT(text, "No decision between clamp and absolute (the same in every run: auto).");
  free(text);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(shares_are_those_by_hand), TEST(loads_and_what_is_refused), TEST(chances_are_binomial), TEST(verdicts_follow_from_the_costs));
}
