/* system.c: the sum of the effects and the constraints. */
#include "flesh/system.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "effect/effect.h"
#include "system/one_effect.h"
#include "system/parts.h"
#include "system/position_potential.h"

int flesh_system_create(const flesh_mesh *mesh, flesh_system **system)
{
  FLESH_NEED({system, "system"});
  *system = NULL;
  FLESH_NEED({mesh, "mesh"});
  *system = calloc(1, sizeof **system);
  if (!*system) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a system");
  (*system)->mesh = mesh;
  (*system)->nodes = flesh_mesh_node_count(mesh);
  return FLESH_OK;
}

void flesh_system_destroy(flesh_system **system)
{
  if (!system || !*system) return;
  flesh_system *self = *system;
  for (int k = 0; k < self->entry_count; k++) {
    flesh_effect_destroy(&self->entries[k].effect);
    if (self->entries[k].owns_slots) free(self->entries[k].slots);
  }
  for (int k = 0; k < self->constraint_count; k++) {
    free(self->constraints[k].nodes);
    flesh_motion_clear(&self->constraints[k].motion);
  }
  free(self->entries);
  free(self->constraints);
  flesh_pattern_clear(&self->pattern);
  free(self->left);
  free(self);
  *system = NULL;
}

static int still_open(const flesh_system *system)
{
  return system->finished
             ? flesh_fail(FLESH_ERR_ARGUMENT, "the system is finished; nothing can be added to it")
             : FLESH_OK;
}

int flesh_system_add_effect(flesh_system *system, flesh_effect **effect)
{
  FLESH_NEED({effect, "effect"});
  FLESH_NEED({*effect, "*effect"});
  if (!system) flesh_effect_destroy(effect);
  FLESH_NEED({system, "system"});
  int status = still_open(system);
  flesh_system_entry *grown = status ? NULL
                        : realloc(system->entries,
                                  ((size_t)system->entry_count + 1) * sizeof *system->entries);
  if (!grown) {
    flesh_effect_destroy(effect);
    return status ? status : flesh_fail(FLESH_ERR_MEMORY, "no memory for one more effect");
  }
  system->entries = grown;
  system->entries[system->entry_count++] = (flesh_system_entry){.effect = *effect};
  system->limits_step |= (*effect)->operations->max_feasible_step != NULL;
  *effect = NULL;
  return FLESH_OK;
}

static int add_constraint(flesh_system *system, int count, const int *nodes, unsigned axes,
                          const flesh_motion *motion, double from, double until)
{
  int status = still_open(system);
  if (status) return status;
  if (count < 1 || axes == 0 || axes > FLESH_AXES_ALL)
    return flesh_fail(FLESH_ERR_ARGUMENT, "a constraint needs at least one node and one axis");
  if (!(until > from))
    return flesh_fail(FLESH_ERR_ARGUMENT, "until is %g s; it must be after from, %g s", until, from);
  for (int k = 0; k < count; k++)
    if (nodes[k] < 0 || nodes[k] >= system->nodes)
      return flesh_fail(FLESH_ERR_ARGUMENT, "node %d is constrained; the mesh has the nodes 0 to %d",
                        nodes[k], system->nodes - 1);
  flesh_constraint *grown = realloc(system->constraints,
                              ((size_t)system->constraint_count + 1) * sizeof *grown);
  if (!grown) return flesh_fail(FLESH_ERR_MEMORY, "no memory for one more constraint");
  system->constraints = grown;
  flesh_constraint *c = &grown[system->constraint_count];
  *c = (flesh_constraint){.count = count, .axes = axes, .from = from, .until = until};
  if (motion && (status = flesh_motion_copy(motion, &c->motion))) return status;
  c->nodes = malloc((size_t)count * sizeof *c->nodes);
  if (!c->nodes) {
    flesh_motion_clear(&c->motion);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d constrained nodes", count);
  }
  memcpy(c->nodes, nodes, (size_t)count * sizeof *c->nodes);
  system->constraint_count++;
  return FLESH_OK;
}

int flesh_system_add_pin(flesh_system *system, int count, const int *nodes, unsigned axes,
                         double from, double until)
{
  FLESH_NEED({system, "system"}, {count ? nodes : (const void *)system, "nodes"});
  return add_constraint(system, count, nodes, axes, NULL, from, until);
}

int flesh_system_add_prescribed_motion(flesh_system *system, int count, const int *nodes, unsigned axes,
                            const flesh_motion *motion, double from, double until)
{
  FLESH_NEED({system, "system"}, {count ? nodes : (const void *)system, "nodes"}, {motion, "motion"});
  return add_constraint(system, count, nodes, axes, motion, from, until);
}

