// TEST full memory seconds=60
/* test_effect_keys.c: every effect that a scene can name, with every subset of its optional keys (of many keys those that
 * take or omit at most three), generated from the tables of keys, is refused with a message, or supports everything that
 * a run asks of an effect. */
#include "temporary.h"
#include "system/system.h"

#include <stdlib.h>

#include "body.h"
#include "mesh/mesh.h"
#include "scene/effect_registry.h"
#include "scene/keys.h"
#include "test.h"

enum { TEXT = 4096, KEYS_MAX = 16 };

static char surface[512]; /* value for keys that name a file: a triangle far below the body */

static void add_text(char *text, const char *format, const char *word)
{
  const size_t used = strlen(text);
  snprintf(text + used, TEXT - used, format, word);
}

static void add_mapping(char *text, const flesh_key *keys, int item);

/* Returns a valid number other than the default; in items of a list, ascending ones. */
static double number_for(const flesh_key *key, int item)
{
  const double given = key->default_value ? atof(key->default_value) : 0;
  if (key->range == FLESH_RANGE_FRACTION || key->range == FLESH_RANGE_POISSON) return 0.25;
  return isfinite(given) ? 2 * given + 0.5 + item : given < 0 ? 0 : 1;
}

/* Adds a value of the key: vectors differ from key to key, and point from the unit cube to where obstacles leave
 * room. */
static void add_value(char *text, const flesh_key *key, int place, int item)
{
  char number[64];
  switch (key->type) {
  case FLESH_KEY_NUMBER: snprintf(number, sizeof number, "%g", number_for(key, item)); break;
  case FLESH_KEY_INTEGER: snprintf(number, sizeof number, "%d", (int)number_for(key, item)); break;
  case FLESH_KEY_VECTOR: snprintf(number, sizeof number, "[0.5, 0, %d]", -4 - place); break;
  case FLESH_KEY_CHOICE: /* the last one */
    for (int k = 0; key->choices[k]; k++) snprintf(number, sizeof number, "%s", key->choices[k]);
    break;
  case FLESH_KEY_BOOLEAN: snprintf(number, sizeof number, "true"); break;
  case FLESH_KEY_TEXT: snprintf(number, sizeof number, "whole"); break;
  case FLESH_KEY_BOX: snprintf(number, sizeof number, "[[0.4, -1, -1], [2, 2, 2]]"); break;
  case FLESH_KEY_SET: snprintf(number, sizeof number, "[%s]", key->choices[0]); break;
  case FLESH_KEY_INTEGERS: snprintf(number, sizeof number, "[0]"); break;
  case FLESH_KEY_TREE: snprintf(number, sizeof number, "self"); break; /* contact's `between` */
  case FLESH_KEY_PATH: add_text(text, "\"%s\"", surface); return;
  case FLESH_KEY_OBJECT: add_mapping(text, key->children, item); return;
  case FLESH_KEY_OBJECTS:
    for (int k = 0; k < 2; k++) {
      add_text(text, "%s", k ? ", " : "[");
      add_mapping(text, key->children, k);
    }
    add_text(text, "%s", "]");
    return;
  default: CHECK(!"a type of key that no effect had"); return;
  }
  add_text(text, "%s", number);
}

static void add_mapping(char *text, const flesh_key *keys, int item)
{
  for (int k = 0; keys[k].name; k++) {
    add_text(text, k ? ", %s: " : "{%s: ", keys[k].name);
    add_value(text, &keys[k], k, item);
  }
  add_text(text, "%s", "}");
}

/* Writes the row's keys with values: the sample's, or made-up ones. */
static flesh_node *full_mapping(const flesh_effect_row *row, flesh_arena *arena)
{
  char text[TEXT];
  flesh_node *sample = NULL, *made = NULL;
  const flesh_source source = {.name = row->name};
  CHECK_OK(flesh_yaml_parse(arena, row->sample, strlen(row->sample), &source, &sample));
  flesh_node *full = flesh_node_create(arena, FLESH_NODE_MAPPING, &source);
  for (int k = 0; row->keys[k].name; k++) {
    flesh_node *value = flesh_node_find(sample, row->keys[k].name);
    if (!value) {
      snprintf(text, sizeof text, "%s: ", row->keys[k].name);
      add_value(text, &row->keys[k], k, 0);
      CHECK_OK(flesh_yaml_parse(arena, text, strlen(text), &source, &made));
      value = made->first;
    }
    flesh_node *copy = flesh_arena_take(arena, sizeof *copy);
    *copy = *value;
    copy->next = NULL;
    flesh_node_append(full, copy);
  }
  return full;
}

/* Asks everything that runs, checks and their files ask of a system's effects. */
static void ask_everything(const test_body *b)
{
  flesh_derivative_report report;
  const int count = flesh_system_effect_count(b->system);
  const flesh_point point = flesh_point_at(0, b->state.x, b->state.v, b->state.v);
  double energies[4];
  CHECK(count <= 4);
  CHECK_OK(flesh_system_energies(b->system, &point, energies));
  CHECK_OK(flesh_system_check(b->system, 0, b->state.x));
  CHECK(flesh_system_next_event(b->system, 0) > 0);
  CHECK(flesh_system_instructions(b->system) != FLESH_INSTRUCTIONS_AUTO);
  flesh_system_moves(b->system);
  flesh_system_has_follower_loads(b->system);
  for (int k = 0; k < count; k++) {
    const flesh_effect *effect = flesh_system_effect(b->system, k);
    const flesh_effect_figures *figures = effect->operations->figures;
    CHECK(!figures || !figures->memory || flesh_system_effect_memory(b->system, k) > 0);
    CHECK_OK(flesh_effect_check_derivatives(effect, b->mesh, 0.3, b->state.x, 1, &report));
    CHECK(flesh_derivative_report_passes(&report, 1e-6));
    double values[8];
    if (figures && figures->report) figures->report(effect, &point, values);
  }
}

