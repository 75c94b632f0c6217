/* pass.h: a pass over a recorded motion: common parts of its adjoint (motion.c) and its tangents (tangents.c). A stage
 * moves the point by x = x0 + s_x u, v = v0 + s_v u, a = a0 + s_a u; its base and the end of the step are linear in the
 * known vectors and in u (method_map.h). */
#ifndef FLESH_SENSITIVITY_PASS_H
#define FLESH_SENSITIVITY_PASS_H

#include "sensitivity/trajectory.h"

/* A pass, with arrays of [n] each. */
typedef struct flesh_motion_pass {
  flesh_trajectory *self;
  flesh_method_map map;
  /* Derivatives of these vectors, or of Q by them. */
  double *known[FLESH_KNOWN], *next[FLESH_KNOWN], *stages[FLESH_MAP_STAGES];
  double *lambda, *c, *m, *lag, *force, *moves[3]; /* work space; a parameter's change of constrained dofs' x, v and a */
  double *base;                                 /* [5*n] bases and lagged state of a stage */
  double *ended[2];                             /* forward: x and v at the end of the part's last solve */
  double *reached[2];                           /* forward: x and v of constrained dofs at the end of the part */
  flesh_stage stage;
  unsigned follows;
  int count;                         /* number of parameters, as in the next arrays */
  const flesh_parameter *parameters;
  double *gradient;    /* backward */
  unsigned char *same; /* [count][1 + effects] result of flesh_parameter_compare for each parameter */
  struct flesh_varied_tets *tets; /* backward; NULL: no constant of single tets is a parameter */
  double *by_tet;      /* [tets] */
} flesh_motion_pass;

/* Returns a pass in `room` [FLESH_PASS_ARRAYS*n], which is set to 0. Cannot fail. */
flesh_motion_pass flesh_pass_of(flesh_trajectory *trajectory, double *room);
/* Takes the parameters, and finds the effects that they do not change, in pass->same, new. FLESH_ERR_MEMORY. */
int flesh_pass_take_parameters(flesh_motion_pass *pass, int count, const flesh_parameter *parameters);
/* Finds the change by parameter k at the linearised solution, in pass->force and pass->moves. Returns the errors of
 * flesh_stage_tangent_force. */
int flesh_pass_force(flesh_motion_pass *pass, int k);
/* Linearises a solve of a part, or the acceleration with which a method begins at the known state. Returns the errors of
 * flesh_stage_tangent_set. */
int flesh_pass_linearise(flesh_motion_pass *pass, const flesh_recorded_part *part, int solve);
int flesh_pass_linearise_start(flesh_motion_pass *pass, const flesh_recorded_part *part);
/* Whether the method begins there with the acceleration that balances the forces, which is not one of its own. */
int flesh_pass_begins_by_acceleration(const flesh_motion_pass *pass, const flesh_recorded_part *part);
/* Whether dofs that a method of order 2 constrains jump to their prescribed positions before the part. */
int flesh_pass_jumps(const flesh_motion_pass *pass, const flesh_recorded_part *part);
/* Sets trajectory->prescribed for the part, or for the span over which the method begins. */
void flesh_pass_prescribe(flesh_motion_pass *pass, const flesh_recorded_part *part, int begins);
/* Finds the change of the prescribed motion at t by parameter k, in pass->moves; *moved: whether it is not 0. Returns the
 * errors of flesh_stage_tangent_moves. */
int flesh_pass_moves(flesh_motion_pass *pass, int k, double t, int *moved);
/* Sets y [n] to 0 where trajectory->prescribed constrains it. */
void flesh_pass_forget_constrained(const flesh_motion_pass *pass, double *y);

static inline void flesh_add_scaled(int n, double scale, const double *x, double *y)
{
  for (int d = 0; d < n && scale != 0; d++) y[d] += scale * x[d];
}

#endif
