/* error.h: sets the text that flesh_error_text() returns. */
#ifndef FLESH_BASE_ERROR_H
#define FLESH_BASE_ERROR_H

#include <stddef.h>

#include "flesh/status.h"

/* Records the sentence (printf format) and returns `status`, so that `return flesh_fail(...)` is
 * the whole error path. */
int flesh_fail(int status, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* FLESH_ERR_MEMORY, "out of memory". */
int flesh_no_memory(void);
/* FLESH_ERR_MEMORY, "PATH: out of memory". */
int flesh_no_memory_for(const char *path);

/* How many sentences this thread has recorded: whoever calls what may fail without one compares it before and after. */
unsigned long flesh_fail_count(void);

/* Puts "prefix" before the current text: callers who know the file or key name it. */
int flesh_fail_within(int status, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* A pointer that a public function must not be given as NULL, by the name that its header gives it. */
typedef struct flesh_needed {
  const void *pointer;
  const char *name;
} flesh_needed;

/* FLESH_ERR_ARGUMENT, with the first that is NULL; a name of NULL ends the list. */
int flesh_check_needed(const char *function, const flesh_needed *needed);

/* Checks the needed arguments of a public function that returns a status: FLESH_NEED({mesh, "mesh"}, {path,
 * "path"}); */
#define FLESH_NEED(...)                                                                                         \
  do {                                                                                                          \
    const int flesh_need_status = flesh_check_needed(__func__, (const flesh_needed[]){__VA_ARGS__, {0, NULL}}); \
    if (flesh_need_status) return flesh_need_status;                                                            \
  } while (0)

#endif
