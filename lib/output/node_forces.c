/* node_forces.c: forces of constraints and of contact on every node.
 *
 * The sum of all effects, r(t, x, v, a), is 0 on free dofs; on constrained dofs it is the force of the constraint. With
 * a lumped mass this force does not depend on the accelerations of free dofs. With a consistent mass they are found
 * from M a = -r, by conjugate gradients preconditioned with M's diagonal, whose condition number Wathen (1987)
 * bounds. */
#include "output/node_forces.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "element/element.h"
#include "mesh/mesh.h"
#include "system/one_effect.h"
#include "system/parts.h"
#include "system/ranks.h"

/* Computes the diagonal of the consistent mass; on a part of a body it includes the tets of other ranks. */
static void find_diagonal(const flesh_body *body, const flesh_team *team, double *diagonal)
{
  const flesh_mesh *mesh = body->mesh;
  for (int e = 0; e < flesh_mesh_tet_count(mesh); e++) {
    int nodes[10];
    double masses[55];
    if (!flesh_mesh_is_quadratic(mesh, e)) {
      const int *corners = flesh_mesh_tets(mesh) + 4 * (size_t)e;
      for (int a = 0; a < 4; a++) diagonal[corners[a]] += body->density[e] * flesh_mesh_tet_volumes(mesh)[e] / 10;
      continue;
    }
    flesh_tet10_nodes(mesh, e, nodes);
    flesh_tet10_masses(mesh, e, body->density[e], masses);
    for (int a = 0, k = 0; a < 10; k += 10 - a++) diagonal[nodes[a]] += masses[k];
  }
  flesh_team_sum_nodes(team, 1, diagonal);
}

int flesh_node_forces_open(int status, const flesh_body *body, const flesh_system *system, int is_static,
                           int wants_reaction, int wants_contact, flesh_node_forces *forces)
{
  const size_t n = (size_t)flesh_system_unknowns(system);
  const int solves = wants_reaction && !is_static && body->mass == FLESH_MASS_CONSISTENT;
  const int wants = wants_reaction || wants_contact;
  *forces = (flesh_node_forces){.body = body, .system = wants ? system : NULL, .team = flesh_system_team(system),
                                .is_static = is_static};
  double *room = wants ? forces->v = calloc(9 * n + n / 3, sizeof(double)) : NULL; /* pages that stay untouched cost nothing */
  if (wants && (!room || !(forces->constrained = calloc(n, 1)) || !(forces->holder = calloc(n, sizeof(int)))))
    status = flesh_fail(FLESH_ERR_MEMORY, "no memory for the forces on %zu nodes", n / 3);
  else if (wants) forces->a = room + n, forces->zeros = room + 2 * n;
  if (room && wants_reaction) forces->reaction = room + 3 * n;
  if (room && wants_contact) forces->contact = room + 4 * n, forces->one_contact = room + 5 * n;
  if (room && solves)
    forces->direction = room + 6 * n, forces->product = room + 7 * n, forces->residual = room + 8 * n,
    forces->diagonal = room + 9 * n;
  status = flesh_team_agree(forces->team, status);
  if (status) flesh_node_forces_clear(forces);
  else if (solves) find_diagonal(body, forces->team, forces->diagonal);
  return status;
}

void flesh_node_forces_clear(flesh_node_forces *forces)
{
  free(forces->v); /* one block with all other doubles */
  free(forces->constrained);
  free(forces->holder);
  *forces = (flesh_node_forces){0};
}

static flesh_point point_of(flesh_node_forces *f, const flesh_step_record *record, const flesh_state *at,
                            const double *a)
{
  const double *v = f->is_static ? f->zeros : at->v;
  flesh_point point = flesh_point_at(at->t, at->x, v, a);
  point.multipliers = record->state->multipliers;
  point.internal = record->state->internal;
  f->environment.proximity = record->proximity;
  point.environment = &f->environment;
  return point;
}