static int same_cells(const flesh_cells *a, const flesh_cells *b)
{
  return a == b ||
         (a->count == b->count && a->nodes_per_cell == b->nodes_per_cell &&
          !memcmp(a->nodes, b->nodes, (size_t)a->count * a->nodes_per_cell * sizeof *a->nodes));
}

/* And whether they ask for the same pairs. */
static int same_pairs(const flesh_cells *a, const flesh_cells *b)
{
  return !a->pairs == !b->pairs &&
         (!a->pairs || (a->pair_count == b->pair_count &&
                        !memcmp(a->pairs, b->pairs, (size_t)a->pair_count * sizeof *a->pairs)));
}

static const flesh_cells *cells_of(const flesh_effect *effect)
{
  return effect->operations->cells ? effect->operations->cells(effect) : NULL;
}

/* The effect that sets the most blocks, and the blocks that it leaves. */
static int find_leader(flesh_system *system)
{
  size_t most = 0;
  system->leader = -1;
  for (int k = 0; k < system->entry_count; k++) {
    const flesh_system_entry *e = &system->entries[k];
    if (!e->effect->operations->jacobian_assign || !e->slots) continue;
    const size_t pairs = flesh_pattern_pairs(cells_of(e->effect));
    if (pairs > most) most = pairs, system->leader = k;
  }
  if (system->leader < 0) return FLESH_OK;
  return flesh_pattern_rest(&system->pattern, most, system->entries[system->leader].slots, &system->left_count,
                            &system->left);
}

int flesh_system_finalize(flesh_system *system)
{
  FLESH_NEED({system, "system"});
  int status = still_open(system);
  if (status) return status;
  const flesh_cells **cells = malloc(((size_t)system->entry_count + 1) * sizeof *cells);
  if (!cells) return flesh_fail(FLESH_ERR_MEMORY, "no memory to finish a system");
  int count = 0;
  for (int k = 0; k < system->entry_count && !status; k++) {
    const flesh_cells *own = cells_of(system->entries[k].effect);
    if (own) status = flesh_pattern_check(system->entries[k].effect->operations->name, system->nodes, own);
    int known = !own;
    for (int j = 0; j < count && !known; j++) known = same_cells(cells[j], own);
    if (!known) cells[count++] = own;
  }
  if (!status) status = flesh_pattern_create(system->nodes, count, cells, &system->pattern);
  free(cells);
  for (int k = 0; k < system->entry_count && !status; k++) {
    flesh_system_entry *e = &system->entries[k];
    const flesh_cells *own = cells_of(e->effect);
    if (!own) continue;
    for (int j = 0; j < k && !e->slots; j++) {
      const flesh_cells *other = cells_of(system->entries[j].effect);
      if (other && same_cells(other, own) && same_pairs(other, own)) e->slots = system->entries[j].slots;
    }
    if (e->slots) continue;
    status = flesh_pattern_slots(&system->pattern, own, &e->slots);
    e->owns_slots = !status;
  }
  if (!status) status = find_leader(system);
  system->finished = !status;
  return status;
}

const flesh_mesh *flesh_system_mesh(const flesh_system *system) { return system->mesh; }

int flesh_system_unknowns(const flesh_system *system) { return 3 * system->nodes; }

int flesh_system_effect_count(const flesh_system *system) { return system->entry_count; }

const flesh_effect *flesh_system_effect(const flesh_system *system, int index)
{
  return system->entries[index].effect;
}

flesh_instructions flesh_system_instructions(const flesh_system *system)
{
  flesh_instructions least;
  flesh_instructions_find(FLESH_INSTRUCTIONS_AUTO, &least);
  for (int k = 0; k < system->entry_count; k++) {
    const flesh_instructions used = flesh_effect_instructions(system->entries[k].effect);
    if (used != FLESH_INSTRUCTIONS_AUTO && used < least) least = used;
  }
  return least;
}

int flesh_system_has_role(const flesh_system *system, flesh_role role)
{
  for (int k = 0; k < system->entry_count; k++)
    if (system->entries[k].effect->operations->role == role) return 1;
  return 0;
}

size_t flesh_system_effect_memory(const flesh_system *system, int index)
{
  const flesh_system_entry *e = &system->entries[index];
  const flesh_cells *cells = cells_of(e->effect);
  if (!e->effect->operations->memory) return 0;
  size_t bytes = e->effect->operations->memory(e->effect);
  if (e->owns_slots) bytes += flesh_pattern_pairs(cells) * sizeof *e->slots;
  return bytes + sizeof *e + sizeof *e->effect;
}

