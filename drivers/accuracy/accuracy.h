/* accuracy.h: what accuracy costs: the runs of `flesh accuracy`, their figures, and what is made of
 * them.
 *
 * Every run is judged after each of its own steps, by its distance from a reference that two different methods made
 * (accuracy_reference.c). */
#ifndef FLESH_ACCURACY_ACCURACY_H
#define FLESH_ACCURACY_ACCURACY_H

#include "accuracy/track.h"
#include "cli/path.h"
#include "study/settings.h"
#include "study/study.h"

typedef struct flesh_accuracy_method {
  const char *name;   /* of --methods and the tables */
  const char *scene;  /* time.method */
  int adaptive;       /* has a tolerance instead of a step; 2: time.adaptive, and its steps end where states are asked for */
  int max_order;      /* time.max_order; 0: the scene's */
  const char *colour; /* "#rrggbb" */
  int mark;           /* gnuplot's point; nearly equal methods lie on each other */
} flesh_accuracy_method;

/* The methods that the command compares: ROW(name, time.method, adaptive, max_order, colour, mark);
 * accuracy_help.txt says what they are. */
#define FLESH_ACCURACY_METHOD_LIST(ROW) \
  ROW("backward-euler", "backward-euler", 0, 0, "#d55e00", 7) \
  ROW("bdf2", "bdf2", 0, 0, "#e69f00", 13) \
  ROW("midpoint", "midpoint", 0, 0, "#009e73", 9) \
  ROW("newmark", "newmark", 0, 0, "#56b4e9", 2) \
  ROW("hht", "hht", 0, 0, "#8c8c8c", 11) \
  ROW("generalized-alpha", "generalized-alpha", 0, 0, "#999933", 8) \
  ROW("runge-kutta", "runge-kutta", 0, 0, "#44aa99", 10) \
  ROW("adaptive-bdf2", "bdf2", 2, 0, "#666633", 1) \
  ROW("adaptive-newmark", "newmark", 2, 0, "#882255", 12) \
  ROW("adaptive-hht", "hht", 2, 0, "#332288", 14) \
  ROW("adaptive-generalized-alpha", "generalized-alpha", 2, 0, "#bb5566", 15) \
  ROW("adaptive", "adaptive", 2, 0, "#117733", 6) \
  ROW("ida", "ida", 1, 2, "#0072b2", 5) \
  ROW("ida5", "ida", 1, 5, "#aa3399", 4)

#define FLESH_ACCURACY_METHOD_ONE(...) +1
enum { FLESH_ACCURACY_METHODS = FLESH_ACCURACY_METHOD_LIST(FLESH_ACCURACY_METHOD_ONE) };

/* Ends with a NULL name. */
extern const flesh_accuracy_method flesh_accuracy_methods[FLESH_ACCURACY_METHODS + 1];
/* Its index; -1: there is none of that name. */
int flesh_accuracy_method_find(const char *name);

/* The group of a row: the methods' work, or another price with everything else fixed; and the cases that these need. */
#define FLESH_ACCURACY_GROUP_LIST(ROW) \
  ROW(WORK, "work") \
  ROW(NEWTON, "newton_tolerance") \
  ROW(LINEAR, "linear_tolerance") \
  ROW(PROJECTION, "eigenvalue_filter") \
  ROW(MASS, "mass") \
  ROW(REFERENCE, "reference")   /* made of two of the next */ \
  ROW(SOURCE, "source")         /* a method, refined until it changes no more */ \
  ROW(TIGHT, "tight")           /* solved to rounding: other prices are compared with it */ \
  ROW(RESOLUTION, "resolution") /* --mesh: on a mesh with an element */ \
  ROW(LIMITS, "limits")         /* what these converge to */ \
  ROW(TIMING, "timing")         /* one of them by another method, for its time alone */
