/* material.c: makes a material from a scene's keys: which pair of constants is used, and how it enters. */
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "base/error.h"
#include "scene/keys.h"
#include "scene/scene.h"
#include "material/form.h"

/* Two constants that belong together, how many of them are given, and the last override that gave one. */
typedef struct pair {
  size_t offsets[2];
  int given, last;
} pair;

static const flesh_key *constant(const pair *p, int i)
{
  return flesh_key_at(flesh_material_table, p->offsets[i]);
}

static void look(pair *p, const flesh_node *node)
{
  for (int i = 0; i < 2; i++) {
    const flesh_node *child = flesh_node_find(node, constant(p, i)->name);
    if (!child || child->removed) continue;
    p->given++;
    if (child->override > p->last) p->last = child->override;
  }
}

static void forget(const pair *p, flesh_scene_material *keys)
{
  for (int i = 0; i < 2; i++) *(double *)((char *)keys + p->offsets[i]) = NAN;
}

/* Returns whether p is used instead of q: both of its constants are given, and q has none or earlier ones. */
static int wins(const pair *p, const pair *q)
{
  return p->given == 2 && (!q->given || p->last > q->last);
}

static int no_pair(const flesh_node *node, const char *path, const pair *lame, const pair *young)
{
  char given[128] = "";
  const pair *pairs[] = {lame, young};
  for (int i = 0; i < 4; i++) {
    const char *name = constant(pairs[i / 2], i % 2)->name;
    const flesh_node *child = flesh_node_find(node, name);
    if (!child || child->removed) continue;
    size_t used = strlen(given);
    snprintf(given + used, sizeof given - used, "%s%s", used ? ", " : "", name);
  }
  return flesh_node_fail(
      node, "%s gives %s; it must give %s and %s, or %s and %s: exactly one of the pairs", path,
      *given ? given : "no constants", constant(lame, 0)->name, constant(lame, 1)->name,
      constant(young, 0)->name, constant(young, 1)->name);
}

/* Checks that the element can have an incompressible material, the one at `path`. */
static int check_element(const flesh_node *node, const char *path, const pair *young, flesh_element element)
{
  const flesh_key *key = constant(young, 1);
  if (element == FLESH_ELEMENT_TET10_MEAN || element == FLESH_ELEMENT_AUTO) return FLESH_OK;
  return flesh_node_fail(flesh_scene_place(node, flesh_material_table, key->offset),
                         "%s.%s is 0.5, which the element %s cannot hold; set body.element to tet10-mean, or %s below 0.5",
                         path, key->name, flesh_element_name(element), key->name);
}

int flesh_scene_make_material(const flesh_node *node, const char *path, flesh_scene_material *keys,
                              flesh_element element, flesh_material *material)
{
  pair lame = {
      .offsets = {offsetof(flesh_scene_material, given.mu), offsetof(flesh_scene_material, given.lambda)}};
  pair young = {
      .offsets = {offsetof(flesh_scene_material, given.young), offsetof(flesh_scene_material, given.poisson)}};
  look(&lame, node);
  look(&young, node);
  int use_lame = wins(&lame, &young);
  if (!use_lame && !wins(&young, &lame)) return no_pair(node, path, &lame, &young);
  forget(use_lame ? &young : &lame, keys);
  if (keys->constants < 0)
    keys->constants = flesh_form_default_constants((flesh_energy)keys->energy);
  flesh_energy energy = (flesh_energy)keys->energy;
  flesh_constants constants = (flesh_constants)keys->constants;
  int status = flesh_material_from_given(energy, constants, &keys->given, material);
#define IN_FORCE(FORM, name, ...) if (!status && energy == FLESH_ENERGY_##FORM) keys->given.name = material->name;
  FLESH_FORM_CONSTANT_LIST(IN_FORCE)
#undef IN_FORCE
  if (status) return flesh_node_fail_within(status, node, "%s: ", path);
  return material->incompressible ? check_element(node, path, &young, element) : FLESH_OK;
}
