/* hardcases.h: the battery of hard cases: the settings with which cases are run, the figures of each run, and their
 * judgement. */
#ifndef FLESH_HARDCASES_HARDCASES_H
#define FLESH_HARDCASES_HARDCASES_H

#include <math.h>

#include "flesh/body.h"
#include "flesh/material.h"
#include "flesh/scene.h"
#include "flesh/solver.h"
#include "run/result.h"
#include "cli/path.h"
#include "study/study.h"
#include "hardcases/cases.h"

/* The solvers: ROW(id, name, solver keys in a scene; "" for the library's defaults). Names tell what projected
 * eigenvalues become: zero, absolute values, or either; "always" means that every Hessian is projected. A "bare" solver
 * has no technique except those that say when a solve has converged. */
#define FLESH_HARDCASES_BARE "techniques: [balanced_target, approximate_wolfe]"
#define FLESH_HARDCASES_SOLVER_LIST(ROW)                                                                               \
  ROW(DEFAULT, "default", "")                                                                                          \
  ROW(KINSOL, "kinsol-line-search", "line_search: residual")                                                           \
  /* Full projected Newton steps, at most ten, accepted unconverged. */                                                \
  ROW(PLAIN, "plain", "line_search: none, eigenvalue_filter: trust-region-always, max_newton: 10, max_cutbacks: 0, "   \
                      "accept_unconverged: true")                                                                      \
  ROW(ALWAYS_PROJECTED, "always-projected", "eigenvalue_filter: trust-region-always")                                  \
  ROW(NEVER_PROJECTED, "never-projected", "eigenvalue_filter: none")                                                   \
  ROW(CLAMPED, "clamped", "eigenvalue_filter: clamp")                                                                  \
  ROW(ABSOLUTE, "absolute", "eigenvalue_filter: absolute")                                                             \
  ROW(TRUST_REGION, "trust-region", "eigenvalue_filter: trust-region")                                                 \
  ROW(CLAMPED_ALWAYS, "clamped-always", "eigenvalue_filter: clamp-always") /* from here on not part of "all" */        \
  ROW(ABSOLUTE_ALWAYS, "absolute-always", "eigenvalue_filter: absolute-always")                                        \
  ROW(TRUST_REGION_ALWAYS, "trust-region-always", "eigenvalue_filter: trust-region-always")                            \
  ROW(CLAMPED_BARE, "clamped-bare", "eigenvalue_filter: clamp, " FLESH_HARDCASES_BARE)                                 \
  ROW(ABSOLUTE_BARE, "absolute-bare", "eigenvalue_filter: absolute, " FLESH_HARDCASES_BARE)                            \
  ROW(TRUST_REGION_BARE, "trust-region-bare", "eigenvalue_filter: trust-region, " FLESH_HARDCASES_BARE)                \
  ROW(CLAMPED_ALWAYS_BARE, "clamped-always-bare", "eigenvalue_filter: clamp-always, " FLESH_HARDCASES_BARE)            \
  ROW(ABSOLUTE_ALWAYS_BARE, "absolute-always-bare", "eigenvalue_filter: absolute-always, " FLESH_HARDCASES_BARE)       \
  ROW(TRUST_REGION_ALWAYS_BARE, "trust-region-always-bare", "eigenvalue_filter: trust-region-always, " FLESH_HARDCASES_BARE)

typedef enum flesh_hardcases_solver {
  FLESH_HARDCASES_SOLVER_LIST(FLESH_HARDCASES_ID)
  FLESH_HARDCASES_WITHOUT, /* the defaults without one technique: this plus the bit number of the technique */
  FLESH_HARDCASES_SOLVER_LIMIT = FLESH_HARDCASES_WITHOUT + 32
} flesh_hardcases_solver;

/* A mesh that replaces the cases' own meshes. */
typedef struct flesh_hardcases_body {
  char name[64];    /* "8x4x2", or the file's name without folder and suffix */
  const char *file; /* NULL: a block of `cells` */
  int cells[3];
} flesh_hardcases_body;

