/* error.c: status names and the thread's last error text. */
#include "base/error.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { TEXT_SIZE = 1024 };
static _Thread_local char error_text[TEXT_SIZE];

const char *flesh_status_name(int status)
{
  switch (status) {
#define CASE(name, value, text) \
  case value: return #name;
    FLESH_STATUS_LIST(CASE)
#undef CASE
  }
  return "unknown status";
}

const char *flesh_status_text(int status)
{
  switch (status) {
#define CASE(name, value, text) \
  case value: return text;
    FLESH_STATUS_LIST(CASE)
#undef CASE
  }
  return "unknown status";
}

const char *flesh_error_text(void) { return error_text; }

int flesh_fail(int status, const char *format, ...)
{
  va_list args;
  va_start(args, format);
  vsnprintf(error_text, sizeof error_text, format, args);
  va_end(args);
  return status;
}

int flesh_fail_within(int status, const char *format, ...)
{
  char before[TEXT_SIZE], whole[2 * TEXT_SIZE];
  va_list args;
  va_start(args, format);
  vsnprintf(before, sizeof before, format, args);
  va_end(args);
  snprintf(whole, sizeof whole, "%s%s", before, error_text);
  whole[TEXT_SIZE - 1] = 0;
  memcpy(error_text, whole, TEXT_SIZE);
  return status;
}
