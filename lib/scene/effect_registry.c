/* effect_registry.c: the effects that a scene can name, in the order of their list. */
#include "scene/effect_registry.h"

static const flesh_effect_row *const rows[] = {
#define FLESH_EFFECT_ROW_ADDRESS(name) &flesh_effect_row_##name,
    FLESH_EFFECT_LIST(FLESH_EFFECT_ROW_ADDRESS)
#undef FLESH_EFFECT_ROW_ADDRESS
};

const flesh_effect_row *const *flesh_effect_registry(int *count)
{
  *count = (int)(sizeof rows / sizeof rows[0]);
  return rows;
}
