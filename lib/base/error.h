/* error.h: sets the text that flesh_error_text() returns. */
#ifndef FLESH_BASE_ERROR_H
#define FLESH_BASE_ERROR_H

#include <stddef.h>

#include "flesh/status.h"

/* Records the sentence (printf format) and returns `status`, so that `return flesh_fail(...)` is the whole error
 * path. */
int flesh_fail(int status, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* Returns flesh_fail(FLESH_ERR_MEMORY, "out of memory"). */
int flesh_no_memory(void);
/* Returns flesh_fail(FLESH_ERR_MEMORY, "PATH: out of memory"). */
int flesh_no_memory_for(const char *path);

/* Returns how many sentences this thread has recorded. A caller compares the count before and after a call to see
 * whether the call recorded one. */
unsigned long flesh_fail_count(void);

/* Puts a prefix (printf format) before the current sentence and returns `status`: for callers that know the file or
 * key. */
int flesh_fail_within(int status, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* A pointer argument that must not be NULL, and its name in the public header. */
typedef struct flesh_needed {
  const void *pointer;
  const char *name;
} flesh_needed;

/* Fails with FLESH_ERR_ARGUMENT for the first pointer that is NULL; an entry whose name is NULL ends the list. */
int flesh_check_needed(const char *function, const flesh_needed *needed);

/* Checks the arguments of a public function that must not be NULL, and returns from the function if one is:
 * FLESH_NEED({mesh, "mesh"}, {path, "path"}); */
#define FLESH_NEED(...)                                                                                         \
  do {                                                                                                          \
    const int flesh_need_status = flesh_check_needed(__func__, (const flesh_needed[]){__VA_ARGS__, {0, NULL}}); \
    if (flesh_need_status) return flesh_need_status;                                                            \
  } while (0)

#endif
