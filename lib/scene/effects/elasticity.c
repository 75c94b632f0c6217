/* elasticity.c: elasticity: its keys in a scene. */
#include <assert.h>

#include "scene/effect_rows.h"

static const char *const instructions[] = {"auto", "portable", "avx2", "avx512", NULL};
static_assert(sizeof instructions / sizeof *instructions == FLESH_INSTRUCTIONS_COUNT + 1,
              "instructions are in the order of flesh_instructions");

static const flesh_key keys[] = {
    {.name = "instructions", .type = FLESH_KEY_CHOICE,
     .offset = offsetof(flesh_elasticity_parameters, instructions), .choices = instructions,
     .default_value = "auto",
     .doc = "vector instructions of the elements, in all of the scene's effects: auto, the best of this machine, or "
            "always the same ones; the same ones on the same build give the same bits, others agree to rounding"},
    {0}};

static int add(const void *values, const flesh_body *body, flesh_system *system)
{
  (void)values; /* the body has taken the values already */
  flesh_effect *effect = NULL;
  return flesh_effect_row_add(system, flesh_effect_elasticity(body, &effect), &effect);
}

const flesh_effect_row flesh_effect_row_elasticity = {
    .name = "elasticity",
    .doc = "The body's material resists deformation. Added to every scene with body.material.",
    .keys = keys,
    .parameters_size = sizeof(flesh_elasticity_parameters),
    .sample = "{}",
    .add = add,
    .on_parts = FLESH_PARTS_TETS,
    .once = 1,
};
