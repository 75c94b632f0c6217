/* hardcases.h: the battery of hard cases: its cases, the settings they run with, the figures of each
 * run, and what is made of them. */
#ifndef FLESH_HARDCASES_HARDCASES_H
#define FLESH_HARDCASES_HARDCASES_H

#include <math.h>

#include "flesh/body.h"
#include "flesh/material.h"
#include "flesh/scene.h"
#include "flesh/solver.h"
#include "run/run_trace.h"
#include "cli/path.h"
#include "study/study.h"
#include "hardcases/cases.h"

/* ROW(id, name, solver's keys in a scene; "": the library's defaults). Projected eigenvalues become zero, absolute values, or
 * one or the other; where every Hessian is projected so, it is "always". A solver is "bare" without
 * any technique but those that say when a solve has come to its end. */
#define FLESH_HARDCASES_BARE "techniques: [balanced_target, approximate_wolfe]"
#define FLESH_HARDCASES_SOLVER_LIST(ROW)                                                                               \
  ROW(DEFAULT, "default", "")                                                                                          \
  ROW(KINSOL, "kinsol-line-search", "line_search: residual")                                                           \
  /* Full projected Newton steps, ten at most, taken as they come. */                                                  \
  ROW(PLAIN, "plain", "line_search: none, eigenvalue_filter: trust-region-always, max_newton: 10, max_cutbacks: 0, "   \
                      "accept_unconverged: true")                                                                      \
  ROW(ALWAYS_PROJECTED, "always-projected", "eigenvalue_filter: trust-region-always")                                  \
  ROW(NEVER_PROJECTED, "never-projected", "eigenvalue_filter: none")                                                   \
  ROW(CLAMPED, "clamped", "eigenvalue_filter: clamp")                                                                  \
  ROW(ABSOLUTE, "absolute", "eigenvalue_filter: absolute")                                                             \
  ROW(TRUST_REGION, "trust-region", "eigenvalue_filter: trust-region")                                                 \
  ROW(CLAMPED_ALWAYS, "clamped-always", "eigenvalue_filter: clamp-always") /* from here on not of "all" */             \
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
  FLESH_HARDCASES_WITHOUT, /* the defaults without a technique: this plus the number of the technique's bit */
  FLESH_HARDCASES_SOLVER_LIMIT = FLESH_HARDCASES_WITHOUT + 32
} flesh_hardcases_solver;

/* A mesh that takes the place of the cases' own. */
typedef struct flesh_hardcases_body {
  char name[64];    /* "8x4x2", or the file's without folder and suffix */
  const char *file; /* NULL: a block of `cells` */
  int cells[3];
} flesh_hardcases_body;

/* A column of the matrix: what a case is run with. */
typedef struct flesh_hardcases_setting {
  flesh_energy energy;
  flesh_constants constants;
  double poisson, step; /* step in s */
  int first_poisson,
      first_step; /* whether cases with a Poisson's ratio or step of their own run here */
  flesh_hardcases_solver solver;
  flesh_element element; /* tet4, tet10 or tet10-mean */
  const flesh_hardcases_body *body; /* NULL: the cases' own meshes */
} flesh_hardcases_setting;

/* From best to worst: ROW(id, name). data/studies has them by these names, and "crashed or hung" of a run that ended without
 * any. */
#define FLESH_HARDCASES_OUTCOME_LIST(ROW)                                                                              \
  ROW(RECOVERED, "recovered") /* back at rest, every solve converged, the potential never rose */           \
  ROW(UNTANGLED, "untangled") /* the same, after untangling, which no motion does */                        \
  ROW(EQUILIBRIUM, "equilibrium") /* an exact line or point that stayed the equilibrium it is */            \
  ROW(AT_REST, "stressed at rest") /* finished at rest in a stressed state that no load holds */            \
  ROW(NOT_RECOVERED, "not recovered") /* finished away from its rest shape in another way */                \
  ROW(UNCONVERGED, "unconverged") /* finished with solves that did not converge, or a potential that rose */ \
  ROW(STOPPED, "stopped") /* ended in order with a statement why */                                         \
  ROW(BUDGET, "out of budget") /* its time was spent */                                                     \
  ROW(NONFINITE, "non-finite") /* a number became non-finite */                                             \
  ROW(NOT_RUN, "interrupted")
typedef enum flesh_hardcases_outcome {
  FLESH_HARDCASES_OUTCOME_LIST(FLESH_HARDCASES_ID) FLESH_HARDCASES_OUTCOMES
} flesh_hardcases_outcome;

/* The kind of end that a run without recovery has, after a static solve from there; data/studies/hardcases.sql names them
 * by these numbers. */
typedef enum flesh_hardcases_end {
  FLESH_HARDCASES_END_UNKNOWN,    /* not asked, or the mesh is too large */
  FLESH_HARDCASES_END_MINIMUM,    /* gradient zero, all eigenvalues of the Hessian positive */
  FLESH_HARDCASES_END_DEGENERATE, /* gradient zero, none negative, some zero */
  FLESH_HARDCASES_END_SADDLE,     /* gradient zero, some negative */
  FLESH_HARDCASES_END_UNTANGLES,  /* the static solve leads back to rest */
  FLESH_HARDCASES_END_MOVING      /* no equilibrium found */
} flesh_hardcases_end;

/* Figures of a run; NaN where there is none. Plain data: they come through a pipe from the process
 * that ran it. Phases (the hard one and the release) are summed. */