int flesh_system_has_follower_loads(const flesh_system *system)
{
  for (int k = 0; k < system->entry_count; k++)
    if (system->entries[k].effect->operations->is_follower_load) return 1;
  return 0;
}

int flesh_system_freezes(const flesh_system *system)
{
  for (int k = 0; k < system->entry_count; k++)
    if (system->entries[k].effect->operations->freezes) return 1;
  return 0;
}

double flesh_system_next_event(const flesh_system *system, double t)
{
  double next = INFINITY;
  for (int k = 0; k < system->entry_count; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    if (effect->operations->next_event)
      next = fmin(next, effect->operations->next_event(effect, t));
  }
  for (int k = 0; k < system->constraint_count; k++) {
    const flesh_constraint *c = &system->constraints[k];
    next = fmin(next, flesh_interval_next_event(c->from, c->until, t));
    next = fmin(next, flesh_motion_next_event(&c->motion, t));
  }
  return next;
}

int flesh_system_moves(const flesh_system *system)
{
  return flesh_system_next_event(system, -INFINITY) < INFINITY;
}

/* The point as effects see it. */
static flesh_point with_lag(const flesh_point *point)
{
  flesh_point full = *point;
  if (!full.x_lag) full.x_lag = full.x, full.t_lag = full.t;
  if (!full.v_lag) full.v_lag = full.v;
  if (!full.x_frozen) full.x_frozen = full.x, full.v_frozen = full.v;
  return full;
}

