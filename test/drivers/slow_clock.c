/* slow_clock.c: preloaded into a program, makes each reading of its monotonic clock FLESH_CLOCK_TICK seconds later than
 * the one before, so that what it does after minutes is seen at once, and always alike. */
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
