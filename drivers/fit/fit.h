/* fit.h: parameters of scenes fitted to measurements: what a spec says, runs and their derivatives at parameters, the search,
 * and what follows from its end. */
#ifndef FLESH_FIT_FIT_H
#define FLESH_FIT_FIT_H

#include <gsl/gsl_matrix.h>
#include <jansson.h>

#include "plot/curves.h"
#include "study/settings.h"
#include "study/study.h"

enum { FLESH_FIT_PARAMETERS = 256, FLESH_FIT_WORDS = 400, FLESH_FIT_SENTENCE = 600 };

/* Tables of a run whose numbers are compared with measured ones, in the order of the spec's keys. */
typedef enum flesh_fit_table { FLESH_FIT_OF_PROBES, FLESH_FIT_OF_HISTORY, FLESH_FIT_OF_POSITIONS } flesh_fit_table;

/* A key that is fitted, or a constant of a tet's material. The search goes on in q: log(value) where `spacing` is logarithmic,
 * else value / scale. */
typedef struct flesh_fit_parameter {
  char *key, *name;
  double start, from, to, scale; /* from, to: bounds, may be infinite */
  int spacing;                   /* FLESH_LINEAR, FLESH_LOGARITHMIC */
  const flesh_node *experiment_list; /* NULL: all */
  const flesh_node *place;
} flesh_fit_parameter;

/* A measured number. */
typedef struct flesh_fit_datum {
  int quantity, row; /* of its file; the row among those of data */
  double t;          /* s; NaN: at the run's end */
  double value, deviation;
} flesh_fit_datum;

/* A point of a body, by nodes and their weights. */
typedef struct flesh_fit_point {
  int count, nodes[10];
  double weights[10];
} flesh_fit_point;

typedef struct flesh_fit_quantity {
  char name[FLESH_CSV_NAME], unit[FLESH_CSV_NAME];
} flesh_fit_quantity;

/* A file of measurements: its keys, and what it holds. */
typedef struct flesh_fit_measured {
  const char *paths[3]; /* by flesh_fit_table; one is not NULL */
  const flesh_node *chosen, *place; /* columns, NULL: all */
  double deviation, weight; /* of each number; NaN: not given */
  int table; /* flesh_fit_table */
  const char *path;
  int quantity_count;
  flesh_fit_quantity *quantities;
  int count;
  flesh_fit_datum *data;
  int first_column; /* of its quantities among the experiment's columns of probes; of other tables without meaning */
  int row_count;
  flesh_fit_point *points; /* [row_count] of positions; else NULL */
} flesh_fit_measured;

/* The equilibria of the last run of an experiment from which what was measured is taken, for tangents there. */
typedef struct flesh_fit_kept {
  double *p; /* [parameters] of the run; NULL: none is kept */
  int count, room;
  flesh_state *states; /* [count] ascending in time, with arrays of their own */
  int has_start;       /* the first is the run's start, which is no equilibrium and depends on no parameter */
  double before;       /* s; the time of the row before the last one, kept or not */
} flesh_fit_kept;

typedef struct flesh_fit_experiment {
  const char *name, *scene;
  const flesh_node *place, *scene_place, *given; /* given: of `set`, NULL: nothing */
  flesh_settings set; /* the fit's own before the spec's */
  int nodes;
  double start, end; /* s */
  flesh_objects files; /* of measurements */
  int by_differences;  /* the spec asks for these derivatives */
  int measured_count;
  flesh_fit_measured *measured;
  int column_count;
  const char **columns; /* [column_count] names of the measured columns of probes, one file after the other */
  int first, count;     /* of its measured numbers among all */
  char fingerprint[FLESH_STUDY_FINGERPRINT];
  json_t *inputs; /* for the provenance */
  unsigned char acts[FLESH_FIT_PARAMETERS]; /* [keys] the parameter is one of this scene */
  char differences[FLESH_FIT_WORDS]; /* why derivatives are by differences of runs; empty: they are by tangents */
  int moves; /* it is a motion, whose tangents go along the steps; else it is of equilibria, which are kept */
  flesh_fit_kept kept;
} flesh_fit_experiment;