#define FLESH_ACCURACY_GROUP_ONE(name, ...) FLESH_ACCURACY_##name,
typedef enum flesh_accuracy_group { FLESH_ACCURACY_GROUP_LIST(FLESH_ACCURACY_GROUP_ONE) FLESH_ACCURACY_GROUPS } flesh_accuracy_group;
extern const char *const flesh_accuracy_group_names[];

enum { FLESH_ACCURACY_TEXT = 32 };

/* A step, a tolerance: as given and as a number. */
typedef struct flesh_accuracy_value {
  double value;
  char text[FLESH_ACCURACY_TEXT];
} flesh_accuracy_value;

/* NaN where there is none. */
typedef struct flesh_accuracy_figures {
  int status;
  flesh_accuracy_cost cost;         /* of the first run, but the least CPU time */
  double wall_s_median, wall_s_min; /* of the integration alone, without output */
  flesh_accuracy_errors errors;     /* against the reference; below its uncertainty NaN */
  int below;                        /* 1: error_position_rms is below it */
  double difference; /* other prices: position rms against the same run solved tightly [m] */
  double estimate;   /* sources: position rms [m] by its own last change */
  double took_s;     /* sources, meshes */
  int tets, nodes;   /* meshes */
  double poisson;    /* largest of its materials */
  char message[400]; /* of an error; of a source, how it was made */
} flesh_accuracy_figures;
extern const flesh_accuracy_figures flesh_accuracy_unknown;

typedef struct flesh_accuracy_row {
  flesh_accuracy_group group;
  int method;                           /* in flesh_accuracy_methods */
  char setting[80];                     /* "step=1/60", "solver.newton_tolerance=1e-4" */
  double value;                         /* of the setting; NaN for a word */
  flesh_accuracy_value step, tolerance; /* in force; tolerance empty for fixed steps */
  char extra[80];                       /* one more override; may be empty */
  int tight;                            /* every solve to rounding */
  int source, element, refine; /* meshes: 0 the scene, k the k-th of --coarser; flesh_element; times that each tet of the
                                  source's mesh is cut into eight, beyond what its scene says */
  int mesh, timed_by;  /* timing: the rows of its mesh, and of its method and step */
  const char *inputs;  /* digest of files of its own; NULL: none */
  int needs_states;    /* done it is only where the states that it leaves are there */
  int done;
  flesh_accuracy_figures figures;
} flesh_accuracy_row;

/* The reference, and how accurate it is; plain data. */
typedef struct flesh_accuracy_reference {
  double apart;                      /* how far the two differ [m], as error_position_rms */
  double change;                     /* by which the last refinement changed the first [m] */
  double between;                    /* what interpolation between its times adds [m] */
  flesh_accuracy_errors uncertainty; /* the larger of the two, and what goes with it */
  flesh_accuracy_scale scale;
  int times;         /* it is kept at */
  double start, end; /* s */
} flesh_accuracy_reference;

/* A way to a reference: the powers of the step in its error are first, first + stride, ... The first two that reach the end
 * make the reference. */
typedef struct flesh_accuracy_source {
  const char *method;
  int first, stride;
} flesh_accuracy_source;

enum { FLESH_ACCURACY_LIMIT = 32, FLESH_ACCURACY_SOURCES = 5, FLESH_ACCURACY_MESHES = 48, FLESH_ACCURACY_LEVELS = 8 };

extern const flesh_accuracy_source flesh_accuracy_sources[FLESH_ACCURACY_SOURCES];

/* The meshes of --mesh. */
typedef struct flesh_accuracy_meshes {
  int source_count, row_count;
  const char *sources[FLESH_ACCURACY_LEVELS]; /* files: the scene, then --coarser */
  char inputs[FLESH_ACCURACY_LEVELS][FLESH_STUDY_FINGERPRINT], all_inputs[FLESH_STUDY_FINGERPRINT];
  int shared; /* the row whose method and step all have; -1: equilibrium */
  int own_element, own_refine;
  char point_load[80]; /* an effect that acts at single nodes; empty: none does */
} flesh_accuracy_meshes;

