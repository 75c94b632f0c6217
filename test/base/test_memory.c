// TEST quick
/* test_memory.c: reserves hand out their memory, take it back, and are used by one thread; sorting is stable. */
#include <stdint.h>
#include <stdlib.h>

#include "base/memory.h"
#include "base/sort.h"
#include "test.h"

static void reserves_are_used_from_the_beginning(void)
{
  flesh_reserve *reserve = flesh_reserve_create(4096);
  CHECK(reserve && flesh_reserve_most(reserve) == 0);
  CHECK(!flesh_reserve_entered() && flesh_reserve_enter(reserve) == NULL && flesh_reserve_entered());
  char *a = flesh_malloc(100), *b = flesh_calloc(10, 10), *c = flesh_aligned_alloc(64, 1);
  CHECK(a && b && c && (uintptr_t)a % 64 == 0 && (uintptr_t)b % 64 == 0 && (uintptr_t)c % 64 == 0);
  CHECK(b >= a + 100 && c >= b + 100);
  memset(a, 1, 100);
  for (int k = 0; k < 100; k++) CHECK(b[k] == 0);
  /* Freed memory is reused once everything allocated after it is freed too. */
  flesh_free(b);
  char *d = flesh_malloc(1);
  CHECK(d > c);
  flesh_free(c);
  flesh_free(d);
  char *again = flesh_calloc(10, 10);
  CHECK(again == b);
  flesh_free(again);
  CHECK(flesh_malloc(4000) == NULL); /* not beside a */
  flesh_free(a);
  char *most = flesh_malloc(4000);
  CHECK(most == a && flesh_reserve_most(reserve) == 4096 && flesh_malloc(1) == NULL);
  CHECK(flesh_calloc((size_t)-1, 2) == NULL && flesh_malloc((size_t)-1) == NULL && flesh_malloc((size_t)-65) == NULL);
  CHECK(flesh_aligned_alloc(4096, 1) == NULL);
  flesh_reserve_empty(reserve);
  CHECK(flesh_malloc(1) == (void *)a);
  CHECK(flesh_reserve_enter(NULL) == reserve && !flesh_reserve_entered());
  flesh_reserve_destroy(&reserve);
  CHECK(reserve == NULL);
  flesh_reserve_destroy(&reserve);
  CHECK(flesh_reserve_create((size_t)1 << 62) == NULL);
}

/* Grown in place or elsewhere, the contents stay. */
static void pieces_change_their_size(void)
{
  flesh_reserve *reserve = flesh_reserve_create(1 << 16);
  flesh_reserve_enter(reserve);
  unsigned char *a = flesh_realloc(NULL, 1000), *b;
  for (int k = 0; k < 1000; k++) a[k] = (unsigned char)k;
  b = flesh_realloc(a, 500);
  CHECK(b == a);
  unsigned char *next = flesh_malloc(1);
  CHECK(next < a + 1000); /* the memory that a gave back */
  b = flesh_realloc(a, 5000);
  CHECK(b > next);
  int same = 1;
  for (int k = 0; k < 500; k++) same &= b[k] == (unsigned char)k;
  CHECK(same && flesh_realloc(b, 1 << 16) == NULL && b[499] == (unsigned char)499);
  flesh_reserve_enter(NULL);
  flesh_reserve_destroy(&reserve);
}

/* Memory allocated by the system is freed by the system. */
static void what_is_not_of_the_reserve_is_left_alone(void)
{
  flesh_reserve *reserve = flesh_reserve_create(1024);
  char *outside = flesh_malloc(10);
  strcpy(outside, "outside");
  flesh_reserve_enter(reserve);
  outside = flesh_realloc(outside, 10000); /* more than the reserve has */
  CHECK(outside && !strcmp(outside, "outside") && flesh_reserve_most(reserve) == 0);
  flesh_free(outside);
  flesh_free(NULL);
  flesh_reserve_enter(NULL);
  char *after = flesh_malloc(10000);
  CHECK(after != NULL);
  flesh_free(after);
  flesh_reserve_destroy(&reserve);
}

typedef struct pair {
  int key, number;
  char rest[92];
} pair;

static int by_key(const void *a, const void *b) { return ((const pair *)a)->key - ((const pair *)b)->key; }
static int by_int(const void *a, const void *b) { return *(const int *)a - *(const int *)b; }

static void sorting_is_stable(void)
{
  enum { MOST = 3000 };
  static pair pairs[MOST];
  static int ints[MOST], wanted[MOST];
  unsigned random = 1;
  for (int kind = 0; kind < 2; kind++) /* with and without enough scratch memory */
    for (int count = 0; count <= MOST; count = count < 40 ? count + 1 : 2 * count + 17) {
      for (int k = 0; k < count; k++) {
        random = random * 1664525 + 1013904223;
        pairs[k] = (pair){.key = (int)(random >> 24) % (1 + count / 4), .number = k};
        ints[k] = wanted[k] = (int)(random >> 8);
      }
      flesh_reserve *reserve = kind ? flesh_reserve_create(0) : NULL;
      flesh_reserve *before = flesh_reserve_enter(reserve);
      flesh_sort(pairs, (size_t)count, sizeof *pairs, by_key);
      flesh_sort(ints, (size_t)count, sizeof *ints, by_int);
      flesh_reserve_enter(before);
      flesh_reserve_destroy(&reserve);
      qsort(wanted, (size_t)count, sizeof *wanted, by_int);
      int sorted = !memcmp(ints, wanted, (size_t)count * sizeof *ints);
      for (int k = 1; k < count; k++)
        sorted &= pairs[k - 1].key < pairs[k].key ||
                  (pairs[k - 1].key == pairs[k].key && pairs[k - 1].number < pairs[k].number);
      CHECK(sorted);
    }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(reserves_are_used_from_the_beginning), TEST(pieces_change_their_size),
                   TEST(what_is_not_of_the_reserve_is_left_alone), TEST(sorting_is_stable));
}