typedef struct flesh_fit_map flesh_fit_map; /* map.h */

typedef struct flesh_fit {
  flesh_arena arena;
  flesh_fit_map *map; /* NULL: all parameters are keys; else its tets are the last ones */
  const char *path;
  flesh_study_options options; /* folder, command line; without ranks */
  char *text;
  const char *title;
  int experiment_count, parameter_count, key_count, count; /* keys: parameters that are no tets; count: of all measured numbers */
  flesh_fit_experiment *experiments;
  flesh_fit_parameter *parameters;
  int max_iterations;
  double tolerance;
  /* Runs so far (runs.c). */
  flesh_study study;
  flesh_study_store store;
  char fingerprint[FLESH_STUDY_FINGERPRINT];
  const char *asked[3]; /* the case that is asked for, by the columns */
  json_t *record;       /* of that case; NULL: it is to be made */
  int made, linear;     /* runs, and linear solves for derivatives, of this process */
} flesh_fit;

/* Reads and checks a spec, its scenes and its measurements. FLESH_ERR_ARGUMENT with file, line, key, value and what is
 * valid, FLESH_ERR_FILE, FLESH_ERR_MEMORY. Zero-initialise; close in any case. */
int flesh_fit_read(const char *path, flesh_fit *fit);
void flesh_fit_close(flesh_fit *fit);
void flesh_fit_describe_keys(FILE *stream);
/* Whether an experiment's scene takes a parameter's start, from and to as a key, as far as they are finite and have a place in
 * the spec (of the start, that of its key `start`), and numbers that are not whole. */
int flesh_fit_check_values(flesh_fit *fit, const flesh_fit_experiment *e, const char *key,
                           const flesh_fit_parameter *parameter, const char *start);

/* Reads the file that the keys of `measured` name, of an experiment whose scene is given. */
int flesh_fit_measured_read(flesh_arena *arena, const flesh_scene *scene, flesh_fit_measured *measured);

/* The overrides of an experiment at parameters p; to be closed. */
void flesh_fit_overrides(const flesh_fit *fit, int experiment, const double *p, flesh_overrides *overrides);

/* Looks whether the runs of an experiment will have what was measured. */
int flesh_fit_try(flesh_fit *fit, int experiment);
/* Runs an experiment at p in DIR/runs/NAME: values [count] of what was measured. FLESH_OK also where the run failed: `why`
 * then says so, and else is empty. */
int flesh_fit_make_run(flesh_fit *fit, int experiment, const double *p, double *values, char why[FLESH_FIT_WORDS],
                       double *cpu_s);

void flesh_fit_kept_clear(flesh_fit_kept *kept);
/* New copy of t, x and multipliers, with v = 0, of a body with `nodes` nodes. FLESH_ERR_MEMORY. */
int flesh_fit_state_copy(const flesh_state *from, int nodes, flesh_state *to);
void flesh_fit_state_free(flesh_state *state);
/* Derivatives [count * keys] of what was measured by all keys, at the kept equilibria, or along a motion at p, which is run
 * again. FLESH_ERR_ARGUMENT, FLESH_ERR_SOLVE where there are none. */
int flesh_fit_tangents(flesh_fit *fit, int experiment, double *tangents);
int flesh_fit_motion_tangents(flesh_fit *fit, int experiment, const double *p, double *tangents);
/* direction [parameters] = 1 for parameter k; returns the difference by it at p. */
double flesh_fit_direct(const flesh_fit *fit, const double *p, int k, double *direction);
/* The scenes at p - h direction and p + h direction. */
int flesh_fit_scenes_beside(const flesh_fit *fit, int experiment, const double *p, const double *direction, double h,
                            flesh_scene *scenes[2]);
