/* triangle.h: rows of 3x3 blocks with eight binary digits an entry (bfloat16), for substitutions that are limited by
 * memory.
 *
 * A row's blocks lie in pairs. A word has an entry of each block of the pair, the first's in its upper half and the
 * second's in its lower half: the upper halves of numbers in single precision. A split triangle has sixteen binary digits:
 * there a pair is one block, rounded, and the remainder of the rounding.
 *
 * Two threads may set blocks of one pair at the same time: each writes only its own halves. */
#ifndef FLESH_LINEAR_TRIANGLE_H
#define FLESH_LINEAR_TRIANGLE_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "base/archive.h"
#include "linear/lanes.h"

#define FLESH_TRIANGLE_FIRST 0xffff0000u

typedef struct flesh_triangle {
  int rows, split;
  int *row;    /* [rows] rows in the order in which they are kept */
  int *at;     /* [rows] place of each row in that order */
  int *start;  /* [rows+1] first pair of each place */
  int *column; /* [2*pairs] column of each block; twice the same if a row's last pair has only one block */
  uint32_t *words; /* [9*pairs] entries, and words that are loaded behind them */
} flesh_triangle;

/* Makes a triangle with `blocks` [rows] blocks in each row, all zero, with columns 0, kept in `order` [rows]. The caller
 * clears it. FLESH_OK or FLESH_ERR_MEMORY. */
int flesh_triangle_create(int rows, const int *blocks, const int *order, int split, flesh_triangle *triangle);
void flesh_triangle_clear(flesh_triangle *triangle);
/* Archives the blocks. Functions of this name archive the numbers that a set-up has made, and not the pattern. */
void flesh_triangle_archive(flesh_triangle *triangle, flesh_archive *archive);

/* Returns the place of a row's n-th block: twice its pair, plus 1 if it is the second. */
static inline int flesh_triangle_place(const flesh_triangle *triangle, int row, int n)
{
  return 2 * triangle->start[triangle->at[row]] + (triangle->split ? 2 * n : n);
}

/* Sets the column of a block, the row's n-th, after those before it. */
static inline void flesh_triangle_set_column(flesh_triangle *triangle, int row, int n, int column)
{
  const int place = flesh_triangle_place(triangle, row, n);
  triangle->column[place] = column;
  if (place % 2 == 0) triangle->column[place + 1] = column;
}

/* Returns the upper half of a number's bits, rounded, the rest 0. */
static inline uint32_t flesh_triangle_round(float x)
{
  uint32_t bits;
  memcpy(&bits, &x, sizeof bits);
  return (bits + 0x8000) & FLESH_TRIANGLE_FIRST; /* rounds to nearest */
}

/* Half of a word. Storing it alone leaves the other half unchanged. */
typedef uint16_t flesh_triangle_half __attribute__((may_alias));

/* Index in memory of a word's upper half. */
enum { FLESH_TRIANGLE_UPPER = __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__ };

/* Sets the entries, row by row, of the block at a place. Reads and writes nothing of other blocks. */
static inline void flesh_triangle_set(flesh_triangle *triangle, int place, const float entries[9])
{
  uint32_t *words = triangle->words + 9 * (size_t)(place / 2);
  flesh_triangle_half *half =
      (flesh_triangle_half *)words + (place % 2 ? !FLESH_TRIANGLE_UPPER : FLESH_TRIANGLE_UPPER);
  for (int e = 0; e < 9; e++) {
    const uint32_t rounded = flesh_triangle_round(entries[e]);
    if (triangle->split) {
      float whole;
      memcpy(&whole, &rounded, sizeof whole);
      words[e] = rounded | flesh_triangle_round(entries[e] - whole) >> 16;
    } else {
      half[2 * e] = (flesh_triangle_half)(rounded >> 16);
    }
  }
}

/* Returns the sum of blocks times y [4*rows] over the pairs begin <= k < end. */
#ifdef __AVX512F__
static inline flesh_float4 flesh_triangle_product(const flesh_triangle *triangle, int begin, int end, const float *y)
{
  const uint32_t *words = triangle->words + 9 * (size_t)begin;
  const int *column = triangle->column + 2 * (size_t)begin, *last = triangle->column + 2 * (size_t)end;
  flesh_float16 first = {0}, second = {0};
  for (; column < last; column += 2, words += 9) {
    const flesh_word16 nine = *(const flesh_word16_loose *)words;
    const flesh_word16 rows = __builtin_shufflevector(nine, nine, 0, 1, 2, 9, 3, 4, 5, 9, 6, 7, 8, 9, 9, 9, 9, 9);
    first += (flesh_float16)(rows & FLESH_TRIANGLE_FIRST) * FLESH_LANES_REPEATED(y + 4 * (size_t)column[0]);
    second += (flesh_float16)(rows << 16) * FLESH_LANES_REPEATED(y + 4 * (size_t)column[1]);
  }
  const flesh_float16 sum = first + second;
  return __builtin_shufflevector(sum, sum, 0, 4, 8, 12) + __builtin_shufflevector(sum, sum, 1, 5, 9, 12) +
         __builtin_shufflevector(sum, sum, 2, 6, 10, 12);
}
#else
static inline flesh_float4 flesh_triangle_product(const flesh_triangle *triangle, int begin, int end, const float *y)
{
  const uint32_t *words = triangle->words + 9 * (size_t)begin;
  const int *column = triangle->column + 2 * (size_t)begin, *last = triangle->column + 2 * (size_t)end;
  flesh_float4 sums[3] = {{0}};
  for (; column < last; column += 2, words += 9) {
    const flesh_float4 y0 = *(const flesh_float4 *)(y + 4 * (size_t)column[0]),
                       y1 = *(const flesh_float4 *)(y + 4 * (size_t)column[1]);
    for (int r = 0; r < 3; r++) {
      const flesh_word4 row = *(const flesh_word4_loose *)(words + 3 * r);
      sums[r] += (flesh_float4)(row & FLESH_TRIANGLE_FIRST) * y0 + (flesh_float4)(row << 16) * y1;
    }
  }
  return FLESH_LANES_SUMS(sums[0], sums[1], sums[2]);
}
#endif

#endif
