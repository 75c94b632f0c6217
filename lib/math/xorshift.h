/* xorshift.h: pseudo-random numbers, the same in every run (Marsaglia 2003, "Xorshift RNGs"). */
#ifndef FLESH_MATH_XORSHIFT_H
#define FLESH_MATH_XORSHIFT_H

#include <stdint.h>

static const uint32_t flesh_xorshift_first = 2463534242u;

/* Advances *random and returns it. */
static inline uint32_t flesh_xorshift(uint32_t *random)
{
  *random ^= *random << 13;
  *random ^= *random >> 17;
  return *random ^= *random << 5;
}

#endif
