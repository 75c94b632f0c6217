/* fit.h: fits parameters of scenes to measurements: the spec, runs and their derivatives at given parameters, the
 * search, and statistics of its end. */
#ifndef FLESH_FIT_FIT_H
#define FLESH_FIT_FIT_H

#include <jansson.h>

#include "plot/curves.h"
#include "scene/fibres.h"
#include "study/settings.h"
#include "study/study.h"

enum { FLESH_FIT_PARAMETERS = 256, FLESH_FIT_WORDS = 400 };

/* Status of a function whose run failed because of its parameters, so that others may succeed; flesh_error_text says
 * why. */
enum { FLESH_FIT_RUN_FAILED = 1 };

/* The tables of a run with which measured numbers are compared, in the order of the spec's keys. */
typedef enum flesh_fit_table { FLESH_FIT_OF_PROBES, FLESH_FIT_OF_HISTORY, FLESH_FIT_OF_POSITIONS } flesh_fit_table;

/* A parameter: a key, or a material constant of one tet. The search works in q: log(value) if `spacing` is logarithmic,
 * else value / scale. */
typedef struct flesh_fit_parameter {
  char *key, *name;
  double start, from, to, scale; /* from, to: bounds, which may be infinite */
  int spacing;                   /* FLESH_LINEAR, FLESH_LOGARITHMIC */
  const flesh_node *experiment_list; /* list of names in the spec; NULL: all experiments */
  const flesh_node *node;            /* in the spec */
} flesh_fit_parameter;

/* A measured number. */
typedef struct flesh_fit_datum {
  int quantity, row; /* quantity of its file; row among the rows of data */
  double t;          /* s; NaN: at the run's end */
  double value, deviation;
} flesh_fit_datum;

/* A point of a body: nodes and their weights. */
typedef struct flesh_fit_point {
  int count, nodes[10];
  double weights[10];
} flesh_fit_point;

typedef struct flesh_fit_quantity {
  char name[FLESH_CSV_NAME], unit[FLESH_CSV_NAME];
  int column, deviation; /* columns of the file: of values; of their deviations, -1: none */
} flesh_fit_quantity;

/* A file of measurements: the keys in the spec, and the content. */
typedef struct flesh_fit_measured {
  const char *paths[3]; /* by flesh_fit_table; exactly one is not NULL */
  const flesh_node *node;   /* in the spec */
  const flesh_node *chosen; /* columns that are chosen; NULL: all */
  double deviation, weight; /* of each number; NaN: not given */
  int table; /* flesh_fit_table */
  const char *path;
  int quantity_count;
  flesh_fit_quantity *quantities;
  int count;
  flesh_fit_datum *data;
  int first_column; /* index of its first quantity in the experiment's columns of probes; meaningless for other tables */
  flesh_fit_point *points; /* [rows] for positions; else NULL */
} flesh_fit_measured;

/* The equilibria of an experiment's last run at which quantities were measured, kept for tangents. */
typedef struct flesh_fit_equilibria {
  double *p; /* [parameters] of that run; NULL: nothing is kept */
  int count, room;
  flesh_state *states; /* [count] ascending in time; they own their arrays */
  int has_start;       /* the first state is the run's start, which is no equilibrium and depends on no parameter */
  double before;       /* s; time of the row before the last one, whether it was kept or not */
} flesh_fit_equilibria;

typedef struct flesh_fit_experiment {
  const char *name, *scene;
  const flesh_node *node, *scene_node, *given; /* given: node of `set`; NULL: none */
  const char *folder, *scratch; /* of its runs; of temporary tables */
  flesh_texts set; /* overrides of the fit itself, then those of the spec */
  int nodes;
  double end; /* s */
  flesh_objects files; /* files of measurements */
  int by_differences;  /* the spec asks for derivatives by differences */
  int measured_count;
  flesh_fit_measured *measured;
  int column_count;
  const char **columns; /* [column_count] names of the measured columns of probes, file by file */
  int first, count;     /* range of its measured numbers among all */
  char fingerprint[FLESH_STUDY_FINGERPRINT];
  json_t *inputs; /* for the provenance */
  unsigned char acts[FLESH_FIT_PARAMETERS]; /* [keys] whether the parameter is a key of this scene */
  char differences[FLESH_FIT_WORDS]; /* why derivatives are computed by differences of runs; "" if by tangents */
  int moves; /* a motion, with tangents along its steps; else equilibria, which are kept */
  flesh_fit_equilibria equilibria;
} flesh_fit_experiment;