typedef struct flesh_accuracy_plan {
  flesh_study_options options; /* folder, ranks, shard, command line, --set */
  const char *scene;
  int mesh;              /* the error of the mesh is measured too */
  double mesh_seconds;   /* to spend on it */
  flesh_texts coarser; /* further meshes for it */
  int tets;            /* of the scene's own */
  int method_count, methods[FLESH_ACCURACY_LIMIT];
  int step_count, tolerance_count; /* steps from the longest to the shortest */
  flesh_accuracy_value steps[FLESH_ACCURACY_LIMIT], tolerances[FLESH_ACCURACY_LIMIT];
  int controlled;     /* errors choose the scene's own steps, which rows of fixed steps must not take over */
  int representative; /* method of the other prices, at the step below; -1: they are not run */
  flesh_accuracy_value representative_step, whole_run;
  int repeat, quick;
  double max_seconds, reference_seconds;
  const char *mass; /* the row's extra value that stands in the scene already */
  /* Hashes of the scenes as they stand; of the scene, the grid and the build together. */
  char fingerprint[FLESH_STUDY_FINGERPRINT];
  char study_fingerprint[160];
  flesh_accuracy_grid grid;
  flesh_accuracy_measure measure;
  flesh_accuracy_reference reference;
  flesh_accuracy_meshes meshes;
  int run_count; /* rows that are told of; behind them there are those of flesh_accuracy_slot */
  flesh_accuracy_row *rows;
} flesh_accuracy_plan;

/* Reads a scene with the overrides of the command line alone. */
int flesh_accuracy_read_as_it_stands(const flesh_accuracy_plan *plan, const char *path, flesh_scene **scene);
/* Reads the row's scene with the overrides of its method, step, tolerance, extra value and mesh. */
int flesh_accuracy_read(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row, flesh_scene **scene);
/* The `flesh run` command that repeats the row. Returns new; NULL without memory. */
char *flesh_accuracy_command(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row);

/* File of the internal steps of an adaptive row, in the plan's folder (NULL: none); "" for other rows. This and the next are
 * for the next few calls (cli/path.h). */
const char *flesh_accuracy_steps_path(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row);
/* File of the states that a row leaves; "" where it leaves none. */
const char *flesh_accuracy_states_path(const flesh_accuracy_plan *plan, int number);
/* "static" for equilibrium, empty for rows that are of no method. */
const char *flesh_accuracy_method_name(const flesh_accuracy_row *row);
const char *flesh_accuracy_scene_of(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row);
/* Digests: of a scene as it stands, of texts. */
int flesh_accuracy_fingerprint(const flesh_accuracy_plan *plan, const char *path, char text[FLESH_STUDY_FINGERPRINT]);
void flesh_accuracy_hash(int count, const char *const *texts, char text[FLESH_STUDY_FINGERPRINT]);

/* Makes plan->rows: methods x steps or tolerances, then the other prices, then room for the others. */
int flesh_accuracy_make_rows(flesh_accuracy_plan *plan);
/* The first row of a group behind plan->run_count. */
int flesh_accuracy_slot(const flesh_accuracy_plan *plan, flesh_accuracy_group group);

/* The data that the rows' processes need. On ranks behind the first `reference` is NULL: they read it, and the run that
 * was solved tightly, from the folder. */
typedef struct flesh_accuracy_work {
  const flesh_accuracy_plan *plan;
  const flesh_accuracy_track *reference, *tight;
} flesh_accuracy_work;
/* The plan as a study, whose records it takes. Borrows both. */
flesh_study flesh_accuracy_study(const flesh_accuracy_work *given, flesh_accuracy_plan *plan);

/* A comparison at work, on the first rank. */
typedef struct flesh_accuracy_session {
  flesh_accuracy_plan *plan;
  flesh_study study;
  flesh_study_store store;
  flesh_accuracy_track reference, tight;
} flesh_accuracy_session;

