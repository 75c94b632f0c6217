/* slow_clock.c: when preloaded into a program, advances its monotonic clock by FLESH_CLOCK_TICK seconds at each
 * reading, so that actions after minutes happen at once and reproducibly. */
#define _GNU_SOURCE
#include <stdlib.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

int clock_gettime(clockid_t clock, struct timespec *now)
{
  static long readings;
  const char *tick = getenv("FLESH_CLOCK_TICK");
  if (clock != CLOCK_MONOTONIC || !tick) return (int)syscall(SYS_clock_gettime, clock, now);
  const double t = 1000 + atof(tick) * (double)__atomic_add_fetch(&readings, 1, __ATOMIC_RELAXED);
  now->tv_sec = (time_t)t;
  now->tv_nsec = (long)(1e9 * (t - (double)now->tv_sec));
  return 0;
}