typedef struct flesh_hardcases_figures {
  int status, exit_code; /* of the phase that ended the run */
  int tets, steps;
  long solves, retried, unconverged, at_rounding; /* retried: solves that failed and were halved */
  long newton, linear, direct, projections, backtracks;
  long untanglings, untangled_nodes; /* how often a tangle in equilibrium was removed, and nodes moved */
  long rises; /* accepted iterates above their solve's first one, and steps above their start */
  long rises_checked; /* steps looked at: neither halved nor untangled */
  double worst_rise;  /* over the sum of the terms' sizes */
  int finite, max_inverted, inverted_end;
  double stressed_rest;            /* flesh_figures.stressed_rest of the last phase, J */
  double distance, volume_error;   /* from the rest shape at the end */
  double recovered_at;             /* s, since when the distance has been small; NaN: never */
  double newton_ratio, time_ratio; /* worst step over the median one, of the hard phase */
  flesh_longest_step longest; /* of the phase where it is longer beside the median */
  double wall_s, cpu_s, simulated_s;
  int rank; /* of the end shape: 0 a point, 1 a line, 2 a plane, 3 a body */
  flesh_hardcases_end end;
  double gradient, smallest_eigenvalue; /* relative; of the equilibrium nearest to the end */
  int negative_eigenvalues;
  char message[400];
} flesh_hardcases_figures;

typedef struct flesh_hardcases_run {
  const flesh_hardcases_case *row;
  const flesh_hardcases_setting *setting;
  int seed;
} flesh_hardcases_run;

typedef struct flesh_hardcases_plan {
  flesh_study_options options; /* folder, ranks, jobs, shard, --set */
  char fingerprint[1024]; /* of what all runs have in common */
  int quick;
  int filters;  /* compares eigenvalue filters */
  int shapes;   /* puts the bodies of --meshes through the cases that any shape can go through */
  int ablation; /* compares the default with itself without each technique */
  int export;   /* writes the static cases as data instead of running them */
  int lean;     /* runs that recover leave no mesh and no state: with any of the three, of thousands of runs */
  double max_seconds; /* per run and phase */
  double share[2];    /* of the problems those are run whose hash lies from the first to below the second */
  int case_count;
  const flesh_hardcases_case *const *cases;
  int setting_count;
  const flesh_hardcases_setting *settings;
  int seeds;
  int run_count;
  flesh_hardcases_run *runs; /* settings x cases x seeds, in this order */
} flesh_hardcases_plan;

/* Poisson's ratio of the run: that of its case, where it has one. */
static inline double flesh_hardcases_poisson(const flesh_hardcases_run *run)
{
  return isnan(run->row->poisson) ? run->setting->poisson : run->row->poisson;
}

/* "default", "clamped", "without-watchdog", ...; NULL: there is no such solver. */
const char *flesh_hardcases_solver_name(flesh_hardcases_solver solver);
/* The technique that the solver goes without; 0: none. */
flesh_technique flesh_hardcases_left_out(flesh_hardcases_solver solver);
const char *flesh_hardcases_outcome_name(flesh_hardcases_outcome outcome);

/* "S 0.49 default": with mesh, constants, step and element where they are not the usual ones. */
void flesh_hardcases_setting_title(const flesh_hardcases_setting *setting, char title[112]);

/* "cases/scramble_2_S_0.49_default", below the study's folder; for the next few calls (cli/path.h). */
const char *flesh_hardcases_run_folder(const flesh_hardcases_run *run);

/* Distance from rest and volume below which a body is back. */
#define FLESH_HARDCASES_TOLERANCE 1e-3

/* The mesh of the run: the case's, with nodes on edges where its element has ten. Returns new. */
int flesh_hardcases_run_mesh(const flesh_hardcases_plan *plan, const flesh_hardcases_run *run, flesh_mesh **mesh);

/* Writes scene.yaml, release.yaml (of cases with a release), the mesh and the start state into
 * `folder` (made when missing). */
int flesh_hardcases_write_scene(const flesh_hardcases_plan *plan, const flesh_hardcases_run *run,
                                const char *folder);

/* Runs one: writes its files, solves its phases, judges. In the calling process. */
void flesh_hardcases_run_one(const flesh_hardcases_plan *plan, const flesh_hardcases_run *run,
                             flesh_hardcases_figures *figures);

/* The shape that the scene's body rests in with the pins that are left at time t, as a mesh; new,
 * or NULL where there is none or none is found (a form that collapses). */
void flesh_hardcases_rest_shape(const flesh_scene *scene, double t, flesh_mesh **rest);

/* Dimensions that the body fills: 0 a point ... 3; an extent below 1e-6 of the rest shape's length
 * is none. */
int flesh_hardcases_rank(const flesh_mesh *mesh, const double *x);

/* Looks for the equilibrium at the end `x` [3*nodes] by a static solve from there and says what it
 * is in figures->end, gradient, smallest_eigenvalue, negative_eigenvalues. `rest` may be NULL. */
void flesh_hardcases_judge_end(const flesh_scene *scene, double t, const double *x,
                               const flesh_mesh *rest, flesh_hardcases_figures *figures);

/* The outcome by the figures of a run of the case. */
flesh_hardcases_outcome flesh_hardcases_judge(const flesh_hardcases_case *row, const flesh_hardcases_figures *figures);

/* Writes the static cases without effects as data that other solvers read, below the study's folder. FLESH_ERR_ARGUMENT where
 * there is none or a run has a solver. */
int flesh_hardcases_export(const flesh_hardcases_plan *plan);

/* The plan as a study. Borrows it. */
flesh_study flesh_hardcases_study(flesh_hardcases_plan *plan);

#endif
