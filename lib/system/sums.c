/* sums.c: residual, Jacobian, potential and energies of a system as sums over its effects. */
#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "base/error.h"
#include "effect/effect.h"
#include "system/clearance.h"
#include "system/effect_view.h"
#include "system/one_effect.h"
#include "system/parts.h"
#include "system/position_potential.h"
#include "system/proximity.h"
#include "system/system.h"

static double cpu_time(const flesh_costs *costs)
{
  return costs && costs->timed ? flesh_cpu_seconds() : 0;
}

typedef enum call {
  CALL_RESIDUAL = 1,
  CALL_JACOBIAN = 2,
  CALL_POTENTIAL = 4,
  CALL_ENERGY = 8
} call; /* or'ed where one call gives several */

/* Counts a call of effect k that began at `start`. */
static void count(flesh_costs *costs, int k, int what, double start)
{
  if (!costs) return;
  flesh_effect_cost *cost = &costs->effects[k];
  cost->residuals += (what & CALL_RESIDUAL) != 0;
  cost->jacobians += (what & CALL_JACOBIAN) != 0;
  cost->potentials += (what & CALL_POTENTIAL) != 0;
  cost->energies += (what & CALL_ENERGY) != 0;
  if (costs->timed) cost->cpu_s += cpu_time(costs) - start;
}

/* Sums the residuals of the effects with indices from <= k < until that have one of the roles. */
static int sum_residuals(const flesh_system *system, int from, int until, const flesh_point *point, int external_only,
                         unsigned roles, double *r)
{
  double of_ranks[flesh_effect_sums_room(system)];
  flesh_effect_view view = flesh_effect_view_with(system, point, of_ranks);
  flesh_costs *costs = view.environment.costs;
  const flesh_clearance *clearance = view.environment.clearance;
  const unsigned long said = flesh_fail_count();
  int status = FLESH_OK;
  memset(r, 0, (size_t)system->nodes * 3 * sizeof *r);
  for (int k = from; k < until && !status; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    if (!effect->operations->residual || (external_only && effect->operations->role != FLESH_ROLE_LOAD)) continue;
    if (!(roles & FLESH_ROLE_BIT(effect->operations->role))) continue;
    const double start = cpu_time(costs);
    if (!flesh_clearance_holds(clearance, k))
      status = flesh_effect_returned(effect, said, effect->operations->residual(effect, flesh_effect_view_turn(&view, k), r));
    count(costs, k, CALL_RESIDUAL, start);
  }
  status = flesh_team_agree(system->team, status);
  if (!status) flesh_team_add_ghosts(system->team, r);
  return status;
}

int flesh_system_residual(const flesh_system *system, const flesh_point *point, double *r)
{
  FLESH_NEED({system, "system"}, {point, "point"}, {r, "r"});
  return sum_residuals(system, 0, system->entry_count, point, 0, FLESH_ROLES_ALL, r);
}

int flesh_system_load(const flesh_system *system, const flesh_point *point, double *r)
{
  FLESH_NEED({system, "system"}, {point, "point"}, {r, "r"});
  return sum_residuals(system, 0, system->entry_count, point, 1, FLESH_ROLES_ALL, r);
}

int flesh_system_effect_residual(const flesh_system *system, int index, const flesh_point *point, double *r)
{
  return sum_residuals(system, index, index + 1, point, 0, FLESH_ROLES_ALL, r);
}

int flesh_system_roles_residual(const flesh_system *system, unsigned roles, const flesh_point *point, double *r)
{
  return sum_residuals(system, 0, system->entry_count, point, 0, roles, r);
}

int flesh_system_forces(const flesh_system *system, unsigned roles, const flesh_point *point, double *r)
{
  const int status = flesh_system_roles_residual(system, roles, point, r);
  if (!status) flesh_team_update_ghosts(system->team, r);
  return status;
}

double flesh_system_product(const flesh_system *system, const double *u, const double *f)
{
  double sum = 0;
  for (int d = 0; d < 3 * system->nodes; d++) sum += u[d] * f[d];
  return flesh_team_total(system->team, sum);
}

/* Data of the threads that clear K, in parts: the blocks that no effect assigns, or all. */
typedef struct clearing {
  flesh_block_matrix *K;
  const int *left;
  int count; /* length of `left` */
} clearing;

enum { CLEARED_PARTS = 64 };

static void clear_part(void *data, int task)
{
  const clearing *c = data;
  const int *left = c->left;
  const size_t count = (size_t)(left ? c->count : c->K->row_start[c->K->rows]);
  const size_t from = count * (size_t)task / CLEARED_PARTS, until = count * (size_t)(task + 1) / CLEARED_PARTS;
  if (!left) memset(c->K->values + 9 * from, 0, 9 * (until - from) * sizeof *c->K->values);
  for (size_t k = from; left && k < until; k++)
    memset(c->K->values + 9 * (size_t)left[k], 0, 9 * sizeof *c->K->values);
}

