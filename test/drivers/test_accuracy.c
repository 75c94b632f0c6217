// TEST quick needs=drivers
/* test_accuracy.c: how `flesh accuracy` measures times, distances and periods, and what its SQL computes from runs:
 * fits and fronts (data/studies/accuracy.sql), compared with closed forms. */
#include "results.h"

#include <stdlib.h>

#include "accuracy/accuracy.h"
#include "flesh/integrator.h"
#include "test.h"

/* Every method of motion is compared; marks and colours distinguish them. */
static void every_method_is_compared(void)
{
#define ROW(name_, scene_, adaptive_, order, colour_, mark_)                                                      \
  {.name = name_, .scene = scene_, .adaptive = adaptive_, .max_order = order, .colour = colour_, .mark = mark_},
  static const flesh_accuracy_method rows[] = {FLESH_ACCURACY_METHOD_LIST(ROW)};
#undef ROW
  const char *name;
  for (int m = 0; (name = flesh_method_name((flesh_method)m)); m++) {
    int found = m == FLESH_METHOD_STATIC;
    for (int k = 0; k < FLESH_ACCURACY_METHODS; k++) found |= !strcmp(rows[k].scene, name);
    if (!found) printf("# %s\n", name);
    CHECK(found);
  }
  for (int k = 0; k < FLESH_ACCURACY_METHODS; k++)
    for (int j = 0; j < k; j++)
      CHECK(strcmp(rows[k].name, rows[j].name) && strcmp(rows[k].colour, rows[j].colour) && rows[k].mark != rows[j].mark);
}

static void times_meet_the_end(void)
{
  flesh_accuracy_grid grid;
  flesh_accuracy_grid_make(0, 1, 0.1, 4096, &grid); /* 10 longest steps of 64 intervals each */
  CHECK(grid.count == 641 && grid.interval == 0.1 / 64);
  flesh_accuracy_grid_make(0, 1.05, 0.1, 4096, &grid); /* the end is a separate output time */
  CHECK(grid.count == 1 + 64 * 21 / 2 && grid.interval == 0.1 / 64);
  flesh_accuracy_grid_make(2, 12, 0.01, 4096, &grid);
  CHECK(grid.count == 1001 && grid.interval == 0.01);
  flesh_accuracy_grid_make(2, 12, 0.01, 101, &grid); /* with room for 101 times: every tenth */
  CHECK(grid.count == 101 && fabs(grid.interval - 0.1) < 1e-15);
  flesh_accuracy_grid_make(0, 1, 0.1, 100, &grid);
  CHECK(grid.count == 81);
  flesh_accuracy_grid_make(0, 0.03, 0.1, 4096, &grid);
  CHECK(grid.count > 76 && grid.end == 0.03);
  CHECK(flesh_accuracy_room(3000) == 3195 && flesh_accuracy_room(3) == 4096 && flesh_accuracy_room(100000000) == 64);
}

enum { NODES = 3, TIMES = 60 };

/* Three nodes of masses 1, 2 and 5 at rest at the origin. */
static void open_three(flesh_accuracy_measure *measure)
{
  *measure = (flesh_accuracy_measure){.nodes = NODES, .rest_volume = 4};
  measure->mass = calloc(7 * NODES, sizeof(double));
  measure->start = measure->mass + NODES;
  measure->rest = measure->start + 3 * NODES;
  measure->mass[0] = 1, measure->mass[1] = 2, measure->mass[2] = 5;
}

