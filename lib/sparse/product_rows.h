/* product_rows.h: a part's rows of y += A x as a function ROWS, in the precision REAL on vectors of four LANES; returns
 * its share of x.A x. product.c includes it once for each precision. FIRST_BLOCK is where the part's numbers, BLOCKs,
 * begin, and TAKE loads the next block's rows and moves on. `far`: A lies beyond the caches; `rounding`: from A's own
 * blocks, which TAKE rounds and stores. */
static inline __attribute__((always_inline)) double ROWS(const multiplication *m, int part, int far, int rounding)
{
  const flesh_product *product = m->product;
  const int *place = product->place;
  REAL *x = m->x, *y = m->y;
  int k = product->first[product->begin[part]];
  BLOCK *block = FIRST_BLOCK(m, part, k);
  const double *exact = rounding ? m->A->values + 9 * (size_t)k : NULL;
  flesh_double4 curvature = {0};
  for (int p = product->begin[part]; p < product->begin[part + 1]; p++) {
    const int end = product->first[p + 1];
    const LANES xi = *(const LANES *)(x + 4 * (size_t)p);
    const REAL x0 = xi[0], x1 = xi[1], x2 = xi[2];
    LANES row[3], sum[3] = {{0}};
    for (int line = 0; line < 2 && !far; line++)
      FLESH_EXPECT_ONCE((const char *)(block + 9 * AHEAD) + LINE * APART * line);
    TAKE(m, &block, &exact, rounding, row);
    /* The diagonal block is symmetric. */
    const LANES diagonal = row[0] * x0 + row[1] * x1 + row[2] * x2;
    for (k++; k < end; k++) {
      if (far) FLESH_EXPECT_ONCE(rounding ? (const void *)(exact + 9 * AHEAD) : (const void *)(block + 9 * AHEAD));
      const LANES xj = *(const LANES *)(x + place[k]);
      LANES *yj = (LANES *)(y + place[k]);
      TAKE(m, &block, &exact, rounding, row);
      for (int r = 0; r < 3; r++) {
        FLESH_LANES_KEEP(row[r]);
        sum[r] += row[r] * xj;
      }
      *yj += row[0] * x0 + row[1] * x1 + row[2] * x2;
    }
    const LANES upper = FLESH_LANES_SUMS(sum[0], sum[1], sum[2]);
    *(LANES *)(y + 4 * (size_t)p) += diagonal + upper;
    curvature += FLESH_LANES_WIDE(xi * (diagonal + upper + upper));
  }
  return (curvature[0] + curvature[1]) + curvature[2];
}