static int add_jacobian(flesh_effect_view *view, int k, int anew, const flesh_shift *shift, flesh_block_matrix *K)
{
  const flesh_system_entry *e = &view->system->entries[k];
  const flesh_effect_operations *can = e->effect->operations;
  const int *slots = K->layout ? K->layout->slots[k] : e->slots;
  const double start = cpu_time(view->environment.costs);
  const flesh_point *point = flesh_effect_view_turn(view, k);
  const unsigned long said = flesh_fail_count();
  int status = FLESH_OK;
  if (anew) status = flesh_effect_private_of(e->effect)->jacobian_assign(e->effect, point, shift, K, slots);
  else if (!flesh_clearance_holds(view->environment.clearance, k)) status = can->jacobian(e->effect, point, shift, K, slots);
  count(view->environment.costs, k, CALL_JACOBIAN, start);
  return flesh_effect_returned(e->effect, said, status);
}

int flesh_system_jacobian(const flesh_system *system, const flesh_point *point,
                          const flesh_shift *shift, flesh_block_matrix *K)
{
  FLESH_NEED({system, "system"}, {point, "point"}, {shift, "shift"}, {K, "K"});
  const flesh_layout *layout = K->layout;
  if (!layout && K->row_start != system->pattern.row_start)
    return flesh_fail(FLESH_ERR_ARGUMENT, "K is a matrix of another system; flesh_system_matrix_create makes one of this");
  double of_ranks[flesh_effect_sums_room(system)];
  flesh_effect_view view = flesh_effect_view_with(system, point, of_ranks);
  int status = FLESH_OK;
  flesh_threads_run(point->threads, CLEARED_PARTS, clear_part,
                    &(clearing){K, layout ? layout->left : system->left,
                                layout ? layout->left_count : system->left_count});
  if (system->leader >= 0) status = add_jacobian(&view, system->leader, 1, shift, K);
  for (int k = 0; k < system->entry_count && !status; k++)
    if (k != system->leader && system->entries[k].effect->operations->jacobian)
      status = add_jacobian(&view, k, 0, shift, K);
  return flesh_team_agree(system->team, status);
}

/* Sums the two parts of the potential over all ranks, if no rank failed. */
static int add_up(const flesh_system *system, int status, flesh_position_potential sums[2])
{
  double numbers[4] = {sums[0].phi, sums[0].magnitude, sums[1].phi, sums[1].magnitude};
  status = flesh_team_sum_agreed(system->team, status, 4, numbers);
  for (int k = 0; k < 2; k++) sums[k].phi = numbers[2 * k], sums[k].magnitude = numbers[2 * k + 1];
  return status;
}

/* Adds the two parts of the potential: that of by_position, known from before or from now, and the rest. */
static int sum_up(const flesh_position_potential sums[2], flesh_position_potential *by_position, double *phi,
                  double *magnitude)
{
  if (!by_position->known)
    *by_position = (flesh_position_potential){.known = 1, .phi = sums[1].phi, .magnitude = sums[1].magnitude};
  *phi = sums[0].phi + by_position->phi;
  *magnitude = sums[0].magnitude + by_position->magnitude;
  return isfinite(*phi) ? FLESH_OK : FLESH_NONFINITE;
}

int flesh_system_potential_by_position(const flesh_system *system, const flesh_point *point, const flesh_shift *shift,
                                  flesh_position_potential *by_position, double *phi, double *magnitude)
{
  double of_ranks[flesh_effect_sums_room(system)];
  flesh_effect_view view = flesh_effect_view_with(system, point, of_ranks);
  flesh_costs *costs = view.environment.costs;
  const flesh_clearance *clearance = view.environment.clearance;
  flesh_position_potential sums[2] = {{0}}; /* sums of the rest, and of by_position */
  const unsigned long said = flesh_fail_count();
  int status = FLESH_OK;
  for (int k = 0; k < system->entry_count && !status; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    const int of_position = flesh_effect_has_trait(effect, FLESH_DEPENDS_ON_POSITION_ONLY);
    if (!effect->operations->potential || (of_position && by_position->known)) continue;
    flesh_position_potential *sum = &sums[of_position];
    const double start = cpu_time(costs);
    if (!flesh_clearance_holds(clearance, k))
      status = effect->operations->potential(effect, flesh_effect_view_turn(&view, k), shift, &sum->phi, &sum->magnitude);
    status = flesh_effect_returned(effect, said, status);
    count(costs, k, CALL_POTENTIAL, start);
  }
  status = add_up(system, status, sums);
  return status ? status : sum_up(sums, by_position, phi, magnitude);
}

int flesh_system_potential(const flesh_system *system, const flesh_point *point,
                           const flesh_shift *shift, double *phi, double *magnitude)
{
  FLESH_NEED({system, "system"}, {point, "point"}, {shift, "shift"}, {phi, "phi"}, {magnitude, "magnitude"});
  return flesh_system_potential_by_position(system, point, shift, &(flesh_position_potential){0}, phi, magnitude);
}