static void make_cube(flesh_mass mass, test_body *b)
{
  static const flesh_body_part whole = {"whole", 0, 6};
  CHECK_OK(test_body_create(test_box(1, 1, 1, 1, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000, mass, 1, b));
  /* The sets of the name that texts have: a tet, and the nodes chosen by the box. */
  int set;
  CHECK_OK(flesh_mesh_sets_take(&b->mesh->sets, "whole", 5, &set));
  CHECK_OK(flesh_members_add(&b->mesh->sets.sets[set].tets, 0));
  for (int i = 0; i < 8; i++)
    if (b->mesh->positions[3 * i] == 1) CHECK_OK(flesh_members_add(&b->mesh->sets.sets[set].nodes, i));
  b->body.part_count = 1;
  b->body.parts = &whole;
  test_jitter(b->n, 0.05, 5, b->state.x);
  for (int d = 0; d < b->n; d++) b->state.v[d] = 0.1 * (d % 5);
}

/* Tries one subset. Returns whether it is accepted. */
static int try_subset(const flesh_effect_row *row, const flesh_node *full, unsigned chosen, flesh_mass mass)
{
  test_body b;
  flesh_arena arena = {0};
  const flesh_source source = {.name = row->name};
  flesh_node *mapping = flesh_node_create(&arena, FLESH_NODE_MAPPING, &source), copies[KEYS_MAX];
  int optional = 0, place = 0;
  for (const flesh_node *value = full->first; value; value = value->next, place++) {
    if (flesh_key_named(row->keys, value->key)->default_value && !(chosen >> optional++ & 1)) continue;
    copies[place] = *value;
    copies[place].next = NULL;
    flesh_node_append(mapping, &copies[place]);
  }
  make_cube(mass, &b);
  void *parameters = flesh_arena_take(&arena, row->parameters_size);
  const flesh_key_reader reader = {.arena = &arena};
  int status = flesh_keys_read(&reader, row->keys, mapping, mapping, row->name, parameters);
  CHECK_OK(status); /* each value alone is valid */
  if (!status && !row->once) status = row->add(parameters, &b.body, b.system);
  const int accepted = !status;
  if (status) CHECK(status == FLESH_ERR_ARGUMENT && strlen(flesh_error_text()) > 10);
  if (accepted) {
    flesh_solver_options options = test_options(1e-4);
    flesh_integrator *integrator = NULL;
    CHECK_OK(flesh_system_finalize(b.system));
    ask_everything(&b);
    CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.01, NULL));
    flesh_integrator_destroy(&integrator);
  }
  test_body_destroy(&b);
  flesh_arena_free(&arena);
  return accepted;
}

static void subsets_of_keys_run_or_are_refused(void)
{
  char folder[256];
  CHECK(!test_folder_make(folder, sizeof folder));
  snprintf(surface, sizeof surface, "%s/surface.obj", folder);
  FILE *file = fopen(surface, "w");
  CHECK(file && fputs("v -1 -1 -9\nv 2 -1 -9\nv 0 2 -9\nf 1 2 3\n", file) > 0 && !fclose(file));
  int rows;
  const flesh_effect_row *const *all = flesh_effect_registry(&rows);
  for (int k = 0; k < rows; k++) {
    const flesh_effect_row *row = all[k];
    flesh_arena arena = {0};
    const flesh_node *full = full_mapping(row, &arena);
    unsigned optional = 0, accepted = 0, seen = 0, tried = 0, of_two = 0; /* of_two: keys that need another body */
    for (const flesh_key *key = row->keys; key->name; key++) {
      if (!strcmp(key->name, "bodies")) of_two |= 1u << optional;
      optional += key->default_value != NULL;
    }
    CHECK(full->count <= KEYS_MAX);
    for (unsigned chosen = 0; chosen < 1u << optional; chosen++) {
      const unsigned taken = (unsigned)__builtin_popcount(chosen), most = TEST_FEWER(3, 2);
      if (optional > 6 && taken > most && taken + most < optional) continue;
      for (int mass = 0; mass < TEST_FEWER(2, 1); mass++) {
        const int failures = test_failures;
        const int ran = try_subset(row, full, chosen, (flesh_mass)mass);
        if (test_failures > failures) printf("# %s: optional keys %#x, mass %d\n", row->name, chosen, mass);
        tried++;
        accepted += (unsigned)ran;
        if (ran) seen |= chosen;
      }
    }
    printf("# %-10s %2u optional keys: %4u of %4u runs\n", row->name, optional, accepted, tried);
    CHECK((seen | of_two) == (1u << optional) - 1); /* every key was in a subset that ran */
    flesh_arena_free(&arena);
  }
  test_folder_remove(folder);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(subsets_of_keys_run_or_are_refused));
}
