/* error.h: sets the text that flesh_error_text() returns. */
#ifndef FLESH_BASE_ERROR_H
#define FLESH_BASE_ERROR_H

#include "flesh/status.h"

/* Records the sentence (printf format) and returns `status`, so that `return flesh_fail(...)` is
 * the whole error path. */
int flesh_fail(int status, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Puts "prefix" before the current text: callers who know the file or key name it. */
int flesh_fail_within(int status, const char *format, ...) __attribute__((format(printf, 2, 3)));

#endif
