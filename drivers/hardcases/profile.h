/* profile.h: performance profiles (Dolan & More, Math. Program. 91, 2002) and what they decide. Pure: costs in, words
 * out. */
#ifndef FLESH_HARDCASES_PROFILE_H
#define FLESH_HARDCASES_PROFILE_H

#include <stddef.h>

/* The cost of each of several ways to solve each of several problems. Borrowed. Only problems that all ways were run on
 * count. */
typedef struct flesh_profile {
  int problems, ways;
  const double *cost;       /* [problems*ways], > 0; INFINITY: not solved; NaN: not run */
  const char *const *names; /* [ways] */
} flesh_profile;

/* Problems on which all ways were run; those that no way solved are counted into *unsolved (may be NULL). */
int flesh_profile_problems(const flesh_profile *profile, int *unsolved);
/* How many of them a way solved. */
int flesh_profile_solved(const flesh_profile *profile, int way);
/* rho(tau): the share of them that a way solved at no more than tau >= 1 times the least cost; 0 without problems. */
double flesh_profile_share(const flesh_profile *profile, int way, double tau);
/* Geometric mean of the cost of `way` over that of `other` where both solved; NaN where there is none. */
double flesh_profile_ratio(const flesh_profile *profile, int way, int other);

/* Two-sided probability that of wins + losses fair coins so many or more fall to one side; 1 when there are none. */
double flesh_profile_chance(int wins, int losses);

/* Whether `way` decisively beats `other`: it wins more problems than it loses, and chance would do so with a
 * probability below 0.01 (sign test). A problem is won by who alone solved it, or by a cost lower by 5 % or more. */
int flesh_profile_beats(const flesh_profile *profile, int way, int other, int *wins, int *losses);

/* The verdict in a sentence or more: the one way that nothing beats and that beats the rest; or that there is no
 * decision, and between which; or that there are too few problems (below 10). Ways that cost the same in every problem
 * are named as such. */
void flesh_profile_verdict(const flesh_profile *profile, char *text, size_t size);

#endif