static void distances_are_weighted(void)
{
  flesh_accuracy_measure measure;
  flesh_accuracy_track a, b;
  open_three(&measure);
  CHECK_OK(flesh_accuracy_track_open(2, 3 * NODES, &a));
  CHECK_OK(flesh_accuracy_track_open(2, 3 * NODES, &b));
  /* Node 0 is off by (3,4,0), that is by 5, at the first time, node 2 by 2 at the second. */
  a.x[0] = 3, a.x[1] = 4;
  a.x[3 * NODES + 8] = 2;
  a.volume[0] = 4, b.volume[0] = 4, a.volume[1] = 4.4, b.volume[1] = 4;
  a.energy[0] = 3, b.energy[0] = 5, a.energy[1] = 6, b.energy[1] = 5;
  flesh_accuracy_scale scale = {.tip = 2, .energy = 10};
  flesh_accuracy_errors e;
  flesh_accuracy_compare(&measure, &scale, &a, &b, &e);
  CHECK_NEAR(e.position_rms, sqrt(25.0 / 8), 1e-15); /* against sqrt(5*4/8) */
  CHECK_NEAR(e.position_max, 5, 1e-15);
  CHECK_NEAR(e.tip, 2, 1e-15);
  CHECK_NEAR(e.volume, 0.1, 1e-15);
  CHECK_NEAR(e.energy, -0.2, 1e-15); /* the larger of -0.2 and +0.1 in magnitude, with its sign */
  a.x[4] = NAN;                      /* early, and not overwritten by later numbers */
  flesh_accuracy_compare(&measure, &scale, &a, &b, &e);
  CHECK(isnan(e.position_rms));
  flesh_accuracy_track_close(&a);
  flesh_accuracy_track_close(&b);
  flesh_accuracy_measure_close(&measure);
}

static void tracks_come_back(void)
{
  char folder[512], path[600];
  flesh_accuracy_track track, again;
  CHECK(!test_folder_make(folder, sizeof folder));
  snprintf(path, sizeof path, "%s/a.states", folder);
  CHECK_OK(flesh_accuracy_track_open(4, 6, &track));
  for (int k = 0; k < 24; k++) track.x[k] = sin(k), track.v[k] = 1 / (1.0 + k);
  for (int k = 0; k < 4; k++) track.t[k] = k / 3.0, track.energy[k] = -k, track.volume[k] = exp(k);
  CHECK_OK(flesh_accuracy_track_write(path, &track));
  CHECK_OK(flesh_accuracy_track_read(path, &again));
  CHECK(again.times == 4 && again.unknowns == 6);
  if (again.x) {
    CHECK(!memcmp(again.x, track.x, 24 * sizeof(double)) &&
          !memcmp(again.v, track.v, 24 * sizeof(double)));
    CHECK(!memcmp(again.t, track.t, 4 * sizeof(double)) &&
          !memcmp(again.energy, track.energy, 4 * sizeof(double)));
    CHECK(!memcmp(again.volume, track.volume, 4 * sizeof(double)));
  }
  flesh_accuracy_track_close(&again);
  FILE *stream = fopen(path, "r+b"); /* half a file is refused */
  CHECK(stream && !fseek(stream, 0, SEEK_END));
  CHECK(stream && !ftruncate(fileno(stream), ftell(stream) - 8));
  if (stream) fclose(stream);
  CHECK(flesh_accuracy_track_read(path, &again) == FLESH_ERR_FILE && !again.x);
  CHECK_TEXT(flesh_error_text(), path);
  flesh_accuracy_track_close(&track);
  test_folder_remove(folder);
}

/* x(t) of node 1 oscillates along y with `period` about a position away from the start; node 2 moves slightly. */
static double found_period(double period, double end, double ripple)
{
  flesh_accuracy_measure measure;
  flesh_accuracy_track track;
  flesh_accuracy_scale scale = {.period = NAN};
  flesh_mesh *mesh = NULL;
  const double corners[] = {0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0, 1};
  const int tet[] = {0, 1, 2, 3};
  open_three(&measure);
  CHECK_OK(flesh_mesh_create(4, corners, 1, tet, NULL, &mesh));
  CHECK_OK(flesh_accuracy_track_open(TIMES + 1, 3 * NODES, &track));
  const double w = 2 * M_PI / period;
  for (int k = 0; k <= TIMES; k++) {
    double t = k * end / TIMES, *x = track.x + 3 * NODES * k;
    track.t[k] = t;
    x[4] = 0.1 * (1 - cos(w * t)) + ripple * sin(17 * w * t);
    x[6] = 0.01 * t;
    track.v[3 * NODES * k + 4] = 0.1 * w * sin(w * t);
  }
  flesh_accuracy_measure_scale(&measure, mesh, &track, &scale);
  CHECK(scale.tip == 1 && scale.tip_axis == 1);
  CHECK_NEAR(scale.length, 2, 0);
  /* Mass 2 of 8 moves by at most 0.2; its kinetic energy is m v^2/2. */
  if (ripple == 0 && end > period) {
    CHECK_NEAR(scale.tip_motion, 0.2, 4e-3);
    CHECK_NEAR(scale.motion, 0.2 * sqrt(2.0 / 8), 2e-3);
    CHECK_NEAR(scale.energy, 0.01 * w * w, 0.06 * 0.01 * w * w);
  }
  flesh_accuracy_track_close(&track);
  flesh_accuracy_measure_close(&measure);
  flesh_mesh_destroy(&mesh);
  return scale.period;
}

