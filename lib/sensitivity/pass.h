/* pass.h: a pass over a recorded motion, with what its adjoint (motion.c) and its tangents (tangents.c) share. A stage moves
 * the point by x = x0 + s_x u, v = v0 + s_v u, a = a0 + s_a u, its base and the end of the step being linear in what is
 * known and in u (method_map.h). */
#ifndef FLESH_SENSITIVITY_PASS_H
#define FLESH_SENSITIVITY_PASS_H

#include "sensitivity/trajectory.h"

/* Its arrays, [n] each. */
typedef struct flesh_motion_pass {
  flesh_trajectory *self;
  flesh_method_map map;
  double *known[FLESH_KNOWN], *next[FLESH_KNOWN], *stages[FLESH_MAP_STAGES]; /* derivatives, or of Q by them */
  double *lambda, *c, *m, *lag, *force, *moves[3]; /* room; what a parameter moves of constrained dofs' x, v and a */
  double *base;                                 /* [5*n] of a stage */
  double *ended[2];                             /* forward: x and v where the part's last solve has ended */
  double *reached[2];                           /* forward: of constrained dofs, where the part ends */
  flesh_stage stage;
  unsigned follows;
  int count;                         /* of parameters, as are the next */
  const flesh_parameter *parameters;
  double *gradient;    /* backward */
  unsigned char *same; /* [count][1 + effects] of each parameter, flesh_parameter_compare's */
  struct flesh_varied_tets *tets; /* backward; NULL: no constant of single tets is a parameter */
  double *by_tet;      /* [tets] */
} flesh_motion_pass;

/* A pass in `room` [FLESH_PASS_ARRAYS*n], which becomes 0. Cannot fail. */
flesh_motion_pass flesh_pass_of(flesh_trajectory *trajectory, double *room);
/* Takes the parameters, and finds what they leave as it is, into new pass->same. FLESH_ERR_MEMORY. */
int flesh_pass_take_parameters(flesh_motion_pass *pass, int count, const flesh_parameter *parameters);
/* Finds what parameter k changes where the tangent is linearised, into pass->force and pass->moves. What
 * flesh_stage_tangent_force returns. */
int flesh_pass_force(flesh_motion_pass *pass, int k);
/* Linearises a solve of a part, or the acceleration with which a method begins at the known state. What
 * flesh_stage_tangent_set returns. */
int flesh_pass_linearise(flesh_motion_pass *pass, const flesh_recorded_part *part, int solve);
int flesh_pass_linearise_start(flesh_motion_pass *pass, const flesh_recorded_part *part);
/* Whether the method begins there with the acceleration that balances the forces, which is no part of its own. */
int flesh_pass_begins_by_acceleration(const flesh_motion_pass *pass, const flesh_recorded_part *part);
/* Whether dofs that a method of order 2 constrains come to where their motion has them before the part, by a jump. */
int flesh_pass_jumps(const flesh_motion_pass *pass, const flesh_recorded_part *part);
/* Sets trajectory->prescribed over the part, or over the span by which the method begins. */
void flesh_pass_prescribe(flesh_motion_pass *pass, const flesh_recorded_part *part, int begins);
/* Finds what parameter k moves of the motion that is prescribed, at t, into pass->moves; *moved: whether there is anything.
 * What flesh_stage_tangent_moves returns. */
int flesh_pass_moves(flesh_motion_pass *pass, int k, double t, int *moved);
/* y [n] becomes 0 where trajectory->prescribed constrains it. */
void flesh_pass_forget_constrained(const flesh_motion_pass *pass, double *y);

static inline void flesh_add_scaled(int n, double scale, const double *x, double *y)
{
  for (int d = 0; d < n && scale != 0; d++) y[d] += scale * x[d];
}

#endif
