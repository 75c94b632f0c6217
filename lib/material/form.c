/* form.c: the built-in forms, from the rows of FLESH_FORM_LIST. */
#include "material/form.h"

#include <assert.h>
#include <stddef.h>

#define FORM(NAME, name_, text, full, volume, takes, colour_, formula_, source_, limit_, limit_text, equal,            \
             matched_mu, matched_lambda, alpha, term)                                                                  \
  [FLESH_ENERGY_##NAME] = {.name = text,                                                                               \
                           .full_name = full,                                                                          \
                           .colour = colour_,                                                                          \
                           .constants = FLESH_TAKES_##takes,                                                           \
                           .limit = limit_text,                                                                        \
                           .at_limit = equal,                                                                          \
                           .volume_term = FLESH_VOLUME_##term},

const flesh_form flesh_forms[] = {FLESH_FORM_LIST(FORM)};

static_assert(sizeof flesh_forms / sizeof *flesh_forms == FLESH_ENERGY_COUNT, "a row of every form");
static_assert(FLESH_ENERGY_USER < 32, "the forms that need J > 0 are bits of one word");