/* A column of the matrix: the setting with which a case is run. */
typedef struct flesh_hardcases_setting {
  flesh_energy energy;
  flesh_constants constants;
  double poisson, step; /* step in s */
  int first_poisson,
      first_step; /* whether cases with their own Poisson's ratio or step are run in this setting */
  flesh_hardcases_solver solver;
  flesh_element element; /* tet4, tet10 or tet10-mean */
  const flesh_hardcases_body *body; /* NULL: the cases' own meshes */
} flesh_hardcases_setting;

/* The outcomes, from best to worst: ROW(id, name). data/studies refers to these names, and has "crashed or hung" for a
 * run that ended without an outcome. */
#define FLESH_HARDCASES_OUTCOME_LIST(ROW)                                                                              \
  ROW(RECOVERED, "recovered") /* back at rest, every solve converged, the potential never rose */           \
  ROW(UNTANGLED, "untangled") /* the same, after untangling, which no motion does */                        \
  ROW(EQUILIBRIUM, "equilibrium") /* an exact line or point that stayed in its equilibrium */               \
  ROW(AT_REST, "stressed at rest") /* finished at rest in a stressed state that no load holds */            \
  ROW(NOT_RECOVERED, "not recovered") /* finished away from its rest shape otherwise */                     \
  ROW(UNCONVERGED, "unconverged") /* finished, but some solve did not converge or the potential rose */      \
  ROW(STOPPED, "stopped") /* ended in order, with the reason */                                             \
  ROW(BUDGET, "out of budget") /* its time ran out */                                                       \
  ROW(NONFINITE, "non-finite") /* a number became non-finite */                                             \
  ROW(NOT_RUN, "interrupted")
typedef enum flesh_hardcases_outcome {
  FLESH_HARDCASES_OUTCOME_LIST(FLESH_HARDCASES_ID) FLESH_HARDCASES_OUTCOMES
} flesh_hardcases_outcome;

/* The kind of end of a run that has not recovered, as a static solve from there finds it; data/studies/hardcases.sql
 * refers to these numbers. */
typedef enum flesh_hardcases_end {
  FLESH_HARDCASES_END_UNKNOWN,    /* not examined, or the mesh is too large */
  FLESH_HARDCASES_END_MINIMUM,    /* gradient zero, all eigenvalues of the Hessian positive */
  FLESH_HARDCASES_END_DEGENERATE, /* gradient zero, no eigenvalue negative, some zero */
  FLESH_HARDCASES_END_SADDLE,     /* gradient zero, some eigenvalues negative */
  FLESH_HARDCASES_END_UNTANGLES,  /* the static solve leads back to the rest shape */
  FLESH_HARDCASES_END_MOVING      /* no equilibrium found */
} flesh_hardcases_end;

/* Figures of a run; NaN where there is none. Plain data, as they come through a pipe from the process of the run.
 * Counts are summed over the finished steps of the phases (the hard one and the release). */
typedef struct flesh_hardcases_figures {
  int status, exit_code; /* of the phase that ended the run */
  int tets, steps;
  struct {
    FLESH_FIGURES_COUNT_LIST(FLESH_FIGURES_MEMBER)
  } counts;
  long retried; /* solves that failed, after which the step was halved */
  long rises; /* number of accepted iterates above the first of their solve, and of steps above their start */
  long rises_checked; /* number of steps that were checked: neither halved nor untangled */
  double worst_rise;  /* rise over the sum of the sizes of the terms */
  int finite, max_inverted, inverted_end;
  double stressed_rest;            /* flesh_figures.stressed_rest of the last phase, J */
  double distance, volume_error;   /* from the rest shape, at the end */
  double recovered_at;             /* s, time since which the distance has been small; NaN: never */
  double newton_ratio, time_ratio; /* of the most expensive step to the median one, in the hard phase */
  flesh_longest_step longest; /* of the phase in which it is longer relative to the median */
  double wall_s, cpu_s, simulated_s;
  int rank; /* dimension of the end shape: 0 a point, 1 a line, 2 a plane, 3 a body */
  flesh_hardcases_end end;
  double gradient, smallest_eigenvalue; /* relative; at the equilibrium nearest to the end */
  int negative_eigenvalues;
  char message[400];
} flesh_hardcases_figures;

typedef struct flesh_hardcases_run {
  const flesh_hardcases_case *hardcase;
  const flesh_hardcases_setting *setting;
  int seed;
} flesh_hardcases_run;

