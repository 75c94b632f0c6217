/* path.c: paths in rooms that are used again. */
#include "cli/path.h"

#include <limits.h>
#include <stdarg.h>
#include <stdio.h>

const char *flesh_path(const char *format, ...)
{
  static _Thread_local char rooms[FLESH_PATHS][PATH_MAX + 1];
  static _Thread_local int next;
  char *room = rooms[next++ % FLESH_PATHS];
  va_list values;
  va_start(values, format);
  vsnprintf(room, sizeof *rooms, format, values);
  va_end(values);
  return room;
}