/* Replaces f->product by z, f->residual divided by the diagonal. Returns their dot product. */
static double precondition(flesh_node_forces *f, int n)
{
  for (int d = 0; d < n; d++) f->product[d] = f->constrained[d] ? 0 : f->residual[d] / f->diagonal[d / 3];
  return flesh_system_product(f->system, f->product, f->residual);
}

/* Computes the next direction, z + keep * f->direction. */
static void turn(flesh_node_forces *f, int n, double keep)
{
  for (int d = 0; d < n; d++) f->direction[d] = f->product[d] + keep * f->direction[d];
  flesh_team_update_ghosts(f->team, f->direction);
}

/* Solves r = 0 for the free components of f->a. */
static int balance(flesh_node_forces *f, const flesh_step_record *record, int n)
{
  flesh_point point = point_of(f, record, record->state, f->a);
  int status = flesh_system_residual(f->system, &point, f->residual);
  if (status) return status;
  for (int d = 0; d < n; d++) f->residual[d] = f->constrained[d] ? 0 : -f->residual[d];
  memset(f->direction, 0, (size_t)n * sizeof *f->direction);
  double square = precondition(f, n);
  turn(f, n, 0);
  const double enough = 1e-28 * square;
  point.a = f->direction;
  for (int k = 0; k < 500 && square > enough; k++) {
    status = flesh_system_roles_residual(f->system, FLESH_ROLE_BIT(FLESH_ROLE_INERTIA), &point, f->product);
    if (status) return status;
    for (int d = 0; d < n; d++)
      if (f->constrained[d]) f->product[d] = 0;
    const double step = square / flesh_system_product(f->system, f->direction, f->product), before = square;
    for (int d = 0; d < n; d++) f->a[d] += step * f->direction[d], f->residual[d] -= step * f->product[d];
    square = precondition(f, n);
    turn(f, n, square / before);
  }
  return square > enough || isnan(square) ? FLESH_NONFINITE : FLESH_OK;
}

static int find_reaction(flesh_node_forces *f, const flesh_step_record *record, int n)
{
  const double t = record->state->t;
  memset(f->a, 0, (size_t)n * sizeof *f->a);
  flesh_system_fixed(f->system, t, f->constrained);
  flesh_system_holders(f->system, t, f->holder);
  if (!f->is_static) flesh_system_prescribe_velocity(f->system, t, f->v, f->a);
  int status = f->diagonal ? balance(f, record, n) : FLESH_OK;
  const flesh_point point = point_of(f, record, record->state, f->a);
  if (!status) status = flesh_system_forces(f->system, FLESH_ROLES_ALL, &point, f->reaction);
  for (int d = 0; d < n; d++)
    if (!f->constrained[d]) f->reaction[d] = 0;
  return status;
}

void flesh_node_forces_find(flesh_node_forces *f, const flesh_step_record *record)
{
  const int n = flesh_system_unknowns(f->system);
  if (f->reaction && find_reaction(f, record, n))
    for (int d = 0; d < n; d++) f->reaction[d] = NAN;
  if (!f->contact) return;
  const flesh_point point = point_of(f, record, record->stage, f->zeros);
  const int status = flesh_system_forces(f->system, FLESH_ROLE_BIT(FLESH_ROLE_CONTACT), &point, f->contact);
  for (int d = 0; d < n; d++) f->contact[d] = status ? NAN : 0 - f->contact[d];
}

const double *flesh_node_forces_of_contact(flesh_node_forces *f, const flesh_step_record *record, int effect)
{
  const int n = flesh_system_unknowns(f->system);
  const flesh_point point = point_of(f, record, record->stage, f->zeros);
  const int status = flesh_system_effect_residual(f->system, effect, &point, f->one_contact);
  for (int d = 0; d < n; d++) f->one_contact[d] = status ? NAN : 0 - f->one_contact[d];
  return f->one_contact;
}
