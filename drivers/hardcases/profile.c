/* profile.c: performance profiles and the verdict from them. */
#include "hardcases/profile.h"

#include <gsl/gsl_cdf.h>
#include <math.h>
#include <stdio.h>

#include "base/text.h"

enum { LEAST_PROBLEMS = 10 };
static const double MARGIN = 0.95, CHANCE = 0.01;

static double cost_of(const flesh_profile *p, int problem, int way) { return p->cost[problem * p->ways + way]; }

/* The least cost of a problem, INFINITY: none solved it; NaN: not run by all. */
static double least_cost(const flesh_profile *p, int problem)
{
  double least = INFINITY;
  for (int w = 0; w < p->ways; w++) {
    if (isnan(cost_of(p, problem, w))) return NAN;
    least = fmin(least, cost_of(p, problem, w));
  }
  return least;
}

int flesh_profile_problems(const flesh_profile *p, int *unsolved)
{
  int count = 0, none = 0;
  for (int k = 0; k < p->problems; k++) {
    const double least = least_cost(p, k);
    count += !isnan(least);
    none += isinf(least) != 0;
  }
  if (unsolved) *unsolved = none;
  return count;
}

int flesh_profile_solved(const flesh_profile *p, int way)
{
  int count = 0;
  for (int k = 0; k < p->problems; k++) count += !isnan(least_cost(p, k)) && isfinite(cost_of(p, k, way));
  return count;
}

double flesh_profile_share(const flesh_profile *p, int way, double tau)
{
  const int problems = flesh_profile_problems(p, NULL);
  int count = 0;
  for (int k = 0; k < p->problems; k++) {
    const double least = least_cost(p, k), cost = cost_of(p, k, way);
    count += isfinite(least) && isfinite(cost) && cost <= tau * least;
  }
  return problems ? (double)count / problems : 0;
}

double flesh_profile_ratio(const flesh_profile *p, int way, int other)
{
  double sum = 0;
  int count = 0;
  for (int k = 0; k < p->problems; k++) {
    const double a = cost_of(p, k, way), b = cost_of(p, k, other);
    if (isnan(least_cost(p, k)) || !isfinite(a) || !isfinite(b)) continue;
    sum += log(a / b);
    count++;
  }
  return count ? exp(sum / count) : NAN;
}

double flesh_profile_chance(int wins, int losses)
{
  const int n = wins + losses, most = wins > losses ? wins : losses;
  return n ? fmin(1, 2 * gsl_cdf_binomial_Q((unsigned)most - 1, 0.5, (unsigned)n)) : 1;
}

int flesh_profile_beats(const flesh_profile *p, int way, int other, int *wins, int *losses)
{
  int won = 0, lost = 0;
  for (int k = 0; k < p->problems; k++) {
    const double a = cost_of(p, k, way), b = cost_of(p, k, other);
    if (!isfinite(least_cost(p, k))) continue;
    won += isfinite(a) && (isinf(b) || a <= MARGIN * b);
    lost += isfinite(b) && (isinf(a) || b <= MARGIN * a);
  }
  if (wins) *wins = won;
  if (losses) *losses = lost;
  return won > lost && flesh_profile_chance(won, lost) < CHANCE;
}

static int is_same(const flesh_profile *p, int way, int other)
{
  for (int k = 0; k < p->problems; k++)
    if (!isnan(least_cost(p, k)) && cost_of(p, k, way) != cost_of(p, k, other)) return 0;
  return 1;
}

/* The first way that does the same in every problem. */
static int first_same(const flesh_profile *p, int way)
{
  int first = 0;
  while (first < way && !is_same(p, first, way)) first++;
  return first;
}

/* A way that decisively beats it, the one with most wins; -1: none. */
static int beaten_by(const flesh_profile *p, int way)
{
  int best = -1, most = 0;
  for (int w = 0; w < p->ways; w++) {
    int wins;
    if (w != way && flesh_profile_beats(p, w, way, &wins, NULL) && wins > most) best = w, most = wins;
  }
  return best;
}

typedef struct words {
  char *text;
  size_t size;
} words;

/* Its name, and in brackets of those that do the same. */
static void say_way(words *w, const flesh_profile *p, int way)
{
  int same = 0;
  flesh_text_add(w->text, w->size, "%s", p->names[way]);
  for (int other = way + 1; other < p->ways; other++)
    if (first_same(p, other) == way) flesh_text_add(w->text, w->size, "%s%s", same++ ? ", " : " (the same in every run: ", p->names[other]);
  if (same) flesh_text_add(w->text, w->size, ")");
}

static void say_loser(words *w, const flesh_profile *p, int way, int by)
{
  int wins, losses;
  flesh_profile_beats(p, by, way, &wins, &losses);
  const double ratio = flesh_profile_ratio(p, way, by);
  flesh_text_add(w->text, w->size, " ");
  say_way(w, p, way);
  flesh_text_add(w->text, w->size, " is beaten by %s in %d of %d problems that tell them apart", p->names[by], wins, wins + losses);
  if (isfinite(ratio)) flesh_text_add(w->text, w->size, " and costs %.2f times as much where both solve", ratio);
  flesh_text_add(w->text, w->size, ".");
}

void flesh_profile_verdict(const flesh_profile *p, char *text, size_t size)
{
  words w = {text, size};
  int unsolved, left = 0, groups = 0;
  const int problems = flesh_profile_problems(p, &unsolved);
  if (size) *text = 0;
  if (problems - unsolved < LEAST_PROBLEMS) {
    flesh_text_add(text, size, "No verdict: %d problems that any filter solved are too few; it takes %d.", problems - unsolved,
        LEAST_PROBLEMS);
    return;
  }
  for (int a = 0; a < p->ways; a++) {
    if (first_same(p, a) != a) continue;
    groups++;
    left += beaten_by(p, a) < 0;
  }
  int rest = left;
  if (groups == 1) flesh_text_add(text, size, "All do the same in every run.");
  else if (left == 0) flesh_text_add(text, size, "No decision: each is beaten by another.");
  else {
    int named = 0;
    if (left > 1) flesh_text_add(text, size, "No decision between ");
    for (int a = 0; a < p->ways; a++) {
      if (first_same(p, a) != a || beaten_by(p, a) >= 0) continue;
      if (named++) flesh_text_add(text, size, "%s", --rest > 1 ? ", " : " and ");
      say_way(&w, p, a);
    }
    flesh_text_add(text, size, left > 1 ? "." : " is not beaten by any.");
  }
  for (int a = 0; a < p->ways; a++)
    if (first_same(p, a) == a && beaten_by(p, a) >= 0) say_loser(&w, p, a, beaten_by(p, a));
}
