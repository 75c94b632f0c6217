/* unused.c: warns of keys and effects that change nothing in this scene, because of its other choices. A value equal to
 * the key's default needs no warning. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "geometry/motion.h"
#include "mesh/mesh.h"
#include "scene/effect_list.h"
#include "scene/keys.h"
#include "scene/probe_effects.h"
#include "scene/scene.h"
#include "system/system.h"

static int is_static(const flesh_scene *s) { return s->time.method == FLESH_METHOD_STATIC; }
static int moves(const flesh_scene *s) { return !is_static(s); }
static int uses_alpha(const flesh_scene *s) { return s->time.method == FLESH_METHOD_HHT; }
static int uses_beta(const flesh_scene *s) { return s->time.method == FLESH_METHOD_NEWMARK; }
static int uses_radius(const flesh_scene *s) { return s->time.method == FLESH_METHOD_GENERALIZED_ALPHA; }
static int uses_table(const flesh_scene *s) { return s->time.method == FLESH_METHOD_RUNGE_KUTTA; }
static int uses_order(const flesh_scene *s) { return s->time.method == FLESH_METHOD_IDA; }
static int has_pcg(const flesh_scene *s) { return s->keys.solver.linear_solver == FLESH_LINEAR_PCG; }
static int has_newton(const flesh_scene *s) { return !uses_order(s); }
static int errors_choose(const flesh_scene *s) { return s->time.adaptive.control || uses_order(s); }
int flesh_scene_uses_newton_tolerance(const flesh_scene *s)
{
  return !errors_choose(s) || (has_newton(s) && flesh_system_multiplier_count(s->system) > 0);
}
static int uses_adaptive(const flesh_scene *s)
{
  return is_static(s) ? s->keys.time.controlled == 0 : !uses_order(s) || s->keys.time.controlled == 1;
}
static int takes_steps(const flesh_scene *s) { return moves(s) || flesh_system_moves(s->system); }
static int has_frames(const flesh_scene *s) { return s->keys.output.given.frame_interval > 0; }
static int lags(const flesh_scene *s)
{
  return uses_order(s) || (moves(s) && (flesh_system_has_follower_loads(s->system) ||
                                        flesh_scene_has_positive(s, "friction") || flesh_scene_has_positive(s, "speed")));
}
/* Returns whether a tet has the body's material, which is the first, or one that a map makes from it. */
static int has_own_material(const flesh_scene *s)
{
  const int *of = s->keys.body.material_map || s->mesh->split ? NULL : s->body.tet_material;
  int tet = 0;
  while (of && tet < flesh_mesh_tet_count(s->mesh) && of[tet] != 0) tet++;
  return tet < flesh_mesh_tet_count(s->mesh);
}
/* Returns whether a tet has the body's density, which no region or other body replaces. */
static int has_own_density(const flesh_scene *s)
{
  int tet = 0;
  while (!s->mesh->split && tet < flesh_mesh_tet_count(s->mesh) && s->body.density[tet] != s->keys.body.density) tet++;
  return tet < flesh_mesh_tet_count(s->mesh);
}
static int has_start_velocity(const flesh_scene *s) { return is_static(s) || !s->keys.start.state; }
static int has_places(const flesh_scene *s)
{
  return has_frames(s) && (s->keys.output.given.fields & ~(unsigned)(FLESH_FIELD_DISPLACEMENT | FLESH_FIELD_VELOCITY |
                                                                     FLESH_FIELD_REACTION | FLESH_FIELD_CONTACT_FORCE));
}
static int has_bearing(const flesh_scene *s) { return flesh_scene_count_bearing(s) > 0; }

