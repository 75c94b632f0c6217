/* contact_parts.h: how work on pairs of features is divided into parts. */
#ifndef FLESH_GEOMETRY_CONTACT_PARTS_H
#define FLESH_GEOMETRY_CONTACT_PARTS_H

#include <stdint.h>

/* Largest number of parts. The division depends on the amount of work, not on the number of threads. */
enum { FLESH_CONTACT_PARTS = 64 };

static inline int flesh_contact_parts(int count, int of_part)
{
  const int parts = count / of_part;
  return parts < 1 ? 1 : parts < FLESH_CONTACT_PARTS ? parts : FLESH_CONTACT_PARTS;
}

/* Returns the first item of part `part` if `count` items are divided into `parts` parts. */
static inline int flesh_contact_part(int count, int parts, int part)
{
  return (int)((int64_t)count * part / parts);
}

#endif