/* Runs the rows that are not done of a flesh_accuracy_plan, one at a time on each rank, each in its own process, and writes
 * tables, words and pictures; then the meshes. FLESH_ERR_INTERRUPTED after a signal: the rows that were done stand. */
int flesh_accuracy_run(void *plan);
/* Takes what is known of a row behind plan->run_count, which becomes one of the study; does it, where it is not known. */
int flesh_accuracy_known(flesh_accuracy_session *session, int number);
int flesh_accuracy_do(flesh_accuracy_session *session, int number);
/* Reads the reference, or makes it of two methods. Fills plan->reference; its scale.length must be set. FLESH_ERR_SOLVE
 * when fewer than two methods reach the end. */
int flesh_accuracy_make_reference(flesh_accuracy_session *session);
/* The cases, each in this process, with figures in its row: a source, the reference, the run solved tightly, a row. */
int flesh_accuracy_make_source(const flesh_accuracy_plan *plan, int number);
int flesh_accuracy_settle(flesh_accuracy_plan *plan, flesh_accuracy_figures *figures);
int flesh_accuracy_run_tight(const flesh_accuracy_plan *plan, int number);
int flesh_accuracy_do_row(const flesh_accuracy_work *given, int number, flesh_accuracy_figures *figures);

extern const flesh_study_field flesh_accuracy_reference_fields[];
/* accuracy.json: the reference, for people, reports and ranks behind the first; `words`: how it was made. */
int flesh_accuracy_keep(const flesh_accuracy_plan *plan, const char *words);
int flesh_accuracy_load(flesh_accuracy_plan *plan);

/* The error that the mesh makes, beside that of the step: the scene on other meshes and with other elements, at the same
 * times, against a reference of refined meshes. All are compared at the nodes of the scene's own mesh, where the others'
 * displacements are interpolated. */

/* Chooses method and step, runs the meshes as far as the seconds go, finds reference and errors, and tells of them. The
 * runs have been told of, or the scene is for equilibrium. FLESH_ERR_INTERRUPTED, FLESH_ERR_FILE; FLESH_ERR_SOLVE where no
 * method of fixed steps reached the end. */
int flesh_accuracy_run_meshes(flesh_accuracy_session *session);
/* SQL knows this of a row of meshes beside its case. New object. */
json_t *flesh_accuracy_mesh_facts(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row);

/* The cases, each in this process: a run on a mesh, which keeps its states or is timed alone; and what the kept ones
 * converge to, as rows of a table: of each mesh {mesh, error, below, elsewhere}, of each element {element, levels, order,
 * change, coarse, fine}, and {first, second, apart, uncertainty, motion}, lengths in m. */
int flesh_accuracy_run_mesh(const flesh_accuracy_plan *plan, int number);
int flesh_accuracy_find_limits(const flesh_accuracy_plan *plan, json_t *rows);

typedef struct flesh_accuracy_sampler {
  const flesh_mesh *mesh;      /* of the run */
  const double *points;        /* [3*count] at rest */
  int count;
  double *weights;             /* [10*count], and the next behind it */
  int *nodes;                  /* [10*count] of the tet that holds the point */
  flesh_accuracy_grid grid;    /* the times that are kept */
  int next;
  flesh_accuracy_track track;  /* where the points are at these times */
} flesh_accuracy_sampler;

/* For the nodes of plan->measure and times of the plan's grid; the scene must stay. */
int flesh_accuracy_sampler_open(const flesh_accuracy_plan *plan, const flesh_scene *scene,
                                flesh_accuracy_sampler *sampler);
void flesh_accuracy_sampler_close(flesh_accuracy_sampler *sampler);

/* Integrates the scene, or finds its equilibrium where it has no inertia; `sampler` may be NULL. Short runs are
 * repeated: the least CPU time [s]. */
int flesh_accuracy_sample(const flesh_accuracy_plan *plan, const flesh_scene *scene, flesh_accuracy_sampler *sampler,
                          double *cpu_s);

#endif