/* Keys of a section, whether the scene uses them, and what would use them. */
static const struct {
  const char *section, *keys[7];
  int (*is_used)(const flesh_scene *scene);
  const char *user;
} rules[] = {
    {"time", {"alpha"}, uses_alpha, "it is for method hht"},
    {"time", {"beta", "gamma"}, uses_beta, "it is for method newmark"},
    {"time", {"spectral_radius"}, uses_radius, "it is for method generalized-alpha"},
    {"time", {"table"}, uses_table, "it is for methods runge-kutta and adaptive"},
    {"time", {"max_order"}, uses_order, "it is for method ida"},
    {"time", {"tolerance", "max_step", "max_steps"}, errors_choose,
     "it is for steps that errors choose (adaptive: true, or method ida)"},
    {"time", {"adaptive"}, uses_adaptive, "ida always chooses its steps, and static never does"},
    {"time", {"max_energy_gain"}, moves, "an equilibrium gains no energy"},
    {"time", {"step"}, takes_steps, "an equilibrium in which nothing changes with time takes one step"},
    {"body", {"mass"}, moves, "nothing accelerates in an equilibrium, and gravity is the same for both"},
    {"body", {"material"}, has_own_material, "regions and bodies have materials of their own"},
    {"body", {"density"}, has_own_density, "regions and bodies have densities of their own"},
    {"start", {"velocity"}, moves, "an equilibrium has no velocities"},
    {"start", {"velocity"}, has_start_velocity, "start.state has velocities"},
    {"solver", {"linear_tolerance", "max_linear", "preconditioner"}, has_pcg, "it is for linear_solver pcg"},
    {"solver", {"newton_tolerance"}, flesh_scene_uses_newton_tolerance, "time.tolerance ends the solves of steps that errors choose"},
    {"solver", {"max_newton", "lag_iterations", "line_search", "techniques", "accept_unconverged"}, has_newton,
     "ida has its own Newton iteration"},
    {"solver", {"max_cutbacks"}, has_newton, "ida chooses its steps"},
    {"solver", {"lag_iterations"}, lags,
     "it is for motions with friction, settling_damping.speed, or loads or damping that follow the shape"},
    {"output", {"fields"}, has_frames, "frame_interval is 0: there are no frames"},
    {"output", {"fields_at"}, has_places, "no field of the frames uses it"},
    {"output", {"reactions"}, has_bearing, "there is no pin, prescribed_motion, contact, weld or joint"},
};

/* Finds whether the value differs from the key's default. FLESH_ERR_MEMORY. */
static int find_given(flesh_scene *scene, const flesh_key *key, const void *value, int *given)
{
  _Alignas(16) char other[64];
  flesh_key row[] = {*key, {0}};
  flesh_key_reader reader = {.arena = &scene->arena};
  flesh_text texts[2] = {{0}};
  row->offset = 0;
  *given = 0;
  const int status = flesh_keys_read(&reader, row, NULL, NULL, "", other);
  if (status) return status == FLESH_ERR_MEMORY ? status : FLESH_OK; /* the key has no default */
  flesh_keys_write(row, value, 0, &texts[0]);
  flesh_keys_write(row, other, 0, &texts[1]);
  const int failed = texts[0].failed || texts[1].failed;
  *given = !failed && strcmp(texts[0].data ? texts[0].data : "", texts[1].data ? texts[1].data : "") != 0;
  for (int k = 0; k < 2; k++) free(texts[k].data);
  return failed ? flesh_no_memory() : FLESH_OK;
}

static int warn(flesh_scene *scene, const char *path, const char *key, const char *why)
{
  return flesh_scene_warn(scene, flesh_arena_print(&scene->arena, "%s%s%s has no effect: %s", path, key ? "." : "",
                                                   key ? key : "", why));
}

static int warn_of_sections(flesh_scene *scene)
{
  int status = FLESH_OK;
  for (size_t k = 0; k < sizeof rules / sizeof *rules; k++) {
    const flesh_key *section = flesh_key_named(flesh_scene_table, rules[k].section);
    for (const char *const *name = rules[k].keys; *name && !status && !rules[k].is_used(scene); name++) {
      const flesh_key *key = flesh_key_named(section->children, *name);
      int given;
      status = find_given(scene, key, (const char *)&scene->keys + section->offset + key->offset, &given);
      if (given) status = warn(scene, section->name, key->name, rules[k].user);
    }
  }
  return status;
}

/* Returns the effect's key of that name, or one in a nested mapping, such as passive.c1, and its value; NULL: none. */
static const flesh_key *key_of(const flesh_effect_entry *entry, const char *name, const void **value)
{
  const char *dot = strchr(name, '.');
  char outer[32];
  snprintf(outer, sizeof outer, "%.*s", dot ? (int)(dot - name) : (int)strlen(name), name);
  const flesh_key *key = flesh_key_named(entry->row->keys, outer);
  *value = key ? (const char *)entry->parameters + key->offset : NULL;
  if (key && dot) {
    key = flesh_key_named(key->children, dot + 1);
    *value = (const char *)*value + key->offset;
  }
  return key;
}