static void periods_are_found(void)
{
  CHECK_NEAR(found_period(1, 3, 0), 1, 0.02);
  CHECK_NEAR(found_period(0.7, 3, 0), 0.7, 0.02);
  CHECK_NEAR(found_period(1, 3, 0.004), 1, 0.05); /* ringing does not count as motion */
  CHECK(isnan(found_period(1, 0.2, 0)));          /* too short to show a period */
}

static void a_reference_is_known_no_better_than_its_change(void)
{
  flesh_accuracy_errors u = {1e-8, 3e-8, 2e-8, 1e-9, -1e-7}, none = {0};
  flesh_accuracy_widen(1e-9, &none, &u); /* the two methods differ by more */
  CHECK_NEAR(u.position_rms, 1e-8, 0);
  CHECK_NEAR(u.energy, 1e-7, 0);
  flesh_accuracy_widen(1e-6, &none, &u);
  CHECK_NEAR(u.position_rms, 1e-6, 0);
  CHECK_NEAR(u.position_max, 3e-6, 1e-18);
  CHECK_NEAR(u.tip, 2e-6, 1e-18);
  CHECK_NEAR(u.volume, 1e-7, 1e-18);
  CHECK_NEAR(u.energy, 1e-5, 1e-17);
  const flesh_accuracy_errors doubt = {1e-6, 2e-6, 3e-6, 4e-6, -5e-6}; /* between its times */
  flesh_accuracy_widen(1e-6, &doubt, &u);
  CHECK_NEAR(u.position_rms, 2e-6, 1e-18);
  CHECK_NEAR(u.position_max, 5e-6, 1e-18);
  CHECK_NEAR(u.energy, 1.5e-5, 1e-17);
}

/* Coordinate `at` of a tet whose corners oscillate with frequency w until the kink, and then move on at `kept` times
 * the velocity. */
static void swing(double w, double kink, double kept, int at, double t, double *x, double *v)
{
  double s = fmin(t, kink);
  *v = 0.1 * w * cos(w * s + at);
  if (t > kink + 1e-12) *v *= kept;
  *x = (at % 4 == 0) + 0.1 * sin(w * s + at) + *v * (t - s);
}