/* Why what is measured of a motion has no tangents, or "". */
const char *flesh_fit_motion_refused(const flesh_fit_experiment *e, const flesh_scene *scene);
/* Opens the tables that a run of a scene writes, in a folder. */
int flesh_fit_tables_open(const flesh_scene *scene, const char *folder, flesh_history **history, flesh_probes **probes);
/* A scene of an experiment at parameters, whose map is in DIR/map.csv. Returns new. */
int flesh_fit_scene_at(const flesh_fit *fit, int experiment, const double *p, flesh_scene **scene);
/* Takes what was measured from the tables in a folder, whose last state has the positions x [3*nodes]. */
int flesh_fit_take(const flesh_fit_experiment *e, const char *folder, const double *x, double *values);
/* New path of a folder for tables that are made for a moment; removes them with the folder, and frees the path, NULL-safe. */
char *flesh_fit_scratch(const flesh_fit *fit, const flesh_fit_experiment *e);
void flesh_fit_scratch_remove(char *folder);

/* Begins with the runs that DIR/fit.db keeps, or with none. FLESH_ERR_ARGUMENT where they are of another fit. */
int flesh_fit_runs_open(flesh_fit *fit);
/* Values [count] of a run at p, made where it is not there; written before this returns. `why` is empty, or why it failed. */
int flesh_fit_values_at(flesh_fit *fit, int experiment, const double *p, double *values, char why[FLESH_FIT_WORDS]);
/* The derivatives [count * keys] of the same by tangents; where there are none the experiment's `differences` says why. */
int flesh_fit_tangents_at(flesh_fit *fit, int experiment, const double *p, double *tangents);
/* The kept equilibria become those of a run at p, which is made again where they are not. */
int flesh_fit_keep_at(flesh_fit *fit, int experiment, const double *p);
/* New object of how many runs there are, and what they took. */
json_t *flesh_fit_runs_json(const flesh_fit *fit);
int flesh_fit_runs_used(const flesh_fit *fit);

/* Values [count] of all experiments at p and, where `jacobian` is not NULL, their derivatives by the keys [count * keys], by
 * rows. *good is 0 where a run failed; its words are then `why`. */
int flesh_fit_evaluate(flesh_fit *fit, const double *p, double *values, double *jacobian, int *good,
                       char why[FLESH_FIT_WORDS]);

/* The i-th of all measured numbers. */
const flesh_fit_datum *flesh_fit_datum_at(const flesh_fit *fit, int i);
/* The entry of `jacobian` [count * keys], derivatives at p, that is number i's by q of key k, over the number's deviation. */
double flesh_fit_by_q(const flesh_fit *fit, const double *p, const double *jacobian, int i, int k);
/* Its residual over its deviation, and the sum of the squares of `count` of them. */
double flesh_fit_residual(const flesh_fit *fit, int i, const double *values);
double flesh_fit_squares(const flesh_fit *fit, int first, int count, const double *values);

/* Singular values of a matrix U [rows][columns], whose columns are first divided by their norms; close in any case. */
typedef struct flesh_fit_svd {
  gsl_matrix *U, *V;
  gsl_vector *S, *norms;
  gsl_vector *work, *part; /* [columns] room */
  int rank;                /* singular values above flesh_fit_least_share of the largest */
} flesh_fit_svd;
int flesh_fit_svd_open(int rows, int columns, flesh_fit_svd *svd); /* FLESH_ERR_MEMORY */
void flesh_fit_svd_decompose(flesh_fit_svd *svd);
void flesh_fit_svd_close(flesh_fit_svd *svd);

/* A parameter's value in q, and back; dp/dq. */
double flesh_fit_q_of(const flesh_fit_parameter *parameter, double p);
double flesh_fit_p_of(const flesh_fit_parameter *parameter, double q);
double flesh_fit_slope(const flesh_fit_parameter *parameter, double p);
/* q within the bounds, and its value, which is within them in spite of rounding. */
double flesh_fit_clamp(const flesh_fit_parameter *parameter, double q);
double flesh_fit_value_at(const flesh_fit_parameter *parameter, double q);
/* A search whose steps are to keep within bounds by themselves goes on in z: q, or what a smooth function takes to q between
 * the bounds. */