typedef struct flesh_hardcases_plan {
  flesh_study_options options; /* folder, ranks, jobs, shard, --set */
  char fingerprint[1024]; /* of everything that all runs have in common */
  int quick;
  int filters;  /* compares eigenvalue filters */
  int shapes;   /* runs the bodies of --meshes through the cases that suit any shape */
  int ablation; /* compares the default solver with itself minus one technique at a time */
  int export;   /* writes the static cases as data instead of running them */
  int lean;     /* runs that recover leave no mesh and no state; set with any of the three, which have thousands of runs */
  double max_seconds; /* for each run and phase */
  double share[2];    /* only problems are run whose hash is at least the first and below the second */
  flesh_hardcases_battery battery;
  int case_count;
  const flesh_hardcases_case **cases; /* the chosen ones, with room for all of the battery */
  int setting_count;
  flesh_hardcases_setting *settings;
  int seeds;
  int run_count;
  flesh_hardcases_run *runs; /* settings x cases x seeds, in this order */
} flesh_hardcases_plan;

/* Returns Poisson's ratio of the run: that of its case, if given, else that of its setting. */
static inline double flesh_hardcases_poisson(const flesh_hardcases_run *run)
{
  return isnan(run->hardcase->poisson) ? run->setting->poisson : run->hardcase->poisson;
}

/* Returns "default", "clamped", "without-watchdog", ...; NULL: there is no such solver. */
const char *flesh_hardcases_solver_name(flesh_hardcases_solver solver);
/* Returns the technique that the solver omits; 0: none. */
flesh_technique flesh_hardcases_left_out(flesh_hardcases_solver solver);

/* Writes "S 0.49 default"; with mesh, constants, step and element if they are not the usual ones. */
void flesh_hardcases_setting_title(const flesh_hardcases_setting *setting, char title[112]);

/* Returns "cases/scramble_2_S_0.49_default", a path below the study's folder that is valid for the next few calls
 * (cli/path.h). */
const char *flesh_hardcases_run_folder(const flesh_hardcases_run *run);

/* Limit on the distance from rest and on the error of volume for a body that is back. */
#define FLESH_HARDCASES_TOLERANCE 1e-3

/* Makes the mesh of the run, new: that of the case, with nodes on edges if the element has ten nodes. */
int flesh_hardcases_run_mesh(const flesh_hardcases_plan *plan, const flesh_hardcases_run *run, flesh_mesh **mesh);

/* Writes scene.yaml, release.yaml (for cases with a release), the mesh and the start state into `folder`, which is made
 * if it does not exist. */
int flesh_hardcases_write_scene(const flesh_hardcases_plan *plan, const flesh_hardcases_run *run,
                                const char *folder);

/* Runs one case in the calling process: writes its files, solves its phases and judges the end. */
void flesh_hardcases_run_one(const flesh_hardcases_plan *plan, const flesh_hardcases_run *run,
                             flesh_hardcases_figures *figures);

/* Finds the shape in which the scene's body rests with the pins that remain at time t, as a new mesh; NULL if there is
 * none or none is found (a form that collapses). */
void flesh_hardcases_rest_shape(const flesh_scene *scene, double t, flesh_mesh **rest);

/* Returns the number of dimensions that the body fills, from 0 for a point to 3; an extent below 1e-6 of the length of
 * the rest shape counts as none. */
int flesh_hardcases_rank(const flesh_mesh *mesh, const double *x);

/* Finds the equilibrium nearest to the end `x` [3*nodes] by a static solve, and describes it in figures->end, gradient,
 * smallest_eigenvalue and negative_eigenvalues. `rest` may be NULL. */
void flesh_hardcases_judge_end(const flesh_scene *scene, double t, const double *x,
                               const flesh_mesh *rest, flesh_hardcases_figures *figures);

/* Returns the outcome of a run of the case with these figures. */
flesh_hardcases_outcome flesh_hardcases_judge(const flesh_hardcases_case *hardcase, const flesh_hardcases_figures *figures);

/* Writes the static cases without effects as data for other solvers, below the study's folder. FLESH_ERR_ARGUMENT if
 * there is none or if a run has a solver. */
int flesh_hardcases_export(const flesh_hardcases_plan *plan);

/* Returns the plan as a study, which borrows it. */
flesh_study flesh_hardcases_study(flesh_hardcases_plan *plan);

#endif
