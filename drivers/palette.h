/* palette.h: one colour per energy, the same in every plot. Told apart by eyes of all kinds
 * (after Okabe & Ito 2008, with S in black and M in grey). */
#ifndef FLESH_DRIVERS_PALETTE_H
#define FLESH_DRIVERS_PALETTE_H

#include "flesh/material.h"

static inline const char *flesh_palette_colour(flesh_energy energy)
{
  static const char *const colours[] = {
      [FLESH_ENERGY_NEO] = "#0072B2", [FLESH_ENERGY_A] = "#56B4E9",
      [FLESH_ENERGY_B] = "#D55E00",   [FLESH_ENERGY_C] = "#E69F00",
      [FLESH_ENERGY_M] = "#8C8C8C",   [FLESH_ENERGY_D] = "#AA3399",
      [FLESH_ENERGY_E] = "#009E60",   [FLESH_ENERGY_S] = "#000000",
      [FLESH_ENERGY_USER] = "#8B4513"};
  return (unsigned)energy <= FLESH_ENERGY_USER ? colours[energy] : "#8B4513";
}

#endif
