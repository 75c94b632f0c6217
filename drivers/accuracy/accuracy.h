/* accuracy.h: what accuracy costs: the runs of `flesh accuracy`, their figures, and the results made from them.
 *
 * Every run is judged after each of its own steps, by its distance from a reference that two different methods made
 * (reference.c). */
#ifndef FLESH_ACCURACY_ACCURACY_H
#define FLESH_ACCURACY_ACCURACY_H

#include "accuracy/track.h"
#include "cli/path.h"
#include "study/settings.h"
#include "study/study.h"

typedef struct flesh_accuracy_method {
  const char *name;   /* used in --methods and in the tables */
  const char *scene;  /* time.method */
  int adaptive;       /* 1: has a tolerance instead of a step; 2: so by time.adaptive; its steps end where states are wanted */
  int max_order;      /* time.max_order; 0: the scene's */
  const char *colour; /* "#rrggbb" */
  int mark;           /* gnuplot's point type; curves of nearly equal methods coincide */
} flesh_accuracy_method;

/* The methods that the command compares: ROW(name, time.method, adaptive, max_order, colour, mark). accuracy_help.txt
 * describes them. */
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

/* The table of methods, ended by a NULL name. */
extern const flesh_accuracy_method flesh_accuracy_methods[FLESH_ACCURACY_METHODS + 1];
/* Returns the index of a method; -1: there is none of that name. */
int flesh_accuracy_method_find(const char *name);

/* The groups of rows: the methods' work; other prices, with everything else fixed; and the cases that these need. */
#define FLESH_ACCURACY_GROUP_LIST(ROW) \
  ROW(WORK, "work") \
  ROW(NEWTON, "newton_tolerance") \
  ROW(LINEAR, "linear_tolerance") \
  ROW(PROJECTION, "eigenvalue_filter") \
  ROW(MASS, "mass") \
  ROW(REFERENCE, "reference")   /* made from two sources */ \
  ROW(SOURCE, "source")         /* a method, refined until its results no longer change */ \
  ROW(TIGHT, "tight")           /* solved to rounding, for comparison with the other prices */ \
  ROW(RESOLUTION, "resolution") /* --mesh: a mesh with an element */ \
  ROW(LIMITS, "limits")         /* the limits to which the meshes converge */ \
  ROW(TIMING, "timing")         /* a mesh with another method or step, for its time only */
#define FLESH_ACCURACY_GROUP_ONE(name, ...) FLESH_ACCURACY_##name,
typedef enum flesh_accuracy_group { FLESH_ACCURACY_GROUP_LIST(FLESH_ACCURACY_GROUP_ONE) FLESH_ACCURACY_GROUPS } flesh_accuracy_group;
extern const char *const flesh_accuracy_group_names[];

enum { FLESH_ACCURACY_TEXT = 32 };

/* A step or a tolerance, as a number and as the user wrote it. */
typedef struct flesh_accuracy_value {
  double value;
  char text[FLESH_ACCURACY_TEXT];
} flesh_accuracy_value;

/* The figures of a row; NaN where there is none. */
typedef struct flesh_accuracy_figures {
  int status;
  flesh_accuracy_cost cost;         /* of the first run, except for the CPU time, which is the least of all */
  double wall_s_median, wall_s_min; /* of the integration, without output */
  flesh_accuracy_errors errors;     /* against the reference; NaN if below its uncertainty */
  int below;                        /* 1: error_position_rms is below the uncertainty */
  double difference; /* other prices: RMS distance of positions from the tightly solved run [m] */
  double estimate;   /* sources: RMS change of positions at the last refinement [m] */
  double took_s;     /* sources, meshes */
  int tets, nodes;   /* meshes */
  double poisson;    /* largest among its materials */
  char message[400]; /* of an error; for a source, how it was made */
} flesh_accuracy_figures;
extern const flesh_accuracy_figures flesh_accuracy_unknown;