/* Kinds of penalty, in the order of their names. */
enum { FLESH_FIT_QUADRATIC, FLESH_FIT_VARIATION };

/* A map: a parameter for each of its tets, with a penalty for differences between neighbours. */
typedef struct flesh_fit_map {
  flesh_fit_parameter of; /* prototype of each tet's parameter; its key is the name of a constant */
  flesh_tet_selection tets_chosen;
  int penalty;
  double edge;   /* difference of q between neighbours above which `variation` penalises its size, not its square */
  double weight; /* of the penalty; NaN: chosen so that the residuals match the deviations */
  const char *unit;
  int count, *tets; /* [count] tets of the map, rising */
  int tet_count;    /* of the mesh */
  int face_count, *faces; /* [2 * face_count] neighbours, as indices of the fit's parameters */
  double *face_weights;   /* [face_count] area over the distance of the centres, over the cube root of the volume */
} flesh_fit_map;

typedef struct flesh_fit {
  flesh_arena arena;
  flesh_objects experiment_list, parameter_list; /* as in the spec, as the next member */
  flesh_fit_map map_keys;
  flesh_fit_map *map; /* NULL: all parameters are keys; else the map's tets are the last parameters */
  const char *path;
  flesh_study_options options; /* folder and command line; no ranks */
  char *text;
  const char *title;
  int experiment_count, parameter_count, key_count, count; /* key_count: parameters that are no tets; count: measured numbers */
  flesh_fit_experiment *experiments;
  flesh_fit_parameter *parameters;
  const flesh_fit_datum **data; /* [count] all measured numbers */
  int max_iterations;
  double tolerance;
  /* The runs so far (runs.c). */
  flesh_study study;
  flesh_study_store store;
  char fingerprint[FLESH_STUDY_FINGERPRINT];
  const char *wanted[3]; /* the current case, by the columns of the database */
  json_t *record;       /* record of that case; NULL: it must be computed */
  int made, linear;     /* number of runs, and of linear solves for derivatives, in this process */
} flesh_fit;

/* Reads and checks a spec, its scenes and its measurements. Zero-initialise the struct before; close it in any case.
 * FLESH_ERR_ARGUMENT with file, line, key, value and what is valid; FLESH_ERR_FILE, FLESH_ERR_MEMORY. */
int flesh_fit_read(const char *path, flesh_fit *fit);
void flesh_fit_close(flesh_fit *fit);
extern const flesh_settings_part flesh_fit_keys[]; /* for the help */
/* Checks that an experiment's scene accepts for a key the parameter's start, from and to, as far as they are finite and
 * stand in the spec (the start as its key `start`), and that it accepts numbers that are not whole. */
int flesh_fit_check_values(const flesh_fit_experiment *e, const char *key, const flesh_fit_parameter *parameter,
                           const char *start);

/* Reads the file that the keys of `measured` name. The scene is that of the experiment. */
int flesh_fit_measured_read(flesh_arena *arena, const flesh_scene *scene, flesh_fit_measured *measured);

/* Returns a measured coordinate at positions x [3*nodes]. */
double flesh_fit_position(const flesh_fit_measured *m, const flesh_fit_datum *d, const double *x);

/* Makes the overrides of an experiment at parameters p; the caller closes them. */
void flesh_fit_overrides(const flesh_fit *fit, const flesh_fit_experiment *e, const double *p, flesh_overrides *overrides);

/* Checks that the runs of an experiment will have the measured quantities. */
int flesh_fit_try(flesh_fit *fit, const flesh_fit_experiment *e);
/* Runs an experiment at p in its folder and returns the values [count] of the measured quantities, which are finite.
 * FLESH_FIT_RUN_FAILED; other errors are not of the parameters. */
int flesh_fit_run(flesh_fit *fit, flesh_fit_experiment *e, const double *p, double *values, double *cpu_s);

void flesh_fit_equilibria_clear(flesh_fit_equilibria *equilibria);
/* Makes a new copy of t, x and multipliers of a body with `nodes` nodes; v is 0. FLESH_ERR_MEMORY. */
int flesh_fit_state_copy(const flesh_state *from, int nodes, flesh_state *to);
/* Compute the derivatives [count * keys] of the measured quantities by all keys: the first at the kept equilibria, the
 * second along a motion at p, which is run again. FLESH_ERR_ARGUMENT or FLESH_ERR_SOLVE if there are none. */
