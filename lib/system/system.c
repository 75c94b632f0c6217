/* system.c: builds a system of effects and constraints with its pattern, and queries all of its effects. */
#include "flesh/system.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "effect/effect.h"
#include "mesh/mesh.h"
#include "parallel/rank_part.h"
#include "system/internal.h"
#include "system/parts.h"
#include "system/effect_view.h"
#include "system/ranks.h"
#include "system/system.h"

int flesh_system_create(const flesh_mesh *mesh, flesh_system **system)
{
  FLESH_NEED({system, "system"});
  *system = NULL;
  FLESH_NEED({mesh, "mesh"});
  *system = flesh_calloc(1, sizeof **system);
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
    if (self->entries[k].owns_slots) flesh_free(self->entries[k].slots);
  }
  for (int k = 0; k < self->constraint_count; k++) {
    flesh_free(self->constraints[k].nodes);
    flesh_motion_clear(&self->constraints[k].motion);
  }
  flesh_free(self->entries);
  flesh_free(self->constraints);
  flesh_pattern_clear(&self->pattern);
  flesh_free(self->left);
  flesh_free(self);
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
  if (!status) status = flesh_effect_check_mesh(*effect, system->mesh);
  flesh_system_entry *grown = status ? NULL
                        : flesh_realloc(system->entries,
                                  ((size_t)system->entry_count + 1) * sizeof *system->entries);
  if (!grown) {
    flesh_effect_destroy(effect);
    return status ? status : flesh_fail(FLESH_ERR_MEMORY, "no memory for one more effect");
  }
  system->entries = grown;
  system->entries[system->entry_count++] = (flesh_system_entry){.effect = *effect};
  system->limits_step |= flesh_effect_as_barrier(*effect)->max_feasible_step != NULL;
  *effect = NULL;
  return FLESH_OK;
}