typedef struct flesh_accuracy_row {
  flesh_accuracy_group group;
  int method;                           /* in flesh_accuracy_methods */
  char setting[80];                     /* "step=1/60", "solver.newton_tolerance=1e-4" */
  double value;                         /* value of the setting; NaN for a word */
  flesh_accuracy_value step, tolerance; /* in force; the tolerance is empty for fixed steps */
  char extra[80];                       /* one further override; may be empty */
  int tight;                            /* every solve converges to rounding */
  int source, element, refine; /* meshes: 0 the scene, k the k-th of --coarser; flesh_element; times that each tet of the
                                  source's mesh is cut into eight, beyond what its scene says */
  int mesh, timed_by;  /* timing: the rows that give the mesh, and the method and step */
  const char *inputs;  /* digest of the row's own input files; NULL: none */
  int needs_states;    /* it counts as done only while the file of its states exists */
  int done;
  flesh_accuracy_figures figures;
} flesh_accuracy_row;

/* The reference and its accuracy; plain data. */
typedef struct flesh_accuracy_reference {
  double apart;                      /* distance of its two sources [m], as error_position_rms */
  double change;                     /* change of the first source at its last refinement [m] */
  double between;                    /* error of interpolation between its times [m] */
  flesh_accuracy_errors uncertainty; /* the larger of `apart` and `change`, plus `between`; other errors likewise */
  flesh_accuracy_scale scale;
  int times;         /* number of times at which it is kept */
  double start, end; /* s */
} flesh_accuracy_reference;

/* A method that can be a source of the reference; the powers of the step in its error are first, first + stride, ...
 * The first two methods that reach the end make the reference. */
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
  int shared; /* the row whose method and step all meshes use; -1: equilibrium */
  int own_element, own_refine;
  char point_load[80]; /* name of an effect that acts at single nodes; "" if none does */
} flesh_accuracy_meshes;

typedef struct flesh_accuracy_plan {
  flesh_study_options options; /* folder, ranks, shard, command line, --set */
  const char *scene;
  int mesh;              /* the error of the mesh is also measured */
  double mesh_seconds;   /* budget for it */
  flesh_texts coarser; /* further meshes for it */
  int tets;            /* of the scene's own mesh */
  int method_count, methods[FLESH_ACCURACY_LIMIT];
  int step_count, tolerance_count; /* the steps go from the longest to the shortest */
  flesh_accuracy_value steps[FLESH_ACCURACY_LIMIT], tolerances[FLESH_ACCURACY_LIMIT];
  int controlled;     /* the scene's steps are chosen by error control, which rows with fixed steps must switch off */
  int representative; /* method of the other prices, with the step below; -1: they are not run */
  flesh_accuracy_value representative_step, whole_run;
  int repeat, quick;
  double max_seconds, reference_seconds;
  const char *mass; /* the extra value of a row that the scene already has */
  char fingerprint[160]; /* of the scene as it stands, the grid and the build together */
  flesh_accuracy_grid grid;
  flesh_accuracy_measure measure;
  flesh_accuracy_reference reference;
  flesh_accuracy_meshes meshes;
  int run_count; /* number of rows that are reported; behind them are those of flesh_accuracy_slot */
  flesh_accuracy_row *rows;
  flesh_study study;
  flesh_study_store store; /* opened by the first rank */
} flesh_accuracy_plan;

/* Collects the plan's overrides and those of the row's method, step, tolerance, extra value and mesh; the caller closes
 * them. */
void flesh_accuracy_override(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row, flesh_overrides *all);
/* Reads the row's scene with these overrides. */
int flesh_accuracy_read(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row, flesh_scene **scene);

/* Returns the path of the file of an adaptive row's internal steps, in the plan's folder (plan NULL: without the folder); ""
 * for other rows. This path and the next are valid for the next few calls (cli/path.h). */
const char *flesh_accuracy_steps_path(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row);
/* Returns the path of the file of the states that a row leaves; "" if it leaves none. */
const char *flesh_accuracy_states_path(const flesh_accuracy_plan *plan, int number);
/* Returns "static" for equilibrium, "" for rows without a method. */
const char *flesh_accuracy_method_name(const flesh_accuracy_row *row);
const char *flesh_accuracy_scene_of(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row);
/* Computes a digest of texts. */
void flesh_accuracy_hash(int count, const char *const *texts, char text[FLESH_STUDY_FINGERPRINT]);

