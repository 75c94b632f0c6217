/* drift.h: the volume-drift comparison: its cases and the figures of each. */
#ifndef FLESH_DRIFT_DRIFT_H
#define FLESH_DRIFT_DRIFT_H

#include "flesh/material.h"
#include "flesh/scene.h"
#include "study/settings.h"
#include "study/study.h"

typedef enum flesh_drift_solver {
  FLESH_DRIFT_GUARDED, /* the scene's own solver */
  FLESH_DRIFT_PLAIN,   /* full Newton steps with clamped Hessian, at most ten, accepted unconverged */
  FLESH_DRIFT_SOLVERS
} flesh_drift_solver;

/* An energy with one choice of its constants. */
typedef struct flesh_drift_variant {
  flesh_energy energy;
  flesh_constants constants;
} flesh_drift_variant;

/* A scene with one mesh and one element. */
typedef struct flesh_drift_scene {
  const char *path;
  char name[96];    /* unique and short */
  const char *element; /* body.element; empty: that of the scene */
  const char *refine;  /* body.refine; empty: that of the scene */
  char fingerprint[FLESH_STUDY_FINGERPRINT];
} flesh_drift_scene;

typedef struct flesh_drift_case {
  const flesh_drift_scene *scene;
  flesh_drift_variant variant;
  double poisson;
  flesh_drift_solver solver;
} flesh_drift_case;

/* Room for variants, up to two choices of constants for each form; room in lists such as that of Poisson's ratios. */
enum { FLESH_DRIFT_VARIANTS = 2 * FLESH_ENERGY_COUNT, FLESH_DRIFT_LIST = 16 };

typedef struct flesh_drift_plan {
  flesh_study_options options; /* folder, ranks, jobs, shard, --set */
  char fingerprint[120]; /* of everything that all cases have in common */
  int scene_count;           /* number of files x elements x refinements */
  flesh_drift_scene *scenes; /* [scene_count] */
  int variant_count;
  flesh_drift_variant variants[FLESH_DRIFT_VARIANTS];
  int poisson_count;
  double poissons[FLESH_DRIFT_LIST];
  int solver_count;
  int solvers[FLESH_DRIFT_SOLVERS]; /* flesh_drift_solver */
  double max_seconds; /* for each case; 0: no limit */
} flesh_drift_plan;

/* Returns a case of scenes x poissons x variants x solvers, of which the last change fastest. */
flesh_drift_case flesh_drift_case_of(const flesh_drift_plan *plan, int number);

/* Names of the solvers, in the order of the enum; ended by NULL. */
extern const char *const flesh_drift_solver_names[];

/* Returns the path of the case's folder below the study's: "runs/<scene>_<energy>_<constants>_<poisson>_<solver>", valid
 * for the next few calls (cli/path.h). */
const char *flesh_drift_case_folder(const flesh_drift_case *c);

/* Implements flesh_study.work. */
json_t *flesh_drift_run_case(const void *plan, int number, const char *folder);

/* Reads a scene of the plan with its element and refinement. FLESH_ERR_ARGUMENT also if it has no body.material. */
int flesh_drift_read(const flesh_drift_plan *plan, const flesh_drift_scene *scene, flesh_scene **read);

#endif
