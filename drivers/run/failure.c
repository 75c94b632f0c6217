/* failure.c: what is reported of a failed run: where it failed, and advice. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "material/form.h"
#include "system/ranks.h"
#include "run/result.h"

/* Returns whether some material of the scene has no value at J <= 0. */
static int needs_positive_J(const flesh_scene *scene)
{
  const flesh_material *materials = flesh_scene_body(scene)->materials;
  for (int m = 0; materials && m < flesh_scene_material_count(scene); m++)
    if (flesh_psi_needs_volume(materials[m].energy)) return 1;
  return 0;
}

/* Returns whether some body has no constrained node; 0 on several ranks, where it is not known. */
static int holds_nothing_of_a_body(const flesh_scene *scene)
{
  const flesh_body *body = flesh_scene_body(scene);
  const int *tets = flesh_mesh_tets(body->mesh), parts = body->part_count > 1 ? body->part_count : 1;
  const int known = !flesh_system_team(flesh_scene_system(scene));
  uint8_t *fixed = known ? calloc((size_t)flesh_system_unknowns(flesh_scene_system(scene)) + 1, 1) : NULL;
  int free_bodies = 0;
  if (fixed) flesh_system_fixed(flesh_scene_system(scene), flesh_scene_times(scene)->end, fixed);
  for (int k = 0; fixed && k < parts; k++) {
    const int first = parts > 1 ? body->parts[k].first_tet : 0;
    const int end = parts > 1 ? first + body->parts[k].tets : flesh_mesh_tet_count(body->mesh);
    int held = 0;
    for (int i = 4 * first; i < 4 * end; i++)
      held |= fixed[3 * tets[i]] | fixed[3 * tets[i] + 1] | fixed[3 * tets[i] + 2];
    free_bodies |= !held;
  }
  free(fixed);
  return free_bodies;
}

/* Says how the method treats energy, and how to avoid spurious energy. */
static const char *energy_advice(const flesh_scene *scene, const flesh_figures *figures)
{
  if (figures->start_contact > 0.5 * figures->balance.scale)
    return "the body starts so near an obstacle that the contact's barrier throws it off: start it farther away than "
           "the contact's thickness, or take a smaller thickness; or a much shorter time.step";
  switch (flesh_scene_times(scene)->method) {
  case FLESH_METHOD_MIDPOINT:
  case FLESH_METHOD_NEWMARK:
    return "this method damps nothing and feeds motion that its steps do not resolve (contact, stiff parts): try a shorter "
           "time.step, or time.method=hht, bdf2 or backward-euler, each of which damps more than the one before";
  case FLESH_METHOD_HHT:
    return "the steps do not resolve the motion (contact, stiff parts): try a shorter time.step, time.alpha=-0.3, or "
           "time.method=bdf2 or backward-euler, which damp more";
  case FLESH_METHOD_GENERALIZED_ALPHA:
    return "the steps do not resolve the motion (contact, stiff parts): try a shorter time.step, a smaller "
           "time.spectral_radius, or time.method=bdf2 or backward-euler, which damp more";
  case FLESH_METHOD_RUNGE_KUTTA:
    return "the steps do not resolve the motion: let its error choose them by time.tolerance, or try a smaller one, or "
           "time.table=esdirk324, which damps more";
  case FLESH_METHOD_IDA:
    return "try a smaller time.tolerance or time.max_order=2, or time.method=adaptive, which damps";
  default:
    return "the steps do not resolve the motion: try a shorter time.step";
  }
}

