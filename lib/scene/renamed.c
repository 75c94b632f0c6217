/* renamed.c: the old names of effects, keys and values, a row each. */
#include "scene/renamed.h"

#include <stddef.h>
#include <string.h>

/* A key is known by its new name, which the table of keys must have: "calm" is an old name in `time` only. */
static const struct {
  const char *old, *key, *text; /* text: what to write now */
} keys_renamed[] = {
    {"curve", "amplitude", "amplitude"},
    {"against", "stiffness_at", "stiffness_at"},
    {"filtering", "eigenvalue_filter", "eigenvalue_filter"},
    {"projection", "eigenvalue_filter", "eigenvalue_filter (never: none; always: trust-region-always)"},
    {"project", "eigenvalue_filter", "eigenvalue_filter (never: none; always: trust-region-always)"},
    {"volume_tolerance", "newton_tolerance", "newton_tolerance, a hundredth of which it is"},
    {"globalization", "line_search", "line_search"},
    {"max_halvings", "max_cutbacks", "max_cutbacks"},
    {"calm", "switch_threshold", "switch_threshold"},
    {"follow_curvature", "techniques", "negative_curvature in the list techniques"},
    {"nonlinear_elimination", "techniques", "nonlinear_elimination in the list techniques"},
    {"watchdog", "techniques", "watchdog in the list techniques"},
    {"untangle", "techniques", "untangle in the list techniques"},
};

static const struct {
  const char *key, *old, *text, *why; /* why: NULL: renamed */
} choices_renamed[] = {
    {"stiffness_at", "rest", "initial", NULL},
    {"line_search", "energy", "potential", NULL},
    {"line_search", "kinsol", "residual", NULL},
    {"method", "calm-then-adaptive", "euler-then-adaptive", NULL},
    {"instructions", "none", "portable", "which no machine computes with"},
    {"command", "stress", "hardcases", NULL}, /* of a sweep */
};

static const struct {
  const char *old, *text;
} effects_renamed[] = {{"calm", "settling_damping"}, {"handle", "prescribed_motion"}};

static int has(const flesh_key *keys, const char *name)
{
  for (; keys->name; keys++)
    if (!strcmp(keys->name, name)) return 1;
  return 0;
}

const char *flesh_renamed_key(const flesh_key *keys, const char *name)
{
  for (size_t i = 0; i < sizeof keys_renamed / sizeof *keys_renamed; i++)
    if (!strcmp(keys_renamed[i].old, name) && has(keys, keys_renamed[i].key)) return keys_renamed[i].text;
  return NULL;
}

const char *flesh_renamed_choice(const flesh_key *key, const char *text, const char **why)
{
  for (size_t i = 0; i < sizeof choices_renamed / sizeof *choices_renamed; i++)
    if (!strcmp(choices_renamed[i].key, key->name) && !strcmp(choices_renamed[i].old, text)) {
      *why = choices_renamed[i].why ? choices_renamed[i].why : "which has been renamed";
      return choices_renamed[i].text;
    }
  return NULL;
}

const char *flesh_renamed_effect(const char *name)
{
  for (size_t i = 0; i < sizeof effects_renamed / sizeof *effects_renamed; i++)
    if (!strcmp(effects_renamed[i].old, name)) return effects_renamed[i].text;
  return NULL;
}