/* Adds the effect's residual and potential, by `evaluate` or by the two operations that it stands for. */
static int evaluate_effect(const flesh_effect *effect, const flesh_point *point,
                           const flesh_shift *shift, double *r, double *phi, double *magnitude)
{
  const flesh_effect_operations *can = effect->operations;
  const flesh_effect_private *library = flesh_effect_private_of(effect);
  const unsigned long said = flesh_fail_count();
  if (library->evaluate) return library->evaluate(effect, point, shift, r, phi, magnitude);
  int status = can->residual ? can->residual(effect, point, r) : FLESH_OK;
  if (!status && can->potential) status = can->potential(effect, point, shift, phi, magnitude);
  return flesh_effect_returned(effect, said, status);
}

int flesh_system_evaluate_by_position(const flesh_system *system, const flesh_point *point, const flesh_shift *shift,
                                 flesh_position_potential *by_position, double *r, double *phi, double *magnitude)
{
  double of_ranks[flesh_effect_sums_room(system)];
  flesh_effect_view view = flesh_effect_view_with(system, point, of_ranks);
  flesh_costs *costs = view.environment.costs;
  const flesh_clearance *clearance = view.environment.clearance;
  flesh_position_potential sums[2] = {{0}};
  memset(r, 0, (size_t)system->nodes * 3 * sizeof *r);
  by_position->known = 0;
  int status = FLESH_OK;
  for (int k = 0; k < system->entry_count && !status; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    const int calls = (effect->operations->residual ? CALL_RESIDUAL : 0) |
                      (effect->operations->potential ? CALL_POTENTIAL : 0);
    if (!calls) continue;
    flesh_position_potential *sum = &sums[flesh_effect_has_trait(effect, FLESH_DEPENDS_ON_POSITION_ONLY)];
    const double start = cpu_time(costs);
    if (!flesh_clearance_holds(clearance, k))
      status = evaluate_effect(effect, flesh_effect_view_turn(&view, k), shift, r, &sum->phi, &sum->magnitude);
    count(costs, k, calls, start);
  }
  status = add_up(system, status, sums);
  if (status) return status;
  flesh_team_add_ghosts(system->team, r);
  return sum_up(sums, by_position, phi, magnitude);
}

/* Computes the energies, J, of the effects for which is_one(effect, of) is 1 (NULL: of all), in energies [effects]; 0 for
 * the others. */
static int find_energies(const flesh_system *system, int (*is_one)(const flesh_effect *effect, int of), int of,
                         const flesh_point *point, const flesh_position_potential *by_position, double *energies)
{
  double of_ranks[flesh_effect_sums_room(system)];
  flesh_effect_view view = flesh_effect_view_with(system, point, of_ranks);
  flesh_costs *costs = is_one ? NULL : view.environment.costs;
  const unsigned long said = flesh_fail_count();
  const int counts = !system->team || system->team->rank == 0; /* a known value is already that of all ranks */
  int of_position = 0;
  for (int k = 0; by_position->known && k < system->entry_count; k++)
    of_position += flesh_effect_has_trait(system->entries[k].effect, FLESH_DEPENDS_ON_POSITION_ONLY);
  int status = FLESH_OK;
  for (int k = 0; k < system->entry_count; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    energies[k] = 0;
    if (!effect->operations->energy || status || (is_one && !is_one(effect, of))) continue;
    if (by_position->known && by_position->far && flesh_proximity_of(view.environment.proximity, k)) continue;
    if (of_position == 1 && flesh_effect_has_trait(effect, FLESH_DEPENDS_ON_POSITION_ONLY)) {
      energies[k] = counts ? by_position->phi : 0;
      continue;
    }
    const double start = cpu_time(costs);
    status = flesh_effect_returned(effect, said,
                                   effect->operations->energy(effect, flesh_effect_view_turn(&view, k), &energies[k]));
    count(costs, k, CALL_ENERGY, start);
  }
  return flesh_team_sum_agreed(system->team, status, system->entry_count, energies);
}

int flesh_system_energies_by_position(const flesh_system *system, const flesh_point *point,
                                 const flesh_position_potential *by_position, double *energies)
{
  return find_energies(system, NULL, 0, point, by_position, energies);
}

int flesh_system_some_energies(const flesh_system *system, int (*is_one)(const flesh_effect *effect, int of), int of,
                               const flesh_point *point, double *energies, double *sum)
{
  double found[system->entry_count + 1];
  const int status = find_energies(system, is_one, of, point, &(flesh_position_potential){0}, found);
  *sum = 0;
  for (int k = 0; k < system->entry_count; k++) {
    if (!is_one(system->entries[k].effect, of)) continue;
    if (energies) energies[k] = found[k];
    *sum += found[k];
  }
  return status;
}

static int has_role(const flesh_effect *effect, int role) { return (int)effect->operations->role == role; }

int flesh_system_kinetic_energies(const flesh_system *system, const flesh_point *point, double *energies, double *sum)
{
  return flesh_system_some_energies(system, has_role, FLESH_ROLE_INERTIA, point, energies, sum);
}

double flesh_system_role_energy(const flesh_system *system, flesh_role role, const double *energies)
{
  double sum = 0;
  for (int k = 0; k < system->entry_count; k++)
    if (system->entries[k].effect->operations->role == role) sum += energies[k];
  return sum;
}