int flesh_fit_tangents(flesh_fit *fit, const flesh_fit_experiment *e, double *tangents);
int flesh_fit_motion_tangents(flesh_fit *fit, const flesh_fit_experiment *e, const double *p, double *tangents);
/* Sets direction [parameters] to 1 for parameter k and 0 for others; returns the length of a difference along it at
 * p. */
double flesh_fit_direction(const flesh_fit *fit, const double *p, int k, double *direction);
/* Reads the scenes at p - h direction and p + h direction. */
int flesh_fit_scenes_beside(const flesh_fit *fit, const flesh_fit_experiment *e, const double *p, const double *direction,
                            double h, flesh_scene *scenes[2]);
/* Returns why the quantities measured of a motion have no tangents, or "". */
const char *flesh_fit_motion_refused(const flesh_fit_experiment *e, const flesh_scene *scene);
/* Reads a new scene of an experiment at parameters p. The map, if any, is in DIR/map.csv. */
int flesh_fit_scene_at(const flesh_fit *fit, const flesh_fit_experiment *e, const double *p, flesh_scene **scene);
/* Reads the measured quantities from the tables in a folder. The positions of the last state are x [3*nodes]. */
int flesh_fit_read_values(const flesh_fit_experiment *e, const char *folder, const double *x, double *values);

/* Temporary tables, in the experiment's folder `scratch`: those that its measurements need; NULL: not needed. */
typedef struct flesh_fit_tables {
  flesh_history *history;
  flesh_probes *probes;
} flesh_fit_tables;
int flesh_fit_tables_open(const flesh_fit_experiment *e, const flesh_scene *scene, flesh_fit_tables *tables);
/* Closes the tables and returns `status`, or if that is FLESH_OK the status of writing them. */
int flesh_fit_tables_close(flesh_fit_tables *tables, int status);
/* Removes the tables, their folder, and the folders above it if nothing else is there. */
void flesh_fit_scratch_remove(const flesh_fit *fit, const flesh_fit_experiment *e);

/* Opens DIR/fit.db, with the runs of an earlier fit if there are any. FLESH_ERR_ARGUMENT if they belong to another
 * fit. */
int flesh_fit_runs_open(flesh_fit *fit);
/* Finds the values [count] of a run at p. A missing run is made, and written before this returns.
 * FLESH_FIT_RUN_FAILED. */
int flesh_fit_values_at(flesh_fit *fit, flesh_fit_experiment *e, const double *p, double *values);
/* Finds the derivatives [count * keys] of these values by tangents; if there are none, the experiment's `differences`
 * says why. */
int flesh_fit_tangents_at(flesh_fit *fit, flesh_fit_experiment *e, const double *p, double *tangents);
/* Makes the kept equilibria those of a run at p, which is repeated unless they are. */
int flesh_fit_equilibria_at(flesh_fit *fit, flesh_fit_experiment *e, const double *p);
/* Returns a new object with the number of runs and their cost. */
json_t *flesh_fit_runs_json(const flesh_fit *fit);

/* Computes the values [count] of all experiments at p and, unless `jacobian` is NULL, their derivatives by the keys
 * [count * keys], row by row. FLESH_FIT_RUN_FAILED. */
int flesh_fit_evaluate(flesh_fit *fit, const double *p, double *values, double *jacobian);
/* Does the same at parameters that a search has accepted: FLESH_ERR_SOLVE if a run fails. */
int flesh_fit_evaluate_accepted(flesh_fit *fit, const double *p, double *values, double *jacobian);

/* Returns the derivative of number i by q of key k, over the number's deviation, from `jacobian` [count * keys], the
 * derivatives at p. */
double flesh_fit_by_q(const flesh_fit *fit, const double *p, const double *jacobian, int i, int k);
/* Return the residual of number i over its deviation; the sum of the squares of `count` such residuals. */
double flesh_fit_residual(const flesh_fit *fit, int i, const double *values);
double flesh_fit_squares(const flesh_fit *fit, int first, int count, const double *values);

