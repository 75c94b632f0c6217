/* peak.h: loops that do nothing but read, or multiply and add: one source, compiled once per
 * instruction set. */
#ifndef FLESH_BENCH_PEAK_H
#define FLESH_BENCH_PEAK_H

#include <stddef.h>

typedef struct flesh_bench_peak {
  /* Sum of a[0 ... n-1], n a multiple of 64. */
  double (*read)(const double *a, size_t n);
  /* a = b + s c. */
  void (*triad)(double *a, const double *b, const double *c, double s, size_t n);
  /* `repeats` times flesh_bench_peak.operations operations in registers. */
  double (*multiply_add)(long repeats, double x);
  double operations; /* of a round */
} flesh_bench_peak;

extern const flesh_bench_peak flesh_bench_peak_portable, flesh_bench_peak_avx2,
    flesh_bench_peak_avx512;

#endif