/* Finds the largest error of the track between its times, and the error that it reports. */
static void interpolated(double w, double kink, double kept, int has_break, int intervals, double *error, double *doubt)
{
  const double corners[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const int tet[] = {0, 1, 2, 3};
  double x[12], v[12], want, want_v, mass[] = {1, 1, 1, 1};
  flesh_mesh *mesh = NULL;
  flesh_system *system = NULL;
  flesh_accuracy_track track;
  flesh_accuracy_errors errors;
  const flesh_accuracy_measure measure = {
      .nodes = 4, .mass = mass, .rest_volume = 1.0 / 6, .break_count = has_break, .breaks = &kink};
  const flesh_accuracy_scale scale = {.energy = 1};
  CHECK_OK(flesh_mesh_create(4, corners, 1, tet, NULL, &mesh));
  CHECK_OK(flesh_system_create(mesh, &system));
  CHECK_OK(flesh_system_finalize(system));
  CHECK_OK(flesh_accuracy_track_open(intervals + 1, 12, &track));
  for (int k = 0; k <= intervals; k++) {
    track.t[k] = (double)k / intervals;
    for (int d = 0; d < 12; d++) swing(w, kink, kept, d, track.t[k], track.x + 12 * k + d, track.v + 12 * k + d);
  }
  CHECK_OK(flesh_accuracy_track_evaluate(system, &track));
  *error = 0;
  for (int k = 0; k <= 7 * intervals; k++) {
    double t = k / (7.0 * intervals);
    const int known = flesh_accuracy_track_at(&track, &measure, t, x, v);
    const double cut = has_break ? floor(kink * intervals + 1e-9) / intervals : 2, r = 1e-9;
    CHECK(known == !(kink > cut + r && t > cut + r && t < cut + 1. / intervals - r));
    if (!known) continue;
    for (int d = 0; d < 12; d++) {
      swing(w, kink, kept, d, t, &want, &want_v);
      *error = fmax(*error, fabs(x[d] - want));
      if (k % 7 == 0) CHECK(fabs(x[d] - want) < 1e-14 && fabs(v[d] - want_v) < 1e-12 * w); /* its own times */
    }
  }
  CHECK_OK(flesh_accuracy_track_doubt(system, &measure, &scale, &track, &errors));
  *doubt = errors.position_max;
  flesh_accuracy_track_close(&track);
  flesh_system_destroy(&system);
  flesh_mesh_destroy(&mesh);
}

static void a_reference_is_known_between_its_times(void)
{
  double error[3], doubt;
  const double w = 2 * M_PI * 3; /* 32 and 16 times per period */
  interpolated(w, 2, 1, 0, 96, &error[0], &doubt);
  CHECK(error[0] < 1e-10 && doubt >= error[0] && doubt < 100 * error[0]);
  interpolated(w, 2, 1, 0, 48, &error[1], &doubt);
  CHECK_NEAR(log2(error[1] / error[0]), 8, 0.6); /* the order of its Hermite polynomials */
  CHECK(doubt >= error[1] && doubt < 100 * error[1]);
  /* Forces that end abruptly: if the time is announced, that adds no error; otherwise the error is reported. */
  const double kink = 0.5;
  interpolated(w, kink, 1, 1, 96, &error[1], &doubt);
  CHECK(error[1] < 1e-9 && doubt >= error[1] && doubt < 1e-6);
  interpolated(w, kink, 1, 0, 96, &error[2], &doubt);
  CHECK(error[2] > 1e3 * error[1] && doubt >= error[2] / 2);
}

/* A motion whose keyframes reverse it abruptly, at an output time and between two. */
static void a_reference_is_known_where_velocities_jump(void)
{
  double error, doubt;
  const double w = 2 * M_PI * 3; /* a Hermite cubic across the jump would be 6e-3 off */
  for (int quarters = 0; quarters < 8; quarters++) {
    interpolated(w, (48 + quarters / 4.) / 96, -1, 1, 96, &error, &doubt);
    CHECK(error < 2e-10 && doubt >= error && doubt < 100 * error);
  }
}

/* f = 3 + c h^p on any three sizes. */
static void orders_of_meshes_are_found(void)
{
  const double sizes[][3] = {{1, 0.5, 0.25}, {1, 0.7, 0.4}, {0.3, 0.15, 0.1}};
  for (int s = 0; s < 3; s++)
    for (double p = 0.75; p < 4; p += 0.5) {
      const double *h = sizes[s];
      const double first = fabs(pow(h[0], p) - pow(h[1], p)), second = fabs(pow(h[1], p) - pow(h[2], p));
      CHECK_NEAR(flesh_accuracy_order(h, 7 * first, 7 * second), p, 1e-9);
    }
  const double h[3] = {1, 0.5, 0.25};
  CHECK(flesh_accuracy_order(h, 32, 1) == 4);
  CHECK(isnan(flesh_accuracy_order(h, 1, 1)) && isnan(flesh_accuracy_order(h, 1, 2)) && isnan(flesh_accuracy_order(h, 1, 0)));
}

/* The tables of cases, with default figures unless others are given. */
static const char tables[] =
    "CREATE TABLE results (id INTEGER PRIMARY KEY, price, message, times, apart, \"change\", \"between\", "
    "uncertainty_position_rms, length, motion, tip_node, tip_motion, period, start_t, end_t, status DEFAULT 'complete', status_code DEFAULT 0, steps DEFAULT 0, rejected "
    "DEFAULT 0, residual_evaluations, hessian_assemblies DEFAULT 0, newton DEFAULT 0, linear_iterations DEFAULT 0, cpu_s, "
    "wall_s_median, wall_s_min, error_position_rms, error_position_max, error_tip, error_volume, energy_drift, energy_gain "
    "DEFAULT 0, below_reference DEFAULT 0, difference);"
    "CREATE TEMP TABLE wanted (id INTEGER PRIMARY KEY, number INTEGER);"
    "CREATE TABLE cases (id INTEGER PRIMARY KEY, scene, overrides);"
    "CREATE TEMP TABLE facts (number INTEGER PRIMARY KEY, data TEXT);"
    "INSERT INTO results (id, price, message, times, uncertainty_position_rms, motion, length) VALUES (100, 'reference', 'one; "
    "against two', 9, 1e-9, 1.0, 1.0); INSERT INTO wanted VALUES (100, 100)";

/* Runs of one method with given errors and costs, against a reference with a motion of 1 m, accurate to 1e-9 m. */
static sqlite3 *fill(int count, const double *steps, const double *errors, const double *seconds)
{
  sqlite3 *database = results_open(tables);
  for (int k = 0; k < count; k++) {
    char *sql = sqlite3_mprintf(
        "INSERT INTO results (id, error_position_rms, cpu_s, residual_evaluations) VALUES (%d, %!.17g, %!.17g, %d); INSERT INTO wanted "
        "VALUES (%d, %d); INSERT INTO facts VALUES (%d, json_object('method', 'bdf2', 'price', 'work', 'setting', 'step=%d', 'value', "
        "%!.17g, 'adaptive', 0))",
        k + 1, errors[k], seconds[k], (int)(100 / seconds[k]), k + 1, k, k, k, steps[k]);
    CHECK(!sqlite3_exec(database, sql, NULL, NULL, NULL));
    sqlite3_free(sql);
  }
  return database;
}

/* Returns the verdict, and the table if it is asked for. */
static char *make(sqlite3 *database, const char *table, char **csv)
{
  return results_make_of(database, (const char *const[]){flesh_own_text("runs"),
                                                         flesh_own_text("accuracy"), NULL}, table, csv, "verdict.txt");
}

static void change(sqlite3 *database, const char *sql) { CHECK(!sqlite3_exec(database, sql, NULL, NULL, NULL)); }

/* The row of orders.csv; fit_order checks that it is there, and gives the verdict if `text` is given. */
typedef struct fit {
  int points;
  double slope, slope_error, low, high;
} fit;
static void fit_order(sqlite3 *database, fit *f, char **text)
{
  char *csv = NULL, *words = make(database, "orders.csv", &csv);
  *f = (fit){.slope = NAN};
  const char *row = csv ? strstr(csv, "bdf2,step,") : NULL;
  CHECK(row && sscanf(row, "bdf2,step,%d,%lf,%lf,%lf,%lf", &f->points, &f->slope, &f->slope_error, &f->low, &f->high) >= 1);
  free(csv);
  if (text) *text = words;
  else free(words);
}

static void orders_are_fitted_where_they_hold(void)
{
  /* error = 3 h^2, except for a run whose error is half of the motion and one below the reference's accuracy. */
  const double steps[] = {0.5, 0.1, 0.05, 0.02, 0.01, 0.001}, seconds[] = {1, 2, 3, 4, 5, 6, 7};
  double errors[] = {0.5, 3e-2, 7.5e-3, 1.2e-3, 3e-4, 9e-9, 0};
  char *text;
  fit f;
  fit_order(fill(6, steps, errors, seconds), &f, NULL);
  CHECK(f.points == 4);
  CHECK_NEAR(f.slope, 2, 1e-12);
  CHECK_BELOW(f.slope_error, 1e-12);
  CHECK_NEAR(f.low, 0.01, 0);
  CHECK_NEAR(f.high, 0.1, 0);
  /* The standard error of a slope is sqrt(sum r^2 / (n-2) / sum (x - mean)^2), computed here by hand; the line passes
   * through the means. */
  errors[2] *= 1.05;
  fit_order(fill(6, steps, errors, seconds), &f, NULL);
  double mean = 0, height = 0, spread = 0, squares = 0;
  for (int k = 1; k < 5; k++) mean += log(steps[k]) / 4, height += log(errors[k]) / 4;
  for (int k = 1; k < 5; k++) {
    const double r = log(errors[k]) - height - f.slope * (log(steps[k]) - mean);
    spread += (log(steps[k]) - mean) * (log(steps[k]) - mean);
    squares += r * r;
  }
  CHECK_NEAR(f.slope_error, sqrt(squares / 2 / spread), 1e-12);
  /* Slopes 0.6, 0.9, 1.9, 2, 2, 0: the order holds over the four points from 0.008 to 0.001. */
  const double halves[] = {0.032, 0.016, 0.008, 0.004, 0.002, 0.001, 0.0005}, local[] = {0.6, 0.9, 1.9, 2, 2, 0};
  errors[0] = 0.05;
  for (int k = 1; k < 7; k++) errors[k] = errors[k - 1] * pow(2, -local[k - 1]);
  fit_order(fill(7, halves, errors, seconds), &f, &text);
  CHECK(f.points == 4);
  CHECK_TEXT(text, "  bdf2               error ~ step^1.970 ± 0.017 (4 runs)");
  CHECK_NEAR(f.high, 0.008, 1e-15);
  CHECK_NEAR(f.low, 0.001, 1e-15);
  CHECK_NEAR(f.slope, 1.97, 0.02);
  free(text);
  /* Two runs do not show an order, nor do three with different slopes. */
  fit_order(fill(2, halves, errors, seconds), &f, &text);
  CHECK(f.points == 0 && isnan(f.slope));
  CHECK_TEXT(text, "too few runs (2) in that range");
  free(text);
  fit_order(fill(3, halves, errors, seconds), &f, &text);
  CHECK(f.points == 0);
  CHECK_TEXT(text, "no order yet: the slopes between its 3 runs in that range differ");
  free(text);
}

/* Checks the fronts in time and in residual evaluations. */
static void check_fronts(sqlite3 *database, int count, const int *on_time, const int *on_residuals)
{
  char *csv = NULL;
  free(make(database, "accuracy.csv", &csv));
  const char *line = csv ? strchr(csv, '\n') : NULL;
  for (int k = 0; k < count; k++) {
    int front[2] = {-1, -1};
    line = line ? strchr(line + 1, '\n') : NULL; /* the last two fields of the line */
    CHECK(line && sscanf(line - 4, ",%d,%d", &front[0], &front[1]) == 2);
    CHECK(front[0] == on_time[k] && front[1] == on_residuals[k]);
    if (front[0] != on_time[k] || front[1] != on_residuals[k]) printf("# run %d: %d and %d\n", k, front[0], front[1]);
  }
  free(csv);
}

static void fronts_hold_what_nothing_beats(void)
{
  const double steps[] = {1, 2, 3, 4, 5, 6};
  const double errors[] = {1e-1, 1e-2, 2e-2, 1e-3, 1e-3, 5}, seconds[] = {1, 2, 3, 4, 4, 0.1};
  const int on_time[] = {1, 1, 0,
                         1, 0, 0}; /* the fifth is a copy of the fourth, the sixth is useless */
  const int on_residuals[] = {0, 0, 0, 1, 0, 0}; /* the fourth has the fewest evaluations and the least error */
  check_fronts(fill(6, steps, errors, seconds), 6, on_time, on_residuals);
}

/* The third of six steps is accurate by chance: the next smaller one is less so. */
static void luck_does_not_count(void)
{
  const double steps[] = {6, 5, 4, 3, 2, 1}, errors[] = {1, 0.5, 0.04, 0.2, 0.05, 0.02}, seconds[] = {1, 2, 3, 4, 5, 6};
  char *text = make(fill(6, steps, errors, seconds), NULL, NULL);
  CHECK_TEXT(text, "  bdf2               step=4 in 5 s, 0 steps, error 5 %  <- least CPU time");
  free(text);
  sqlite3 *database = fill(6, steps, errors, seconds); /* errors of other methods do not matter */
  change(database, "UPDATE facts SET data = json_replace(data, '$.method', 'newmark') WHERE number = 3");
  text = make(database, NULL, NULL);
  CHECK_TEXT(text, "  bdf2               step=2 in 3 s, 0 steps, error 4 %  <- least CPU time");
  CHECK_TEXT(text, "  newmark            not reached; its best: step=3 in 4 s, 0 steps, error 20 %");
  free(text);
}

/* Scattered times do not rank runs: the same run ties with itself, and counts decide instead. */
static void noise_is_not_ranked(void)
{
  const double steps[] = {1, 2, 3, 4}, errors[] = {1e-2, 1e-2, 1.5e-2, 1e-2}, seconds[] = {1.2, 1, 1.05, 2};
  /* The second is a copy of the first with a shorter time. */
  static const char figures[] = "UPDATE results SET residual_evaluations = CASE id WHEN 1 THEN 108 WHEN 2 THEN 110 WHEN 3 THEN 90 ELSE "
                                "80 END, steps = iif(id < 3, 0, 47 + id)";
  static const struct {
    const char *more, *words;
    int on_time[4], on_residuals[4];
  } rows[] = {
      {"SELECT 1", "; 1.9 times as much", {1, 0, 0, 0}, {0, 0, 0, 1}}, /* the first two are ranked by counts */
      /* The repeats of the third scatter as much as it differs from the fourth; the fourth has fewer evaluations than
       * the first. */
      {"UPDATE results SET wall_s_min = 1, wall_s_median = 1.25 WHERE id = 3; UPDATE results SET cpu_s = 1.3 WHERE id = 4",
       "step=3 in 1.3 s, 51 steps, error 1 %; the same cost, within the noise of the clock", {0, 0, 0, 0}, {0, 0, 0, 1}},
      /* Twice the time for a hundredth of the error, and for a tenth. */
      {"UPDATE results SET error_position_rms = 0.99e-2 WHERE id = 4", "; 1.9 times as much", {1, 0, 0, 0}, {0, 0, 0, 1}},
      {"UPDATE results SET error_position_rms = 0.9e-2 WHERE id = 4", "; 1.9 times as much", {1, 0, 0, 1}, {0, 0, 0, 1}}};
  for (size_t r = 0; r < sizeof rows / sizeof *rows; r++)
    for (int pass = 0; pass < 2; pass++) {
      sqlite3 *database = fill(4, steps, errors, seconds);
      change(database, figures);
      change(database, rows[r].more);
      if (!pass) {
        check_fronts(database, 4, rows[r].on_time, rows[r].on_residuals);
        continue;
      }
      /* The words for each method. */
      change(database, "UPDATE facts SET data = json_replace(data, '$.method', 'm' || number)");
      char *text = make(database, NULL, NULL);
      CHECK_TEXT(text, rows[r].words);
      if (!r) CHECK_TEXT(text, "step=2 in 1.05 s, 50 steps, error 1.5 %  <- least CPU time");
      if (!r) CHECK_TEXT(text, "step=0 in 1.2 s, 0 steps, error 1 %; 1.14 times as much");
      if (!r) CHECK_TEXT(text, "step=1 in 1 s, 0 steps, error 1 %; the same cost, within the noise of the clock");
      free(text);
    }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(every_method_is_compared), TEST(times_meet_the_end), TEST(distances_are_weighted),
                   TEST(tracks_come_back), TEST(periods_are_found),
                   TEST(a_reference_is_known_no_better_than_its_change),
                   TEST(a_reference_is_known_between_its_times), TEST(a_reference_is_known_where_velocities_jump),
                   TEST(orders_of_meshes_are_found),
                   TEST(orders_are_fitted_where_they_hold), TEST(fronts_hold_what_nothing_beats), TEST(luck_does_not_count),
                   TEST(noise_is_not_ranked));
}
