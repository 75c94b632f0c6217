/* peak.c: loops that reach the machine's ceilings, FLESH_LANES numbers at a time. */
#include "bench/peak.h"

#include "math/lanes.h"

/* Numbers of sums that are independent: enough that no operation waits for the one before it. */
enum { CHAINS = 12, STREAMS = 8 };

static double read_all(const double *a, size_t n)
{
  flesh_real sum[STREAMS];
  for (int k = 0; k < STREAMS; k++) sum[k] = flesh_all(0);
  for (size_t i = 0; i < n; i += STREAMS * FLESH_LANES)
    for (int k = 0; k < STREAMS; k++) sum[k] += *(const flesh_real_at *)(a + i + k * FLESH_LANES);
  double total = 0;
  for (int k = 0; k < STREAMS; k++)
    for (int l = 0; l < FLESH_LANES; l++) total += flesh_lane(sum[k], l);
  return total;
}

static void triad(double *a, const double *b, const double *c, double s, size_t n)
{
  for (size_t i = 0; i < n; i += FLESH_LANES)
    *(flesh_real_at *)(a + i) =
        *(const flesh_real_at *)(b + i) + s * *(const flesh_real_at *)(c + i);
}

static double multiply_add(long repeats, double x)
{
  flesh_real sum[CHAINS], factor = flesh_all(x), total = flesh_all(0);
  for (int k = 0; k < CHAINS; k++) sum[k] = flesh_all(k);
  for (long r = 0; r < repeats; r++)
    for (int k = 0; k < CHAINS; k++) sum[k] = sum[k] * factor + factor;
  for (int k = 0; k < CHAINS; k++) total += sum[k];
  double all = 0;
  for (int l = 0; l < FLESH_LANES; l++) all += flesh_lane(total, l);
  return all;
}

const flesh_bench_peak FLESH_BENCH_PEAK = {
    .read = read_all,
    .triad = triad,
    .multiply_add = multiply_add,
    .operations = 2.0 * CHAINS * FLESH_LANES,
};