static int add_constraint(flesh_system *system, int count, const int *nodes, unsigned axes,
                          const flesh_motion *motion, double from, double until)
{
  int status = still_open(system);
  if (status) return status;
  if ((count < 1 && !system->team && !system->mesh->split) || axes == 0 || axes > FLESH_AXES_ALL)
    return flesh_fail(FLESH_ERR_ARGUMENT, "a constraint needs at least one node and one axis");
  if (!(until > from))
    return flesh_fail(FLESH_ERR_ARGUMENT, "until is %g s; it must be after from, %g s", until, from);
  for (int k = 0; k < count; k++)
    if (nodes[k] < 0 || nodes[k] >= system->nodes)
      return flesh_fail(FLESH_ERR_ARGUMENT, "node %d is constrained; the mesh has the nodes 0 to %d",
                        nodes[k], system->nodes - 1);
  flesh_constraint *grown = flesh_realloc(system->constraints,
                              ((size_t)system->constraint_count + 1) * sizeof *grown);
  if (!grown) return flesh_fail(FLESH_ERR_MEMORY, "no memory for one more constraint");
  system->constraints = grown;
  flesh_constraint *c = &grown[system->constraint_count];
  *c = (flesh_constraint){.count = count, .axes = axes, .from = from, .until = until};
  if (motion && (status = flesh_motion_copy(motion, &c->motion))) return status;
  c->nodes = flesh_malloc(((size_t)count + 1) * sizeof *c->nodes);
  if (!c->nodes) {
    flesh_motion_clear(&c->motion);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d constrained nodes", count);
  }
  if (count) memcpy(c->nodes, nodes, (size_t)count * sizeof *c->nodes);
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

/* Whether two sets of cells have the same pairs. */
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

/* Finds the effect that assigns the most blocks, and the blocks that it leaves unassigned. */
static int find_leader(flesh_system *system)
{
  size_t most = 0;
  system->leader = -1;
  for (int k = 0; k < system->entry_count; k++) {
    const flesh_system_entry *e = &system->entries[k];
    if (!flesh_effect_private_of(e->effect)->jacobian_assign || !e->slots) continue;
    const size_t pairs = flesh_pattern_pairs(cells_of(e->effect));
    if (pairs > most) most = pairs, system->leader = k;
  }
  if (system->leader < 0) return FLESH_OK;
  return flesh_pattern_rest(&system->pattern, most, system->entries[system->leader].slots, &system->left_count,
                            &system->left);
}

/* Checks that at most one effect has multipliers: there is one for each tet, which two effects would share. */
static int check_holders(const flesh_system *system)
{
  int count = 0;
  for (int k = 0; k < system->entry_count; k++) count += system->entries[k].effect->operations->constraints != NULL;
  return count < 2 ? FLESH_OK
                   : flesh_fail(FLESH_ERR_ARGUMENT, "%d effects hold constraints by multipliers; there must be at most "
                                                    "one", count);
}

/* Returns the effect that enforces constraints by multipliers; NULL where there is none. */
static const flesh_effect *holder(const flesh_system *system)
{
  for (int k = 0; k < system->entry_count; k++)
    if (system->entries[k].effect->operations->constraints) return system->entries[k].effect;
  return NULL;
}

/* Finds whether any rank has multipliers, as this one may have none of the body's incompressible tets. `status`: that of
 * this rank's earlier work. */
static int find_others_hold(flesh_system *system, int status)
{
  double holds = holder(system) != NULL;
  status = flesh_team_sum_agreed(system->team, status, 1, &holds);
  if (!status) system->others_hold = holds > 0;
  return status;
}

static int make_pattern(flesh_system *system)
{
  int status = still_open(system);
  if (!status) status = check_holders(system);
  if (!status) status = flesh_system_settle_internals(system);
  if (status) return status;
  const flesh_cells **cells = flesh_malloc(((size_t)system->entry_count + 1) * sizeof *cells);
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
  flesh_free(cells);
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
  flesh_effect_sums_count(system);
  system->finished = !status;
  return status;
}

int flesh_system_finalize(flesh_system *system)
{
  FLESH_NEED({system, "system"});
  return find_others_hold(system, make_pattern(system));
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
  const flesh_effect_figures *figures = flesh_effect_figures_of(e->effect);
  if (!figures->memory) return 0;
  size_t bytes = figures->memory(e->effect);
  if (e->owns_slots) bytes += flesh_pattern_pairs(cells) * sizeof *e->slots;
  return bytes + sizeof *e + sizeof *e->effect;
}

int flesh_system_has_follower_loads(const flesh_system *system)
{
  for (int k = 0; k < system->entry_count; k++)
    if (flesh_effect_has_trait(system->entries[k].effect, FLESH_IS_FOLLOWER_LOAD)) return 1;
  return 0;
}

int flesh_system_freezes(const flesh_system *system)
{
  for (int k = 0; k < system->entry_count; k++)
    if (flesh_effect_has_trait(system->entries[k].effect, FLESH_FREEZES)) return 1;
  return 0;
}

int flesh_system_multiplier_count(const flesh_system *system)
{
  return holder(system) || system->others_hold ? flesh_mesh_tet_count(system->mesh) : 0;
}

int flesh_system_constraint_gaps(const flesh_system *system, const flesh_point *point, double *gaps, double *stiffness)
{
  FLESH_NEED({system, "system"}, {point, "point"}, {gaps, "gaps"});
  const flesh_effect *effect = holder(system);
  if (!effect && !system->others_hold)
    return flesh_fail(FLESH_ERR_ARGUMENT, "no effect of the system holds constraints by multipliers");
  const size_t bytes = (size_t)flesh_mesh_tet_count(system->mesh) * sizeof *gaps;
  if (!effect) memset(gaps, 0, bytes);
  if (!effect && stiffness) memset(stiffness, 0, bytes);
  if (effect && stiffness) effect->operations->constraints->stiffness(effect, stiffness);
  return flesh_team_agree(system->team, effect ? effect->operations->constraints->gaps(effect, point, gaps) : FLESH_OK);
}

double flesh_system_next_event(const flesh_system *system, double t)
{
  double next = INFINITY;
  for (int k = 0; k < system->entry_count; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    const flesh_effect_time *in_time = flesh_effect_in_time(effect);
    const double its = in_time->next_event ? in_time->next_event(effect, t) : INFINITY;
    if (its > t) next = fmin(next, its);
  }
  for (int k = 0; k < system->constraint_count; k++) {
    const flesh_constraint *c = &system->constraints[k];
    next = fmin(next, flesh_interval_next_event(c->from, c->until, t));
    next = fmin(next, flesh_motion_next_event(&c->motion, t));
  }
  return flesh_team_least(system->team, next);
}

int flesh_system_moves(const flesh_system *system)
{
  for (int k = 0; k < system->entry_count; k++) {
    const flesh_effect_time *time = system->entries[k].effect->operations->time;
    if (time && !time->next_event) return 1;
  }
  return flesh_system_next_event(system, -INFINITY) < INFINITY;
}

int flesh_system_set_part(flesh_system *system, const flesh_rank_part *rank_part)
{
  FLESH_NEED({system, "system"}, {rank_part, "rank_part"});
  if (system->mesh != flesh_rank_part_mesh(rank_part))
    return flesh_fail(FLESH_ERR_ARGUMENT, "the system is on another mesh; it must be on flesh_rank_part_mesh's");
  system->team = flesh_rank_part_team(rank_part);
  flesh_effect_sums_count(system);
  return system->finished ? find_others_hold(system, FLESH_OK) : FLESH_OK;
}

const flesh_team *flesh_system_team(const flesh_system *system) { return system->team; }

int flesh_system_check_shared(const flesh_effect *effect)
{
  const int shared = flesh_effect_has_trait(effect, FLESH_IS_SUM_OVER_TETS) || flesh_effect_private_of(effect)->ranks;
  const int keeps_tets = effect->operations->internal && !flesh_effect_private_of(effect)->ranks;
  if (shared && !keeps_tets) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT, "effect %s does not run on several ranks; run it on one",
                    effect->operations->name);
}

int flesh_system_check_team(const flesh_system *system)
{
  int status = FLESH_OK;
  for (int k = 0; system->team && !status && k < system->entry_count; k++)
    status = flesh_system_check_shared(system->entries[k].effect);
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
  *matrix = flesh_malloc(sizeof **matrix);
  double *values = flesh_huge_pages_calloc(((size_t)pattern->row_start[pattern->rows] * 9 + 1) * sizeof *values);
  if (!*matrix || !values) {
    flesh_free(*matrix);
    flesh_free(values);
    *matrix = NULL;
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for a matrix of %d blocks",
                      pattern->row_start[pattern->rows]);
  }
  **matrix = flesh_pattern_matrix(pattern, values);
  return FLESH_OK;
}

void flesh_block_matrix_destroy(flesh_block_matrix **matrix)
{
  if (!matrix || !*matrix) return;
  flesh_free((*matrix)->values);
  flesh_free(*matrix);
  *matrix = NULL;
}
