/* clock.h: clocks in seconds. */
#ifndef FLESH_BASE_CLOCK_H
#define FLESH_BASE_CLOCK_H

#include <time.h>

static inline double flesh_clock(clockid_t clock)
{
  struct timespec now;
  clock_gettime(clock, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Wall time since an arbitrary origin, and CPU time of this process summed over all processors, in s. */
static inline double flesh_wall_seconds(void) { return flesh_clock(CLOCK_MONOTONIC); }
static inline double flesh_cpu_seconds(void) { return flesh_clock(CLOCK_PROCESS_CPUTIME_ID); }

#endif
