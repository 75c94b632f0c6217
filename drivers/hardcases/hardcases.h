/* hardcases.h: the battery of hard cases: its cases, the settings they run with, the figures of each
 * run, and what is made of them. */
#ifndef FLESH_HARDCASES_HARDCASES_H
#define FLESH_HARDCASES_HARDCASES_H

#include "flesh/material.h"
#include "shared/options.h"
#include "hardcases/cases.h"

typedef enum flesh_stress_solver {
  FLESH_STRESS_DEFAULT,          /* the library's defaults */
  FLESH_STRESS_KINSOL,           /* KINSOL's own line search on the residual */
  FLESH_STRESS_PLAIN,            /* full projected Newton steps, ten at most, taken as they come */
  FLESH_STRESS_ALWAYS_PROJECTED, /* the defaults, but every Hessian projected */
  FLESH_STRESS_NEVER_PROJECTED,  /* the defaults, but none */
  FLESH_STRESS_CLAMPED,          /* the defaults, but projected eigenvalues become zero */
  FLESH_STRESS_ABSOLUTE,         /* the defaults, but they become absolute values */
  FLESH_STRESS_TRUST_REGION,     /* the defaults, but they become one or the other, in statics too */
  FLESH_STRESS_NO_UNTANGLING,    /* the defaults, but calm tangles are left as they are */
  FLESH_STRESS_SOLVERS
} flesh_stress_solver;

/* A column of the matrix: what a case is run with. */
typedef struct flesh_stress_setting {
  flesh_energy energy;
  flesh_constants constants;
  double poisson, step; /* step in s */
  int first_poisson,
      first_step; /* whether cases with a Poisson's ratio or step of their own run here */
  flesh_stress_solver solver;
} flesh_stress_setting;

/* From best to worst. */
typedef enum flesh_stress_outcome {
  FLESH_STRESS_RECOVERED,     /* back at rest, every solve converged, the potential never rose */
  FLESH_STRESS_PUT_BACK,      /* the same, after calm tangles were put back, which no force did */
  FLESH_STRESS_EQUILIBRIUM,   /* an exact line or point that stayed the equilibrium it is */
  FLESH_STRESS_AT_REST,       /* finished at rest in a stressed state that no load holds */
  FLESH_STRESS_NOT_RECOVERED, /* finished away from its rest shape in another way */
  FLESH_STRESS_UNCONVERGED, /* finished with solves that did not converge, or a potential that rose
                             */
  FLESH_STRESS_STOPPED,     /* ended in order with a statement why */
  FLESH_STRESS_BUDGET,      /* its time was spent */
  FLESH_STRESS_NONFINITE,   /* a number became non-finite */
  FLESH_STRESS_CRASHED,     /* or hung, and was ended from outside */
  FLESH_STRESS_NOT_RUN,
  FLESH_STRESS_OUTCOMES
} flesh_stress_outcome;

/* What the end of a run that did not recover is, after a static solve from there. */
typedef enum flesh_stress_end {
  FLESH_STRESS_END_UNKNOWN,    /* not asked, or the mesh is too large */
  FLESH_STRESS_END_MINIMUM,    /* gradient zero, all eigenvalues of the Hessian positive */
  FLESH_STRESS_END_DEGENERATE, /* gradient zero, none negative, some zero */
  FLESH_STRESS_END_SADDLE,     /* gradient zero, some negative */
  FLESH_STRESS_END_UNTANGLES,  /* the static solve leads back to rest */
  FLESH_STRESS_END_MOVING,     /* the static solve found no equilibrium */
  FLESH_STRESS_ENDS
} flesh_stress_end;

/* Figures of a run; NaN where there is none. Plain data: they come through a pipe from the process
 * that ran it. Phases (the hard one and the release) are summed. */
typedef struct flesh_stress_figures {
  int status, exit_code; /* of the phase that ended the run */
  int crashed_by;        /* signal that ended its process; 0: none */
  int tets, steps;
  long solves, retried, unconverged, at_rounding; /* retried: solves that failed and were halved */
  long newton, linear, direct, projections, backtracks;
  long untanglings, untangled_nodes; /* how often a calm tangle was put back, and nodes moved */
  long rises; /* accepted iterates above their solve's first one, and steps above their start */
  long rises_checked; /* steps looked at: neither halved nor untangled */
  double worst_rise;  /* over the sum of the terms' sizes */
  int finite, max_inverted, inverted_end;
  double stressed_rest;            /* flesh_figures.stressed_rest of the last phase, J */
  double distance, volume_error;   /* from the rest shape at the end */
  double recovered_at;             /* s, since when the distance has been small; NaN: never */
  double newton_ratio, time_ratio; /* worst step over the median one, of the hard phase */
  double wall_s, cpu_s, simulated_s;
  int rank; /* of the end shape: 0 a point, 1 a line, 2 a plane, 3 a body */
  flesh_stress_end end;
  double gradient, smallest_eigenvalue; /* relative; of the equilibrium nearest to the end */
  int negative_eigenvalues;
  char message[400];
} flesh_stress_figures;

typedef struct flesh_stress_run {
  const flesh_stress_case *row;
  const flesh_stress_setting *setting;
  int seed;
  flesh_stress_outcome outcome;
  flesh_stress_figures figures;
} flesh_stress_run;

typedef struct flesh_stress_plan {
  const char *out;
  int quick, jobs;
  double max_seconds; /* per run and phase */
  const flesh_texts *overrides;
  int case_count;
  const flesh_stress_case *const *cases;
  int setting_count;
  const flesh_stress_setting *settings;
  int seeds;
  int run_count;
  flesh_stress_run *runs; /* settings x cases x seeds, in this order */
} flesh_stress_plan;

const char *flesh_stress_solver_name(flesh_stress_solver solver);
const char *flesh_stress_outcome_name(flesh_stress_outcome outcome);
const char *flesh_stress_end_name(flesh_stress_end end);

/* "S 0.49 default": with constants and step where they are not the usual ones. */
void flesh_stress_setting_title(const flesh_stress_setting *setting, char title[80]);

/* "cases/scramble_2_S_0.49_default", below plan->out. */
void flesh_stress_run_folder(const flesh_stress_run *run, char folder[256]);

/* Distance from rest and volume below which a body is back. */
#define FLESH_STRESS_TOLERANCE 1e-3

/* Writes scene.yaml, release.yaml (of cases with a release), the mesh and the start state into
 * `folder` (made when missing). */
int flesh_stress_write_scene(const flesh_stress_plan *plan, const flesh_stress_run *run,
                             const char *folder);

/* Runs one: writes its files, solves its phases, judges. In the calling process. */
void flesh_stress_run_one(const flesh_stress_plan *plan, const flesh_stress_run *run,
                          flesh_stress_figures *figures);

/* Runs all, each in a process of its own, plan->jobs at a time. FLESH_ERR_INTERRUPTED when a signal
 * ended the battery: the runs that were done stand. */
int flesh_stress_run_all(flesh_stress_plan *plan);

/* stress.csv. */
int flesh_stress_write_csv(const flesh_stress_plan *plan);
/* The answer in words: verdict.txt and stdout. */
int flesh_stress_write_verdict(const flesh_stress_plan *plan);
/* matrix.png and frames_*.png. FLESH_ERR_FILE without gnuplot. */
int flesh_stress_draw(const flesh_stress_plan *plan);

#endif
