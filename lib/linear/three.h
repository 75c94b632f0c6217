/* three.h: a block of 3 x 3 numbers as rows of four lanes, the last of which is ignored. */
#ifndef FLESH_LINEAR_THREE_H
#define FLESH_LINEAR_THREE_H

#include "linear/lanes.h"

typedef struct three {
  flesh_float4 row[3];
} three;

/* A^T B. */
static inline three three_transposed_product(const three *A, const three *B)
{
  three C;
  for (int r = 0; r < 3; r++)
    C.row[r] = B->row[0] * A->row[0][r] + B->row[1] * A->row[1][r] + B->row[2] * A->row[2][r];
  return C;
}

static inline void three_add(three *sum, const three *A)
{
  for (int r = 0; r < 3; r++) sum->row[r] += A->row[r];
}

#endif
