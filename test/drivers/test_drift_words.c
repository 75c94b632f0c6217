// TEST quick needs=drivers
/* test_drift_words.c: the claims of the drift verdict (data/studies/drift.sql): no more than the two finest meshes
 * support. */
#include "results.h"

#include <math.h>
#include <string.h>

#include "flesh/body.h"

enum { SCENES = 4, VARIANTS = 3 };

/* The tables of cases, with default figures unless others are given. */
static const char tables[] =
    "CREATE TABLE results (id INTEGER PRIMARY KEY, scene_name, energy, poisson DEFAULT 0.49, constants, solver DEFAULT "
    "'guarded', status, status_code, message DEFAULT '', element_kind, tets, nodes, max_volume_drift, "
    "max_inverted DEFAULT 0, first_inverted_step DEFAULT -1, first_bound_step DEFAULT -1, J_bound, rest_volume_ratio "
    "DEFAULT 1, steps DEFAULT 5, final_volume_drift DEFAULT 0, rest_volume_ratio_theory DEFAULT 1, J_min DEFAULT 1, "
    "final_inverted DEFAULT 0, newton, linear_per_newton, wall_s, failed_at DEFAULT 0.1, t_end, distance_from_rest "
    "DEFAULT 0, stressed_rest_J DEFAULT 0, point_load DEFAULT 0);"
    "CREATE TEMP TABLE wanted (id INTEGER PRIMARY KEY, number INTEGER)";

static void insert(sqlite3 *database, int scene, int variant, double drift, int kind, int nodes)
{
  static const char *const scenes[SCENES] = {"one", "two", "three", "four"};
  static const char *const variants[VARIANTS][2] = {{"B", "matched"}, {"D", "matched"}, {"S", "matched"}};
  const int id = scene * VARIANTS + variant + 1, failed = isnan(drift) != 0;
  char *sql = sqlite3_mprintf(
      "INSERT INTO results (id, scene_name, energy, constants, status, status_code, element_kind, tets, nodes, "
      "max_volume_drift) VALUES (%d, %Q, %Q, %Q, %Q, %d, %d, %d, %d, %!.17g); INSERT INTO wanted VALUES (%d, %d)",
      id, scenes[scene], variants[variant][0], variants[variant][1], failed ? "failed" : "complete", failed, kind,
      10 * nodes, nodes, failed ? 1 : drift / 100, id, id - 1);
  CHECK(!sqlite3_exec(database, sql, NULL, NULL, NULL));
  sqlite3_free(sql);
}

/* Returns the verdict on made-up figures: drift[scene][variant] of B, D and S in %, NaN for a failed run; `more` is SQL
 * that changes them. */
static char *verdict(int scenes, const double drift[][VARIANTS], const int *kinds, const int *nodes, const char *more)
{
  sqlite3 *database = results_open(tables);
  for (int s = 0; s < scenes; s++)
    for (int v = 0; v < VARIANTS; v++) insert(database, s, v, drift[s][v], kinds[s], nodes[s]);
  if (more) CHECK(!sqlite3_exec(database, more, NULL, NULL, NULL));
  return results_make(database, "drift", NULL, "drift.csv", NULL);
}

static void lacks(const char *text, const char *words)
{
  CHECK(!strstr(text, words));
  if (strstr(text, words)) fprintf(stderr, "# it says: %s\n", words);
}

enum { P1 = FLESH_ELEMENT_TET4, MEAN = FLESH_ELEMENT_TET10_MEAN };

/* The finger's figures: on a coarse mesh of tet4 B changes more than D, on the finest mesh less. */
static void an_order_that_the_mesh_makes_is_reported(void)
{
  const double drift[][VARIANTS] = {{2.07, 1.90, .94}, {1.60, 1.93, .59}, {1.44, 1.94, .69}, {1.42, 1.94, .68}};
  char *text = verdict(4, drift, (int[]){P1, P1, MEAN, MEAN}, (int[]){500, 20000, 2500, 20000}, NULL);
  CHECK_TEXT(text, "four (tet10-mean, 200000 tets), the finest of 4");
  CHECK_TEXT(text, "by comparison with three (tet10-mean, 25000 tets)");
  CHECK_TEXT(text, "S 0.68 ± 0.01 %, B 1.42 ± 0.02 %, D 1.94 ± 0 %");
  CHECK_TEXT(text, "confirmed order: S < B < D ");
  CHECK_TEXT(text, "On one (tet4, 5000 tets) at poisson 0.49 B changes more than D (2.07 and 1.90 %), on the finest less "
                   "(1.42 and 1.94 %): an error of the mesh.");
  lacks(text, "On two");
  CHECK_TEXT(text, "one (tet4, 5000 tets) 2.070 (+0.650)");
  lacks(text, "lock");
  free(text);
}