/* Makes plan->rows: methods x steps or tolerances, then the other prices, then room for the other groups. */
int flesh_accuracy_make_rows(flesh_accuracy_plan *plan);
/* Returns the number of the first row of a group behind plan->run_count. */
int flesh_accuracy_slot(const flesh_accuracy_plan *plan, flesh_accuracy_group group);

/* Returns the plan as a study, whose records it takes. Borrows the plan. */
flesh_study flesh_accuracy_study(flesh_accuracy_plan *plan);

/* Runs the unfinished rows of the study's plan, one at a time on each rank, each in its own process, and writes tables,
 * texts and pictures; then runs the meshes. FLESH_ERR_INTERRUPTED after a signal; finished rows are kept. */
flesh_study_course flesh_accuracy_run;
/* The first makes a row behind plan->run_count a case of the study and takes its record, if it has one; the second also
 * runs the row if it has none. */
int flesh_accuracy_known(flesh_accuracy_plan *plan, int number);
int flesh_accuracy_do(flesh_accuracy_plan *plan, int number);
/* Reads the reference, or makes it from two methods, and sets plan->reference, whose scale.length must be set before.
 * FLESH_ERR_SOLVE if fewer than two methods reach the end. */
int flesh_accuracy_make_reference(flesh_accuracy_plan *plan);
/* Run the kinds of case in this process and write figures to the row: a source, the reference, the tightly solved run,
 * a row. */
int flesh_accuracy_make_source(const flesh_accuracy_plan *plan, int number);
int flesh_accuracy_settle(flesh_accuracy_plan *plan, flesh_accuracy_figures *figures);
int flesh_accuracy_run_tight(const flesh_accuracy_plan *plan, int number);
int flesh_accuracy_do_row(flesh_accuracy_plan *plan, int number);

extern const flesh_study_field flesh_accuracy_reference_fields[];
/* Write and read accuracy.json: the reference, for people, reports and the other ranks; `words`: how it was made. */
int flesh_accuracy_keep(const flesh_accuracy_plan *plan, const char *words);
int flesh_accuracy_load(flesh_accuracy_plan *plan);

/* The following functions find the error of the mesh, besides that of the step: they run the scene on other meshes and
 * with other elements, and compare at the same times with a reference from refined meshes. All are compared at the
 * nodes of the scene's own mesh, to which the others' displacements are interpolated. */

/* Chooses method and step, runs the meshes as far as the seconds allow, finds reference and errors, and reports them.
 * The runs have been reported, or the scene is for equilibrium. FLESH_ERR_INTERRUPTED, FLESH_ERR_FILE; FLESH_ERR_SOLVE
 * if no method with fixed steps reached the end. */
int flesh_accuracy_run_meshes(flesh_accuracy_plan *plan);
/* Returns a new object of what the SQL knows about a row of meshes beside its case. */
json_t *flesh_accuracy_mesh_facts(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row);

/* Run the kinds of case in this process: a run on a mesh, which keeps its states or is only timed; and the limits of
 * the kept ones, as rows of a table: for each mesh {mesh, error, below, elsewhere}, for each element {element, levels,
 * order, change, coarse, fine}, and {first, second, apart, uncertainty, motion}; lengths in m. */
int flesh_accuracy_run_mesh(const flesh_accuracy_plan *plan, int number);
int flesh_accuracy_find_limits(const flesh_accuracy_plan *plan, json_t *rows);

/* Integrates the scene, or finds its equilibrium if it has no inertia. Short runs are repeated; *cpu_s is the least CPU
 * time [s]. The new track (NULL: none) has the positions of the nodes of plan->measure at times of the plan's grid. */
int flesh_accuracy_sample(const flesh_accuracy_plan *plan, const flesh_scene *scene, flesh_accuracy_track *track,
                          double *cpu_s);

#endif
