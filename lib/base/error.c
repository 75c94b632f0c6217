/* error.c: status names and the thread's last error text. */
#include "base/error.h"

#include <pthread.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>

#include "base/letter.h"

enum { TEXT_SIZE = 1024 };
static _Thread_local char error_text[TEXT_SIZE];
static _Thread_local unsigned long fail_count;
static _Thread_local int in_handler; /* 1 while this thread runs a handler */

static pthread_mutex_t handler_lock = PTHREAD_MUTEX_INITIALIZER;
static flesh_error_handler handler_now;
static void *handler_data;
static atomic_int has_handler; /* without a handler nobody takes the lock */

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

/* Replaces unprintable letters by '?'. Sentences quote names from files and command lines, which must not move a
 * terminal's cursor, begin a new line in a log or make a result invalid UTF-8. */
static void make_printable(char *text)
{
  size_t size = strlen(text), to = 0, bytes;
  for (size_t at = 0; at < size; at += bytes) {
    unsigned code = 0;
    bytes = flesh_letter_at((unsigned char *)text + at, size - at, &code);
    int control = code < 32 || (code >= 127 && code < 160) || code == 0x2028 || code == 0x2029;
    if (!bytes || control) {
      text[to++] = '?';
      bytes += !bytes;
    } else {
      memmove(text + to, text + at, bytes);
      to += bytes;
    }
  }
  text[to] = 0;
}

void flesh_set_error_handler(flesh_error_handler handler, void *data)
{
  pthread_mutex_lock(&handler_lock);
  handler_now = handler;
  handler_data = data;
  atomic_store(&has_handler, handler != NULL);
  pthread_mutex_unlock(&handler_lock);
}

/* Calls the handler without holding the lock. The handler gets a copy of the text, as the handler itself may fail. */
static int call_handler(int status)
{
  char text[TEXT_SIZE];
  if (!atomic_load_explicit(&has_handler, memory_order_relaxed) || in_handler) return status;
  pthread_mutex_lock(&handler_lock);
  const flesh_error_handler handler = handler_now;
  void *data = handler_data;
  pthread_mutex_unlock(&handler_lock);
  if (!handler) return status;
  memcpy(text, error_text, TEXT_SIZE);
  in_handler = 1;
  handler(data, status, text);
  in_handler = 0;
  memcpy(error_text, text, TEXT_SIZE);
  return status;
}

int flesh_fail(int status, const char *format, ...)
{
  va_list args;
  va_start(args, format);
  vsnprintf(error_text, sizeof error_text, format, args);
  va_end(args);
  make_printable(error_text);
  fail_count++;
  return call_handler(status);
}

int flesh_no_memory(void) { return flesh_fail(FLESH_ERR_MEMORY, "out of memory"); }
int flesh_no_memory_for(const char *path) { return flesh_fail(FLESH_ERR_MEMORY, "%s: out of memory", path); }

unsigned long flesh_fail_count(void) { return fail_count; }

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
  make_printable(error_text);
  return call_handler(status);
}

int flesh_check_needed(const char *function, const flesh_needed *needed)
{
  for (; needed->name; needed++)
    if (!needed->pointer) return flesh_fail(FLESH_ERR_ARGUMENT, "%s: %s is NULL", function, needed->name);
  return FLESH_OK;
}