/* Without the finest figures, no claim is made that does not hold. */
static void what_the_meshes_cannot_tell_is_not_reported(void)
{
  const double drift[][VARIANTS] = {{2.07, 1.90, .94}, {1.82, 1.92, .78}};
  char *text = verdict(2, drift, (int[]){P1, P1}, (int[]){500, 4000}, NULL);
  CHECK_TEXT(text, "confirmed order: S < B ~ D ");
  lacks(text, "an error of the mesh");
  CHECK_TEXT(text, "Four-node tets lock at poisson 0.49");
  free(text);
  /* Meshes of similar size say little: if cells are smaller by 1.26, the error is four times the difference. */
  text = verdict(2, (const double[][VARIANTS]){{2.0, 2.5, 1.0}, {1.9, 2.5, 1.0}}, (int[]){MEAN, MEAN}, (int[]){1000, 2000}, NULL);
  CHECK_TEXT(text, "B 1.90 ± 0.38 %");
  CHECK_TEXT(text, "S < B < D");
  free(text);
  text = verdict(2, (const double[][VARIANTS]){{2.05, 2.4, 1.0}, {1.9, 2.4, 1.0}}, (int[]){MEAN, MEAN}, (int[]){1000, 2000}, NULL);
  CHECK_TEXT(text, "S < B ~ D");
  free(text);
}

/* S, B and D rise; if S is that uncertain, B < D says nothing about S and D. */
static void an_order_of_neighbours_is_none_of_others(void)
{
  char *text = verdict(2, (const double[][VARIANTS]){{1.25, 1.4, .5}, {1.2, 1.4, 1}}, (int[]){P1, MEAN},
                       (int[]){500, 2500}, NULL);
  CHECK_TEXT(text, "confirmed order: S ~ B < D; S ~ D (~:");
  free(text);
  text = verdict(2, (const double[][VARIANTS]){{1.25, 1.4, .9}, {1.2, 1.4, 1}}, (int[]){P1, MEAN},
                       (int[]){500, 2500}, NULL);
  CHECK_TEXT(text, "confirmed order: S < B < D (~:");
  free(text);
  text = verdict(2, (const double[][VARIANTS]){{1.0, 1.1, .5}, {1.2, 1.4, 1}}, (int[]){P1, MEAN}, (int[]){500, 2500}, NULL);
  CHECK_TEXT(text, "confirmed order: S ~ B ~ D (~:");
  free(text);
}

/* If the run on the mesh next to the finest failed, nothing judges the figure of the finest. */
static void a_figure_without_a_second_claims_nothing(void)
{
  char *text = verdict(2, (const double[][VARIANTS]){{NAN, 1.9, .9}, {1.4, 1.94, .7}}, (int[]){P1, MEAN}, (int[]){500, 2500}, NULL);
  CHECK_TEXT(text, "B 1.40 %, D 1.94");
  CHECK_TEXT(text, "S ~ B ~ D (~");
  CHECK_TEXT(text, "on one it ends otherwise");
  free(text);
  text = verdict(1, (const double[][VARIANTS]){{2.07, 1.9, .9}}, (int[]){P1}, (int[]){500}, NULL);
  CHECK_TEXT(text, "One mesh and one element");
  lacks(text, "stands");
  lacks(text, "±");
  free(text);
}

/* B has inverted tets; S has a corner with J <= 0 that no quadrature point sees. */
static const char inversions[] = "UPDATE results SET J_bound = iif(energy = 'D', 0.4, -0.09);"
                                 "UPDATE results SET first_inverted_step = 12, max_inverted = 3 WHERE energy = 'B';"
                                 "UPDATE results SET first_bound_step = 10 WHERE energy <> 'D'";

static void inverted_tets_and_bounds_are_told_apart(void)
{
  char *text = verdict(1, (const double[][VARIANTS]){{2.07, 1.9, .9}}, (int[]){MEAN}, (int[]){500}, inversions);
  CHECK_TEXT(text, "tets are inverted (J <= 0) from step 12, 3 at most.");
  CHECK_TEXT(text, "no tet is inverted (the lower bound of J near corners is <= 0 from step 10, -0.09 at the least).");
  CHECK(text && strstr(text, "inverted") && strstr(text, "    D ") && strstr(text, "    D ") > strstr(text, "inverted"));
  lacks(strstr(text, "    D ") ? strstr(text, "    D ") : "", "from step 12");
  free(text);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(an_order_that_the_mesh_makes_is_reported), TEST(what_the_meshes_cannot_tell_is_not_reported),
                   TEST(an_order_of_neighbours_is_none_of_others),
                   TEST(a_figure_without_a_second_claims_nothing), TEST(inverted_tets_and_bounds_are_told_apart));
}