static const void *value_of(const flesh_effect_entry *entry, const char *name)
{
  const void *value;
  key_of(entry, name, &value);
  return value;
}

/* Returns the effect's list of points in time; NULL: it has none. */
static const flesh_objects *points_of(const flesh_effect_entry *entry, const flesh_key **key)
{
  for (*key = entry->row->keys; (*key)->name; (*key)++)
    if ((*key)->type == FLESH_KEY_OBJECTS && flesh_key_named((*key)->children, "time"))
      return (const flesh_objects *)((const char *)entry->parameters + (*key)->offset);
  return NULL;
}

static int has_points(const flesh_scene *scene, const flesh_effect_entry *entry)
{
  const flesh_key *key;
  const flesh_objects *points = points_of(entry, &key);
  (void)scene;
  return points && points->count > 1;
}

static int turns(const flesh_scene *scene, const flesh_effect_entry *entry)
{
  const flesh_objects *motion = value_of(entry, "motion");
  const flesh_keyframe *frames = motion ? motion->values : NULL;
  (void)scene;
  for (int k = 0; motion && k < motion->count; k++)
    if (frames[k].rotation[0] != 0 || frames[k].rotation[1] != 0 || frames[k].rotation[2] != 0) return 1;
  return !motion;
}

static int is_positive(const flesh_effect_entry *entry, const char *key)
{
  return *(const double *)value_of(entry, key) > 0;
}

static int rubs(const flesh_scene *scene, const flesh_effect_entry *entry)
{
  (void)scene;
  return is_positive(entry, "friction");
}

/* Returns whether the muscle has a passive part; by default it has one if it has an active part. */
static int resists(const flesh_scene *scene, const flesh_effect_entry *entry)
{
  (void)scene;
  return is_positive(entry, isnan(*(const double *)value_of(entry, "passive.c1")) ? "peak_stress" : "passive.c1");
}

static int contracts(const flesh_scene *scene, const flesh_effect_entry *entry)
{
  (void)scene;
  return is_positive(entry, "peak_stress");
}

static int pulls(const flesh_scene *scene, const flesh_effect_entry *entry)
{
  return contracts(scene, entry) || resists(scene, entry);
}

static int shortens(const flesh_scene *scene, const flesh_effect_entry *entry)
{
  return moves(scene) && is_positive(entry, "peak_stress");
}

/* Returns whether the fluid of a drag or the body moves. */
static int streams(const flesh_scene *scene, const flesh_effect_entry *entry)
{
  const double *v = value_of(entry, "velocity");
  return moves(scene) || v[0] != 0 || v[1] != 0 || v[2] != 0;
}

/* Returns whether friction can act: in equilibria only moving obstacles slide. */
static int can_rub(const flesh_scene *scene, const flesh_effect_entry *entry)
{
  const flesh_objects *motion = value_of(entry, "motion");
  return moves(scene) || (motion && motion->count > 1);
}

static int has_speeds(const flesh_scene *scene, const flesh_effect_entry *entry)
{
  (void)entry;
  return moves(scene);
}

static int is_stiff(const flesh_scene *scene, const flesh_effect_entry *entry)
{
  (void)scene;
  return is_positive(entry, "stiffness");
}

/* A key of effects, or a whole effect, and what would use it. */
static const struct {
  const char *effect, *key; /* NULL: of any effect; the whole effect */
  int (*is_used)(const flesh_scene *scene, const flesh_effect_entry *entry);
  const char *user;
} effect_rules[] = {
    {NULL, "interpolation", has_points, "there are no two points in time between which values change"},
    {"prescribed_motion", "centre", turns, "nothing turns about it"},
    {"contact", "centre", turns, "nothing turns about it"},
    {"contact", "slip_speed", rubs, "there is no friction"},
    {"contact", "friction", can_rub, "in statics there is friction on obstacles that move only"},
    {"damping", "stiffness_at", is_stiff, "there is no damping by stiffness"},
    {"damping", NULL, has_speeds, "an equilibrium has no velocities"},
    {"viscosity", NULL, has_speeds, "an equilibrium has no velocities"},
    {"settling_damping", NULL, has_speeds, "an equilibrium has no velocities"},
    {"drag", NULL, streams, "an equilibrium has no velocities, and the fluid has none"},
    {"muscle", NULL, pulls, "peak_stress is 0, and there is no passive part (passive.c1)"},
    {"muscle", "passive.c2", resists, "there is no passive part (passive.c1)"},
    {"muscle", "passive.limit", resists, "there is no passive part (passive.c1)"},
    {"muscle", "activation", contracts, "peak_stress is 0: there is no active part"},
    {"muscle", "max_shortening_velocity", shortens, "it is for muscles with an active part (peak_stress > 0), in motion"},
};