static double processor_time(const flesh_costs *costs)
{
  struct timespec now;
  if (!costs || !costs->timed) return 0;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

typedef enum call {
  CALL_RESIDUAL = 1,
  CALL_JACOBIAN = 2,
  CALL_POTENTIAL = 4,
  CALL_ENERGY = 8
} call; /* or'ed where one gives several */

/* A call of effect k that began at `start`. */
static void count(flesh_costs *costs, int k, int what, double start)
{
  if (!costs) return;
  flesh_effect_cost *cost = &costs->effects[k];
  cost->residuals += (what & CALL_RESIDUAL) != 0;
  cost->jacobians += (what & CALL_JACOBIAN) != 0;
  cost->potentials += (what & CALL_POTENTIAL) != 0;
  cost->energies += (what & CALL_ENERGY) != 0;
  if (costs->timed) cost->cpu_s += processor_time(costs) - start;
}

/* Of the effects from one index to before another, of those roles. */
static int sum_residuals(const flesh_system *system, int from, int until, const flesh_point *point, int external_only,
                         unsigned roles, double *r)
{
  const flesh_point full = with_lag(point);
  memset(r, 0, (size_t)system->nodes * 3 * sizeof *r);
  for (int k = from; k < until; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    if (!effect->operations->residual || (external_only && !effect->operations->external)) continue;
    if (!(roles & FLESH_ROLE_BIT(effect->operations->role))) continue;
    const double start = processor_time(full.costs);
    int status = effect->operations->residual(effect, &full, r);
    count(full.costs, k, CALL_RESIDUAL, start);
    if (status) return status;
  }
  return FLESH_OK;
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

/* What threads clear, in parts: the blocks that the leader leaves, or all. */
typedef struct clearing {
  const flesh_system *system;
  flesh_block_matrix *K;
} clearing;

enum { CLEARED_PARTS = 64 };

static void clear_part(void *data, int task)
{
  const clearing *c = data;
  const int *left = c->system->left;
  const size_t count = (size_t)(left ? c->system->left_count : c->K->row_start[c->K->rows]);
  const size_t from = count * (size_t)task / CLEARED_PARTS, until = count * (size_t)(task + 1) / CLEARED_PARTS;
  if (!left) memset(c->K->values + 9 * from, 0, 9 * (until - from) * sizeof *c->K->values);
  for (size_t k = from; left && k < until; k++)
    memset(c->K->values + 9 * (size_t)left[k], 0, 9 * sizeof *c->K->values);
}

static int add_jacobian(const flesh_system *system, int k, int anew, const flesh_point *full, const flesh_shift *shift,
                        flesh_block_matrix *K)
{
  const flesh_system_entry *e = &system->entries[k];
  const flesh_effect_operations *can = e->effect->operations;
  const double start = processor_time(full->costs);
  int status = (anew ? can->jacobian_assign : can->jacobian)(e->effect, full, shift, K, e->slots);
  count(full->costs, k, CALL_JACOBIAN, start);
  return status;
}

int flesh_system_jacobian(const flesh_system *system, const flesh_point *point,
                          const flesh_shift *shift, flesh_block_matrix *K)
{
  FLESH_NEED({system, "system"}, {point, "point"}, {shift, "shift"}, {K, "K"});
  const flesh_point full = with_lag(point);
  int status = FLESH_OK;
  flesh_threads_run(point->threads, CLEARED_PARTS, clear_part, &(clearing){system, K});
  if (system->leader >= 0) status = add_jacobian(system, system->leader, 1, &full, shift, K);
  for (int k = 0; k < system->entry_count && !status; k++)
    if (k != system->leader && system->entries[k].effect->operations->jacobian)
      status = add_jacobian(system, k, 0, &full, shift, K);
  return status;
}

/* The potential from its two parts, the others and that of positions alone, which is known from before or now. */
static int add_by_position(const flesh_position_potential sums[2], flesh_position_potential *by_position, double *phi,
                      double *magnitude)
{
  if (!by_position->known) *by_position = (flesh_position_potential){1, sums[1].phi, sums[1].magnitude};
  *phi = sums[0].phi + by_position->phi;
  *magnitude = sums[0].magnitude + by_position->magnitude;
  return isfinite(*phi) ? FLESH_OK : FLESH_NONFINITE;
}

int flesh_system_potential_by_position(const flesh_system *system, const flesh_point *point, const flesh_shift *shift,
                                  flesh_position_potential *by_position, double *phi, double *magnitude)
{
  const flesh_point full = with_lag(point);
  flesh_position_potential sums[2] = {{0}}; /* of the others, of positions alone */
  for (int k = 0; k < system->entry_count; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    if (!effect->operations->potential || (effect->operations->depends_on_position_only && by_position->known)) continue;
    flesh_position_potential *sum = &sums[effect->operations->depends_on_position_only != 0];
    const double start = processor_time(full.costs);
    int status = effect->operations->potential(effect, &full, shift, &sum->phi, &sum->magnitude);
    count(full.costs, k, CALL_POTENTIAL, start);
    if (status) return status;
  }
  return add_by_position(sums, by_position, phi, magnitude);
}

int flesh_system_potential(const flesh_system *system, const flesh_point *point,
                           const flesh_shift *shift, double *phi, double *magnitude)
{
  FLESH_NEED({system, "system"}, {point, "point"}, {shift, "shift"}, {phi, "phi"}, {magnitude, "magnitude"});
  return flesh_system_potential_by_position(system, point, shift, &(flesh_position_potential){0}, phi, magnitude);
}

/* What `evaluate` gives, by it or by the two that it stands for. */
static int evaluate_effect(const flesh_effect *effect, const flesh_point *point,
                           const flesh_shift *shift, double *r, double *phi, double *magnitude)
{
  const flesh_effect_operations *can = effect->operations;
  if (can->evaluate) return can->evaluate(effect, point, shift, r, phi, magnitude);
  int status = can->residual ? can->residual(effect, point, r) : FLESH_OK;
  if (!status && can->potential) status = can->potential(effect, point, shift, phi, magnitude);
  return status;
}

int flesh_system_evaluate_by_position(const flesh_system *system, const flesh_point *point, const flesh_shift *shift,
                                 flesh_position_potential *by_position, double *r, double *phi, double *magnitude)
{
  const flesh_point full = with_lag(point);
  flesh_position_potential sums[2] = {{0}};
  memset(r, 0, (size_t)system->nodes * 3 * sizeof *r);
  by_position->known = 0;
  for (int k = 0; k < system->entry_count; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    const int calls = (effect->operations->residual ? CALL_RESIDUAL : 0) |
                      (effect->operations->potential ? CALL_POTENTIAL : 0);
    if (!calls) continue;
    flesh_position_potential *sum = &sums[effect->operations->depends_on_position_only != 0];
    const double start = processor_time(full.costs);
    int status = evaluate_effect(effect, &full, shift, r, &sum->phi, &sum->magnitude);
    count(full.costs, k, calls, start);
    if (status) return status;
  }
  return add_by_position(sums, by_position, phi, magnitude);
}

int flesh_system_evaluate(const flesh_system *system, const flesh_point *point,
                          const flesh_shift *shift, double *r, double *phi, double *magnitude)
{
  FLESH_NEED({system, "system"}, {point, "point"}, {shift, "shift"}, {r, "r"}, {phi, "phi"}, {magnitude, "magnitude"});
  return flesh_system_evaluate_by_position(system, point, shift, &(flesh_position_potential){0}, r, phi, magnitude);
}

int flesh_system_energies_by_position(const flesh_system *system, const flesh_point *point,
                                 const flesh_position_potential *by_position, double *energies)
{
  const flesh_point full = with_lag(point);
  int of_position = 0;
  for (int k = 0; by_position->known && k < system->entry_count; k++)
    of_position += system->entries[k].effect->operations->depends_on_position_only != 0;
  for (int k = 0; k < system->entry_count; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    energies[k] = 0;
    if (!effect->operations->energy) continue;
    if (of_position == 1 && effect->operations->depends_on_position_only) {
      energies[k] = by_position->phi;
      continue;
    }
    const double start = processor_time(full.costs);
    int status = effect->operations->energy(effect, &full, &energies[k]);
    count(full.costs, k, CALL_ENERGY, start);
    if (status) return status;
  }
  return FLESH_OK;
}

int flesh_system_role_energies(const flesh_system *system, flesh_role role, const flesh_point *point, double *energies,
                               double *sum)
{
  const flesh_point full = with_lag(point);
  *sum = 0;
  for (int k = 0; k < system->entry_count; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    double energy = 0;
    if (effect->operations->role != role) continue;
    int status = effect->operations->energy ? effect->operations->energy(effect, &full, &energy) : FLESH_OK;
    if (energies) energies[k] = energy;
    *sum += energy;
    if (status) return status;
  }
  return FLESH_OK;
}

double flesh_system_role_energy(const flesh_system *system, flesh_role role, const double *energies)
{
  double sum = 0;
  for (int k = 0; k < system->entry_count; k++)
    if (system->entries[k].effect->operations->role == role) sum += energies[k];
  return sum;
}

int flesh_system_limits_step(const flesh_system *system) { return system->limits_step; }

double flesh_system_max_feasible_step(const flesh_system *system, double t_from, const double *x_from,
                        double t_to, const double *x_to)
{
  double way = 1;
  for (int k = 0; system->limits_step && k < system->entry_count; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    if (effect->operations->max_feasible_step)
      way = fmin(way, effect->operations->max_feasible_step(effect, t_from, x_from, t_to, x_to));
  }
  return way;
}

int flesh_system_tunnelled(const flesh_system *system, double t_from, const double *x_from,
                        double t_to, const double *x_to)
{
  int passed = 0;
  for (int k = 0; system->limits_step && k < system->entry_count && !passed; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    if (effect->operations->tunnelled)
      passed = effect->operations->tunnelled(effect, t_from, x_from, t_to, x_to);
  }
  return passed;
}

void flesh_system_push_out(const flesh_system *system, double t_from, const double *x_from,
                        double t_to, double *x_to)
{
  for (int k = 0; system->limits_step && k < system->entry_count; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    if (effect->operations->push_out)
      effect->operations->push_out(effect, t_from, x_from, t_to, x_to);
  }
}

int flesh_system_check(const flesh_system *system, double t, const double *x)
{
  FLESH_NEED({system, "system"}, {x, "x"});
  int status = FLESH_OK;
  for (int k = 0; k < system->entry_count && !status; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    if (effect->operations->check) status = effect->operations->check(effect, t, x);
  }
  return status;
}

int flesh_system_matrix_create(const flesh_system *system, flesh_block_matrix **matrix)
{
  FLESH_NEED({matrix, "matrix"});
  *matrix = NULL;
  FLESH_NEED({system, "system"});
  const flesh_pattern *pattern = &system->pattern;
  if (!system->finished)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the system is not finished; flesh_system_finalize makes its pattern");
  *matrix = malloc(sizeof **matrix);
  double *values = flesh_huge_pages_calloc(((size_t)pattern->row_start[pattern->rows] * 9 + 1) * sizeof *values);
  if (!*matrix || !values) {
    free(*matrix);
    free(values);
    *matrix = NULL;
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for a matrix of %d blocks",
                      pattern->row_start[pattern->rows]);
  }
  **matrix = (flesh_block_matrix){pattern->rows, pattern->row_start, pattern->row_end, pattern->column, values};
  return FLESH_OK;
}

void flesh_block_matrix_destroy(flesh_block_matrix **matrix)
{
  if (!matrix || !*matrix) return;
  free((*matrix)->values);
  free(*matrix);
  *matrix = NULL;
}