const char *flesh_failure_advice(const flesh_failure *failure, const flesh_scene *scene, const flesh_figures *figures)
{
  const flesh_solver_options *solver = flesh_scene_solver(scene);
  /* The solve failed because the motion has blown up; the advice is about that cause. */
  if (failure->status == FLESH_ERR_ENERGY || figures->balance.gain > 0.1) return energy_advice(scene, figures);
  if (failure->volume_gap > 0)
    return "pins and prescribed motions may leave incompressible tets no room to keep their volumes: hold fewer nodes "
           "or axes, or set poisson below 0.5";
  if (failure->status == FLESH_UNDEFINED && failure->worst_node < 0 && failure->worst_J > 0.05)
    return "nodes start or are held in an obstacle or another body, or are led there also in the shortest step tried: start "
           "them elsewhere, end the motion before they meet, or hold fewer nodes";
  int is_static = flesh_scene_times(scene)->method == FLESH_METHOD_STATIC;
  if (needs_positive_J(scene) && (failure->status == FLESH_UNDEFINED || !(failure->worst_J > 0.05)))
    return "this energy has no value where a tet is inverted (J <= 0) and stiffens without bound near it: try a shorter "
           "time.step, a gentler motion or load, a finer mesh at the worst tet, or an energy that is defined there (S or E)";
  if (failure->order > 0 || flesh_scene_times(scene)->method == FLESH_METHOD_IDA)
    return "IDA's steps follow every fast oscillation: for a violent start or load try time.method=adaptive or "
           "backward-euler; else a larger time.tolerance or time.max_steps";
  if (failure->status == FLESH_ERR_INTEGRATOR)
    return "this tolerance takes very short steps with this method: try a larger time.tolerance or time.max_steps, or "
           "time.method=adaptive, which is of order 3";
  if (solver->line_search != FLESH_LINE_SEARCH_POTENTIAL)
    return "plain Newton steps are not guarded: try solver.line_search=potential, or a shorter time.step";
  if (failure->status == FLESH_NONFINITE)
    return "numbers overflowed: check the scene's units, loads and start state with `flesh check`, and try a shorter time.step";
  if (failure->status == FLESH_UNDEFINED && failure->worst_node >= 0 &&
      flesh_method_order(flesh_scene_times(scene)->method) == 2)
    return "the step passes an obstacle, or ends where an energy has no value, although it balances before: try a shorter "
           "time.step, a larger solver.max_cutbacks, or time.method=bdf2 or backward-euler, which balance where the step ends";
  if (failure->status == FLESH_NOT_CONVERGED && failure->worst_node >= 0 && failure->residual <= 100 * failure->target)
    return "the residual came close to its target: try a larger solver.newton_tolerance, a smaller "
           "solver.linear_tolerance or linear_solver=klu";
  if (is_static && holds_nothing_of_a_body(scene))
    return figures->separation.ignored
               ? "bodies that intersect at the start do not touch, and nothing else holds one of them: start them apart, pin "
                 "each, or let them come apart by inertia and time.method=backward-euler"
               : "a body that no pin holds slides or falls where nothing stops it, and statics does not find where to: pin it, or "
                 "let it come to rest by inertia and time.method=backward-euler";
  if (is_static)
    return "the body may have no equilibrium nearby (not pinned enough, or it buckles): try more pins, a larger "
           "solver.max_cutbacks or max_newton, linear_solver=klu, or let it move there by adding inertia";
  return "try a shorter time.step, a larger solver.max_newton or max_cutbacks, or linear_solver=klu";
}

/* Returns the name of the body to which a tet belongs; NULL if there is only one body. */
static const char *body_of(const flesh_scene *scene, int tet)
{
  const flesh_body *body = flesh_scene_body(scene);
  for (int k = 0; body->part_count > 1 && k < body->part_count; k++)
    if (tet >= body->parts[k].first_tet && tet < body->parts[k].first_tet + body->parts[k].tets)
      return body->parts[k].name;
  return NULL;
}

void flesh_failure_print(FILE *stream, const flesh_outcome *outcome, const flesh_scene *scene)
{
  const flesh_failure *f = &outcome->failure;
  fprintf(stream, f->load > 0 ? "  last try: t = %g s, load factor %g" : "  last try: t = %g s, h = %g s", f->t,
          f->load > 0 ? f->load : f->h);
  if (!f->order) fprintf(stream, " after %d halvings", f->halvings);
  fprintf(stream, " (%s)\n", flesh_status_text(f->status));
  if (f->order > 0)
    fprintf(stream, "  order %d; largest local error at node %d", f->order, f->worst_node);
  else if (f->worst_node >= 0)
    fprintf(stream, "  residual: %.3g N; target %.3g N; largest at node %d", f->residual, f->target,
            f->worst_node);
  else fputs("  residual: none; it has no value at the first iterate", stream);
  if (f->worst_tet >= 0)
    fprintf(stream, "\n  worst tet: %d with J = %.4g at (%.4g, %.4g, %.4g) m", f->worst_tet,
            f->worst_J, f->worst_position[0], f->worst_position[1], f->worst_position[2]);
  const char *body = f->worst_tet >= 0 ? body_of(scene, f->worst_tet) : NULL;
  if (body) fprintf(stream, ", of body %s", body);
  fprintf(stream, "\n  advice: %s\n", outcome->advice);
}
