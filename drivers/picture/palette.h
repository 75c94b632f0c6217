/* palette.h: one colour per energy, the same in every plot. Distinguishable with any colour vision
 * (after Okabe & Ito 2008, with S in black and M in grey). */
#ifndef FLESH_PICTURE_PALETTE_H
#define FLESH_PICTURE_PALETTE_H

#include "material/form.h"

static inline const char *flesh_palette_colour(flesh_energy energy)
{
  return (unsigned)energy < FLESH_ENERGY_COUNT ? flesh_forms[energy].colour : "#8B4513";
}

#endif