static int warn_of_effect(flesh_scene *scene, const flesh_effect_entry *entry)
{
  int status = FLESH_OK;
  for (size_t k = 0; k < sizeof effect_rules / sizeof *effect_rules && !status; k++) {
    const char *name = effect_rules[k].key;
    if (effect_rules[k].effect && strcmp(effect_rules[k].effect, entry->row->name)) continue;
    const void *value = NULL;
    const flesh_key *key = name ? key_of(entry, name, &value) : NULL;
    if ((name && !key) || effect_rules[k].is_used(scene, entry)) continue;
    int given = 1;
    if (key) status = find_given(scene, key, value, &given);
    if (given) status = warn(scene, entry->path, name, effect_rules[k].user);
  }
  return status;
}

/* Warns of effects that act only before the start or after the end, and of lists of points in time of which only the
 * first is reached. An effect that ends before a start.state taken from another run has acted in that run, so it gets
 * no warning. */
static int warn_of_times(flesh_scene *scene, const flesh_effect_entry *entry)
{
  const double begin = scene->start.t, end = scene->time.end;
  const double *from = value_of(entry, "from"), *until = value_of(entry, "until");
  const flesh_key *key;
  const flesh_objects *points = points_of(entry, &key);
  char why[120];
  int status = FLESH_OK;
  if (until && *until <= begin && !(begin > 0 && *until > 0)) {
    snprintf(why, sizeof why, "it ends at %g s, and the run begins at %g s", *until, begin);
    status = warn(scene, entry->path, NULL, why);
  }
  if (from && *from > end) {
    snprintf(why, sizeof why, "it begins at %g s, and the run ends at %g s", *from, end);
    status = warn(scene, entry->path, NULL, why);
  }
  if (status || !points || points->count < 2) return status;
  const double *t = (const double *)((const char *)points->values + flesh_key_named(key->children, "time")->offset);
  if (*t < end) return FLESH_OK;
  snprintf(why, sizeof why, "the first point is at %g s, and the run ends at %g s", *t, end);
  return flesh_scene_warn(scene, flesh_arena_print(&scene->arena, "%s.%s changes nothing: %s", entry->path, key->name, why));
}

/* Warns of velocities that start.state replaces, and of reference points of probes that have no moment. */
static int warn_of_lists(flesh_scene *scene)
{
  const flesh_scene_other *others = scene->keys.bodies.values;
  const flesh_scene_probe *probes = scene->keys.output.probes.values;
  char path[40];
  int status = FLESH_OK;
  for (int k = 0; k < scene->keys.bodies.count && !status; k++) {
    snprintf(path, sizeof path, "bodies[%d]", k);
    if (isnan(others[k].velocity[0]) || (moves(scene) && !scene->keys.start.state)) continue;
    status = warn(scene, path, "velocity", is_static(scene) ? "an equilibrium has no velocities" : "start.state has velocities");
  }
  for (int k = 0; k < scene->keys.output.probes.count && !status; k++) {
    snprintf(path, sizeof path, "output.probes[%d]", k);
    if (!isnan(probes[k].about[0]) && !(probes[k].quantities & (FLESH_PROBE_REACTION | FLESH_PROBE_CONTACT_FORCE)))
      status = warn(scene, path, "about", "none of its quantities is a moment");
  }
  return status;
}

int flesh_scene_warn_of_unused(flesh_scene *scene)
{
  const flesh_effect_entry *entries = scene->keys.effects.values;
  int status = warn_of_sections(scene);
  for (int k = 0; k < scene->keys.effects.count && !status; k++) {
    status = warn_of_effect(scene, &entries[k]);
    if (!status) status = warn_of_times(scene, &entries[k]);
  }
  return status ? status : warn_of_lists(scene);
}
