/* test.h: the tests' harness. A test program is a list of named functions; each prints one TAP line.
 *
 *   static void sums_are_exact(void) { CHECK(1 + 1 == 2); CHECK_NEAR(0.1 + 0.2, 0.3, 1e-15); }
 *   int main(int argc, char **argv) { return RUN_TESTS(argc, argv, TEST(sums_are_exact)); }
 *
 * Arguments select tests by name. A failed check prints where and what, and fails its test only. Tests that create
 * threads are marked TEST_OF_THREADS: under the thread sanitizer only these run, because one thread cannot race. The
 * marks are checked by counting threads (count_threads.c).
 *
 * A sanitizer sees an error the first time its line runs, and takes ten times as long. So under sanitizers TEST_LONG
 * tests, which only repeat lines that other tests run, are skipped, and loops over TEST_FEWER(all, few) end sooner. */
#ifndef FLESH_TEST_H
#define FLESH_TEST_H

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "flesh/instructions.h"
#include "flesh/status.h"

typedef struct test_case {
  const char *name;
  void (*run)(void);
  int threads, is_long; /* creates threads; skipped under sanitizers */
} test_case;

static int test_failures; /* state of the running test */

#define TEST(function)            {#function, function, 0, 0}
#define TEST_OF_THREADS(function) {#function, function, 1, 0}
#define TEST_LONG(function)       {#function, function, 0, 1}
#ifdef TEST_SANITIZED
#define TEST_FEWER(all, few) (few)
#else
#define TEST_FEWER(all, few) (all)
#endif

#ifdef TEST_COUNTS_THREADS
extern _Atomic int test_threads; /* number of threads created so far */
#endif

#define CHECK(condition)                                                                  \
  do {                                                                                    \
    if (!(condition)) {                                                                   \
      test_failures++;                                                                    \
      printf("# %s:%d: failed: %s\n", __FILE__, __LINE__, #condition);                    \
    }                                                                                     \
  } while (0)

/* Checks that a call succeeds; prints the library's message if it does not. */
#define CHECK_OK(call)                                                                    \
  do {                                                                                    \
    int check_status = (call);                                                            \
    if (check_status != FLESH_OK) {                                                       \
      test_failures++;                                                                    \
      printf("# %s:%d: %s gave %s: %s\n", __FILE__, __LINE__, #call,                      \
             flesh_status_name(check_status), flesh_error_text());                        \
    }                                                                                     \
  } while (0)

/* |value - expected| <= tolerance; NaN fails. */
#define CHECK_NEAR(value, expected, tolerance)                                            \
  do {                                                                                    \
    double check_value = (value), check_expected = (expected), check_tol = (tolerance);   \
    if (!(fabs(check_value - check_expected) <= check_tol)) {                             \
      test_failures++;                                                                    \
      printf("# %s:%d: %s is %.17g, expected %.17g within %g (off by %g)\n", __FILE__,    \
             __LINE__, #value, check_value, check_expected, check_tol,                    \
             fabs(check_value - check_expected));                                         \
    }                                                                                     \
  } while (0)

#define CHECK_BELOW(value, limit)                                                         \
  do {                                                                                    \
    double check_value = (value), check_limit = (limit);                                  \
    if (!(check_value <= check_limit)) {                                                  \
      test_failures++;                                                                    \
      printf("# %s:%d: %s is %.6g, limit %.6g\n", __FILE__, __LINE__, #value,             \
             check_value, check_limit);                                                   \
    }                                                                                     \
  } while (0)

#define CHECK_TEXT(text, part)                                                            \
  do {                                                                                    \
    const char *check_text = (text);                                                      \
    if (!strstr(check_text, (part))) {                                                    \
      test_failures++;                                                                    \
      printf("# %s:%d: \"%s\" lacks \"%s\"\n", __FILE__, __LINE__, check_text, (part));   \
    }                                                                                     \
  } while (0)

/* Whether the test program uses instructions that this machine lacks. */
static int test_lacks_set(void)
{
#ifdef FLESH_ISA
#define TEST_TEXT(token)       #token
#define TEST_TEXT_VALUE(token) TEST_TEXT(token)
  flesh_instructions set = FLESH_INSTRUCTIONS_PORTABLE;
  while (strcmp(flesh_instructions_name(set), TEST_TEXT_VALUE(FLESH_ISA))) set++;
  return flesh_instructions_find(set, &set) != FLESH_OK;
#else
  return 0;
#endif
}

static inline int test_is_wanted(int argc, char **argv, const test_case *c)
{
  int wanted = argc < 2;
  for (int a = 1; a < argc; a++) wanted |= !strcmp(argv[a], c->name);
#ifdef TEST_SANITIZED
  wanted &= !c->is_long;
#endif
#ifdef TEST_ONLY_OF_THREADS
  wanted &= c->threads;
#endif
  return wanted;
}

static inline void test_run_one(const test_case *c)
{
  test_failures = 0;
#ifdef TEST_COUNTS_THREADS
  const int before = test_threads;
  c->run();
  if ((test_threads > before) == c->threads) return;
  test_failures++;
  printf("# it makes %s: it should be a TEST%s\n", c->threads ? "no threads" : "threads", c->threads ? "" : "_OF_THREADS");
#else
  c->run();
#endif
}

static inline int test_run_all(int argc, char **argv, const test_case *cases, int count)
{
  if (test_lacks_set()) {
    puts("1..0 # SKIP this machine lacks the instructions");
    return 0;
  }
  int failed = 0, number = 0, planned = 0;
  for (int c = 0; c < count; c++) planned += test_is_wanted(argc, argv, &cases[c]);
  printf("1..%d%s\n", planned, planned ? "" : " # SKIP no test of threads");
  for (int c = 0; c < count; c++) {
    if (!test_is_wanted(argc, argv, &cases[c])) continue;
    test_run_one(&cases[c]);
    printf("%s %d - %s\n", test_failures ? "not ok" : "ok", ++number, cases[c].name);
    fflush(stdout);
    failed += test_failures != 0;
  }
  return failed != 0;
}

#define RUN_TESTS(argc, argv, ...)                                                        \
  test_run_all(argc, argv, (const test_case[]){__VA_ARGS__},                              \
               (int)(sizeof((const test_case[]){__VA_ARGS__}) / sizeof(test_case)))

/* Returns the next of a deterministic sequence of random numbers, uniform in [0, 1). */
static inline double test_uniform(unsigned long long *state)
{
  unsigned long long z = (*state += 0x9e3779b97f4a7c15ULL);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

#endif
