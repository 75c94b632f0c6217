/* form.h: the built-in forms as rows of FLESH_FORM_LIST describe them, to look up and as text. */
#ifndef FLESH_MATERIAL_FORM_H
#define FLESH_MATERIAL_FORM_H

#include "flesh/material.h"

/* Sets of flesh_constants, one bit each, as named in the rows. */
enum {
  FLESH_TAKES_RAW = 1 << FLESH_CONSTANTS_RAW,
  FLESH_TAKES_RAW_OR_MATCHED = FLESH_TAKES_RAW | 1 << FLESH_CONSTANTS_MATCHED,
  FLESH_TAKES_RAW_OR_AS_E = FLESH_TAKES_RAW | 1 << FLESH_CONSTANTS_AS_E
};

typedef struct flesh_form {
  const char *name, *full_name;         /* "S", "stable-neo-hookean" */
  const char *colour;                   /* "#rrggbb", distinguishable with any colour vision (after Okabe & Ito 2008) */
  unsigned constants;                   /* bits of the flesh_constants that the form takes */
  const char *limit;                    /* limit of raw lambda, as text; NULL: the form has no lambda */
  int at_limit;                         /* 1: raw lambda may equal the limit */
  flesh_volume_term volume_term;
} flesh_form;

extern const flesh_form flesh_forms[FLESH_ENERGY_COUNT];

/* Young's modulus and Poisson's ratio for Lame's constants of small strain; lambda INFINITY: incompressible. */
static inline double flesh_young_of_lame(double mu, double lambda) { return mu * (2 + 1 / (1 + mu / lambda)); }
static inline double flesh_poisson_of_lame(double mu, double lambda) { return 0.5 / (1 + mu / lambda); }

/* Returns whether a built-in form is undefined for J <= 0; 0 for a user's psi, whose function reports that itself. */
static inline int flesh_psi_needs_volume(flesh_energy energy)
{
#define FLESH_FORM_BIT(NAME, name, text, full, volume, ...) | (unsigned)(volume) << FLESH_ENERGY_##NAME
  return (0u FLESH_FORM_LIST(FLESH_FORM_BIT)) >> energy & 1;
#undef FLESH_FORM_BIT
}

/* Returns whether a built-in form depends on the singular values (stretch_forms.h) and not on I_C and J alone. */
static inline int flesh_form_of_stretches(flesh_energy energy)
{
#define FLESH_FORM_BIT(NAME, ...) | 1u << FLESH_ENERGY_##NAME
  return (0u FLESH_STRETCH_FORM_LIST(FLESH_FORM_BIT)) >> energy & 1;
#undef FLESH_FORM_BIT
}

/* Returns whether a built-in form is one that stiffens under stretch. */
static inline int flesh_form_stiffens(flesh_energy energy)
{
#define FLESH_FORM_BIT(NAME, ...) | 1u << FLESH_ENERGY_##NAME
  return (0u FLESH_STIFFENING_FORM_LIST(FLESH_FORM_BIT)) >> energy & 1;
#undef FLESH_FORM_BIT
}

/* Returns whether the form takes constants of this kind; 0 for a user's psi. */
static inline int flesh_form_takes(flesh_energy energy, flesh_constants constants)
{
  return (unsigned)energy < FLESH_ENERGY_COUNT && flesh_forms[energy].constants >> constants & 1;
}

/* Returns matched constants if the form takes them, else raw ones, with which the form is stressed at rest. */
static inline flesh_constants flesh_form_default_constants(flesh_energy energy)
{
  return flesh_form_takes(energy, FLESH_CONSTANTS_MATCHED) ? FLESH_CONSTANTS_MATCHED : FLESH_CONSTANTS_RAW;
}

/* Returns whether the material has stress at F = I, or no stiffness there. */
int flesh_material_is_stressed_at_rest(const flesh_material *material);

/* String literals of the names: "Neo, A, ... S", and those of the forms that take matched constants. */
#define FLESH_FORM_TEXT(NAME, name, text, ...) ", " text
#define FLESH_FORM_NAMES (&(FLESH_FORM_LIST(FLESH_FORM_TEXT))[2])
#define FLESH_FORM_MATCHED_TEXT(NAME, name, text, full, volume, takes, ...) FLESH_FORM_MATCHED_##takes(text)
#define FLESH_FORM_MATCHED_RAW(text)
#define FLESH_FORM_MATCHED_RAW_OR_AS_E(text)
#define FLESH_FORM_MATCHED_RAW_OR_MATCHED(text) " " text
#define FLESH_FORM_MATCHED_NAMES FLESH_FORM_LIST(FLESH_FORM_MATCHED_TEXT)

#endif
