/* peak.h: loops that only read, or only multiply and add: one source, compiled once per instruction set. */
#ifndef FLESH_BENCH_PEAK_H
#define FLESH_BENCH_PEAK_H

#include <stddef.h>

typedef struct flesh_bench_peak {
  /* Returns the sum of a[0 ... n-1]; n is a multiple of 64. */
  double (*read)(const double *a, size_t n);
  /* Sets a = b + s c. */
  void (*triad)(double *a, const double *b, const double *c, double s, size_t n);
  /* Does `repeats` rounds of flesh_bench_peak.operations operations in registers. */
  double (*multiply_add)(long repeats, double x);
  double operations; /* per round */
} flesh_bench_peak;

extern const flesh_bench_peak flesh_bench_peak_portable, flesh_bench_peak_avx2,
    flesh_bench_peak_avx512;

#endif