double flesh_fit_z_of(const flesh_fit_parameter *parameter, double p);
/* The value for z, and dq/dz. */
double flesh_fit_p_at(const flesh_fit_parameter *parameter, double z, double *slope);
/* Whether p is within a hundredth of the way to a bound: -1, 0 or 1. */
int flesh_fit_side(const flesh_fit_parameter *parameter, double p);
/* Checks start, bounds, spacing and scale (NaN: not given), and fills in what is not given. */
int flesh_fit_check_numbers(flesh_fit_parameter *parameter);

/* A search for a map with one weight. */
typedef struct flesh_fit_stage {
  double weight, squares, penalty; /* sum of squares of the measured numbers' residuals; of the penalty, with the weight */
  double determined;               /* about how many numbers the measurements determine, of the map and of keys */
  int iterations, converged;
} flesh_fit_stage;

enum { FLESH_FIT_STAGES = 40 };

/* The end of a search, in the fit's arena. */
typedef struct flesh_fit_found {
  double *p;                 /* [parameters] */
  double *values, *jacobian; /* [count], [count * keys] dvalue/dp */
  signed char *at_bound;     /* [parameters] -1, 0 or 1 */
  int iterations, converged;
  char words[FLESH_FIT_WORDS]; /* how it ended */
  int stage_count, chosen; /* of a map, as are the next; chosen: the stage whose map it is */
  flesh_fit_stage stages[FLESH_FIT_STAGES];
  double *deviations;  /* [map] of q, by the regularised Gauss-Newton matrix; NULL: there are too many tets */
  double *resolutions; /* [map] the share of a tet's value that the measurements say, the rest being its neighbours' */
  double determined;   /* the sum of those: how many numbers the measurements determine of the map */
} flesh_fit_found;

/* Searches the least squares from the start. FLESH_ERR_SOLVE where the first runs fail. */
int flesh_fit_search(flesh_fit *fit, flesh_fit_found *found);
/* Room for the end of a search, whose start must be one that can be run. */
int flesh_fit_found_open(flesh_fit *fit, flesh_fit_found *found);

/* A direction in which the Jacobian's columns, each of length 1, have a singular value below this share of the largest is
 * not determined: differences of solves leave as much. */
static const double flesh_fit_least_share = 1e-5;
/* Changes of a combination that are a smaller share of its largest are left out. */
static const double flesh_fit_small_share = 1e-2;

/* The error of a parameter; NaN where it is not determined or stays at a bound. */
typedef struct flesh_fit_error {
  double standard, low, high; /* standard error in the parameter's unit; ends of the 95 % interval */
} flesh_fit_error;

/* Arrays in the fit's arena. */
typedef struct flesh_fit_statistics {
  int count;      /* keys */
  int freedom;    /* degrees of freedom: measured numbers less parameters that are free and determined */
  double squares; /* sum of squared residuals, each over its deviation */
  double scale;   /* root of squares / freedom: residuals, in the stated deviations; NaN without freedom */
  double quantile; /* of Student's t at 97.5 % */
  flesh_fit_error *errors;
  double *covariance;  /* [count * count] in the parameters' units; NaN where not determined */
  double *correlation; /* [count * count] */
  int sentence_count;
  char (*sentences)[FLESH_FIT_SENTENCE]; /* what is, and what is not determined */
} flesh_fit_statistics;

/* Finds the errors of the keys, and of a map's tets, and what the measurements do not determine. FLESH_ERR_MEMORY; of a map
 * also the errors of runs and solves. */
int flesh_fit_judge(flesh_fit *fit, flesh_fit_found *found, flesh_fit_statistics *statistics);
/* Adds a sentence (printf format). */
void flesh_fit_say(flesh_fit_statistics *statistics, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* Says which of n parameters of these names a change by shares [n], which changes nothing, has: one alone, a product, a ratio,
 * or more. */
void flesh_fit_tell_null(flesh_fit_statistics *statistics, int n, const char *const *names, const double *shares);

/* Writes result.json, tables, the picture and the fitted scenes, and prints a table. */
int flesh_fit_write(flesh_fit *fit, const flesh_fit_found *found, const flesh_fit_statistics *statistics);
/* result.json of a fit that has ended early. */
int flesh_fit_write_ended(const flesh_fit *fit, int status);

#endif