/* Convert a parameter's value to q, and back; return dp/dq. */
double flesh_fit_q_of(const flesh_fit_parameter *parameter, double p);
double flesh_fit_p_of(const flesh_fit_parameter *parameter, double q);
double flesh_fit_slope(const flesh_fit_parameter *parameter, double p);
/* Return q limited to the bounds; the value of that q, which is within the bounds in spite of rounding. */
double flesh_fit_clamp(const flesh_fit_parameter *parameter, double q);
double flesh_fit_value_at(const flesh_fit_parameter *parameter, double q);
/* Checks start, bounds, spacing and scale (NaN: not given), and sets those that are not given. */
int flesh_fit_check_numbers(flesh_fit_parameter *parameter);

/* A search for a map with one weight of the penalty. */
typedef struct flesh_fit_stage {
  double weight, squares, penalty; /* sum of the squared residuals of the measured numbers; penalty times the weight */
  double determined;               /* estimate of how many numbers, of the map and the keys, the measurements determine */
  int iterations, converged;
} flesh_fit_stage;

enum { FLESH_FIT_STAGES = 40 };

/* The end of a search; its arrays are in the fit's arena. */
typedef struct flesh_fit_found {
  double *p;                 /* [parameters] */
  double *values, *jacobian; /* [count]; [count * keys] dvalue/dp */
  signed char *at_bound;     /* [parameters] -1, 0 or 1: lower bound, none, upper */
  int iterations, converged;
  char words[FLESH_FIT_WORDS]; /* how it ended */
  int stage_count, chosen; /* for maps, as the next members; chosen: the stage whose map is taken */
  flesh_fit_stage stages[FLESH_FIT_STAGES];
  double *deviations;  /* [map] of q, from the regularised Gauss-Newton matrix; NULL: there are too many tets */
  double median, largest; /* of the deviations */
  double *resolutions; /* [map] share of a tet's value that comes from measurements; the rest comes from its neighbours */
  double determined;   /* sum of the resolutions: how many numbers of the map the measurements determine */
} flesh_fit_found;

/* Minimises the sum of squares from the start. FLESH_ERR_SOLVE if the first runs fail. */
int flesh_fit_search(flesh_fit *fit, flesh_fit_found *found);
/* Allocates the end of a search, and checks that the experiments can be run at the start. */
int flesh_fit_found_open(flesh_fit *fit, flesh_fit_found *found);

/* A direction is not determined if its singular value, of the Jacobian whose columns GSL has balanced, is below this share
 * of the largest; differences of solves have errors of that size. */
static const double flesh_fit_least_share = 1e-5;
/* Parameters whose share in a combination is smaller than this part of the largest share are not mentioned. */
static const double flesh_fit_small_share = 1e-2;

/* The error of a parameter; NaN if it is not determined or stays at a bound. */
typedef struct flesh_fit_error {
  double standard, low, high; /* standard error in the parameter's unit; ends of the 95 % interval */
} flesh_fit_error;

/* Statistics of a fit; the arrays are in the fit's arena. */
typedef struct flesh_fit_statistics {
  int count;      /* keys */
  int freedom;    /* degrees of freedom: measured numbers minus free parameters that are determined */
  double squares; /* sum of squared residuals, each over its deviation */
  double scale;   /* sqrt(squares / freedom), size of the residuals in stated deviations; NaN without freedom */
  double quantile; /* of Student's t distribution at 97.5 % */
  flesh_fit_error *errors;
  double *covariance;  /* [count * count] in the parameters' units; NaN if not determined */
  double *correlation; /* [count * count] */
  json_t *sentences; /* what is not determined; the caller of flesh_fit_find_statistics frees it */
} flesh_fit_statistics;

/* Computes the errors of the keys and of a map's tets, and finds what the measurements do not determine.
 * FLESH_ERR_MEMORY; with a map also the errors of runs and solves. */
int flesh_fit_find_statistics(flesh_fit *fit, flesh_fit_found *found, flesh_fit_statistics *statistics);
/* Adds a sentence about a change of n parameters by `shares` [n] that changes no measured quantity: whether it is of a
 * parameter alone, a product, a ratio, or more. */
void flesh_fit_say_null(flesh_fit_statistics *statistics, int n, const char *const *names, const double *shares);

/* Writes result.json, tables, the picture and the fitted scenes, and prints a table. */
int flesh_fit_write(flesh_fit *fit, const flesh_fit_found *found, const flesh_fit_statistics *statistics);
/* Writes result.json of a fit that ended early. */
int flesh_fit_write_ended(const flesh_fit *fit, int status);

#endif
