/* method.h: what an implicit method is: how the unknown of each of its stages moves the point, and the state they lead to.
 *
 * A new method is one file with a flesh_method_row and one line in FLESH_METHOD_LIST. The unknown of every method
 * is the displacement over the whole step, x_{n+1} = x_n + u, so that differences of nearby positions never cancel; that
 * of a stage before the last one is the displacement from the step's start to the stage.
 * Methods ignore constraints: where order > 1 the integrator lets the constrained dofs of the stage and of
 * the new state follow the prescribed motion itself, with its velocity and acceleration, and no step crosses a time
 * at which an effect or constraint stops being smooth. */
#ifndef FLESH_TIME_METHOD_H
#define FLESH_TIME_METHOD_H

#include "flesh/integrator.h"
#include "flesh/kinsol.h"

enum { FLESH_METHOD_VECTORS = 10, FLESH_EASY_STEPS = 3, FLESH_TANGLED_STEPS = 3 };

/* Memory of a method between steps. */
typedef struct flesh_method_memory {
  int n;                                 /* unknowns */
  flesh_method method;
  flesh_method_options options;
  double *v0, *a0;                       /* [n] room for the stage's base */
  double *vectors[FLESH_METHOD_VECTORS]; /* [n]; the first row->vectors are there */
  double *room;                          /* memory of the vectors, and of others that the method needs; owned */
  /* Whether the vectors belong to the present state; 0 at the start, after an event and when the caller hands in
   * another state than it was given back. */
  int known;
  long serial; /* serial number of the state that they belong to (system/evaluation.h) */
  double h;    /* s, length of the step that led there, if known */
  int held;      /* multipliers hold constraints, and errors choose steps */
  int at;        /* the stage that is made or kept, from 0 on */
  int easy;      /* steps in a row that were easy to solve, up to FLESH_EASY_STEPS; < 0: steps left on the way out of a tangle */
  double before; /* s, from the state back to the time of a second remembered acceleration: < 0; 0: there is none */
} flesh_method_memory;

typedef struct flesh_method_row {
  int vectors;
  int remembered;   /* number of vectors kept from step to step, the first ones; 0: all */
  int acceleration; /* 1: vectors[0] is the state's acceleration, which the integrator finds if it is not known */
  /* Returns the number of stages of a step, which are solved in turn; NULL: one. */
  int (*stages)(const flesh_method_memory *memory);
  /* Takes in the stage memory->at, which was solved with the unknowns u. NULL with one stage, as is `weight`. */
  void (*keep)(flesh_method_memory *memory, const flesh_stage *stage, const double *u);
  /* Finds a first iterate u of the stage, for steps of varying length or several stages; `which` is 0 for the better
   * one, 1 for the safer one. Returns whether there is one. NULL: there is none. */
  int (*guess)(const flesh_method_memory *memory, const flesh_stage *stage, double h, int which, double *u);
  /* Returns the weight in the step of the derivatives of stage i, from 1 on; 0: of the start. */
  double (*weight)(const flesh_method_memory *memory, int i);
  /* Returns the order of the step to come, if that depends on the options; NULL: the order in the list. */
  int (*order)(const flesh_method_memory *memory);
  /* Makes the stage memory->at of the step of h from `state` to t_end. */
  void (*stage)(const flesh_method_memory *memory, const flesh_state *state, double t_end, double h,
                flesh_stage *stage);
  /* Finds the velocity v [n] at the end of the step of h from `state`, reached with the unknowns u. NULL: statics has
   * none. */
  void (*velocity)(const flesh_method_memory *memory, const flesh_state *state, const double *u, double h, double *v);
  /* Finds the positions x [n] at that end; NULL: those of the state, moved by u. */
  void (*position)(const flesh_method_memory *memory, double *x);
  /* Takes the memory to that end. NULL: nothing is remembered. */
  void (*finish)(flesh_method_memory *memory, const flesh_state *state, const double *u, double h);
  /* Estimates the local error e [n], in positions, of a step of h from `state` whose last stage was solved with the
   * unknowns u: it falls with h^3, or h^2 if the method is of order 1. Returns whether the estimate is known for this
   * step. NULL: it never is. */
  int (*error)(const flesh_method_memory *memory, const flesh_state *state, const double *u, double h, double *e);
  /* Estimates h times the local error of velocities, e [n], of a step of h whose error in positions is known. Returns e;
   * NULL: the two errors are alike. NULL: they always are. */
  const double *(*momentum)(const flesh_method_memory *memory, double h, double *e);
  int swings;    /* 1: accelerations that steps do not resolve return in each step with the opposite sign */
  double growth; /* largest ratio of a step to the last one that the memory serves; 0: any */
  /* The row with the same formulas and an estimate, which takes this one's place if errors choose steps; NULL: this
   * one. */
  const struct flesh_method_row *controlled;
  /* The row of several stages that stands in for this one: it takes the first step, and all steps until the next start
   * once this row's steps gain energy or accelerations swing. NULL: none. */
  const struct flesh_method_row *stand_in;
} flesh_method_row;

#define FLESH_METHOD_EXTERN(NAME, name, text, order, doc)                                          \
  extern const flesh_method_row flesh_method_##name;
FLESH_METHOD_LIST(FLESH_METHOD_EXTERN)
#undef FLESH_METHOD_EXTERN

/* Finds the first iterate u [n] of a stage with the last acceleration a [n] (`which` 1), or with that extrapolated by
 * `ahead` s from the one `before` it (`which` 0), if memory->before says when that was. Returns whether it is known. */
int flesh_method_guess(const flesh_method_memory *memory, const flesh_stage *stage, const double *a, const double *before,
                       double ahead, int which, double *u);

/* Takes state and memory to the end of a step of h, reached with the unknowns u. Overwrites memory->v0. */
void flesh_method_finish(const flesh_method_row *row, flesh_method_memory *memory, const double *u, double h,
                         flesh_state *state);

/* Returns the row of a method; NULL: there is none. */
const flesh_method_row *flesh_method_find(flesh_method method);

/* Returns the row that estimates its own errors; NULL: there is none. */
const flesh_method_row *flesh_method_controlled(flesh_method method);

/* Names of the methods in a scene, in the order of the enum; then `adaptive`, which is runge-kutta whose error chooses
 * its steps; NULL ends them. */
extern const char *const flesh_method_names[];

#endif
