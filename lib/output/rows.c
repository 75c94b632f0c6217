/* rows.c: a file that grows by whole rows. */
#include "output/rows.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio_ext.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/confine.h"
#include "base/error.h"

int flesh_rows_flush(flesh_rows *rows)
{
  errno = 0;
  if (!fflush(rows->stream) && !ferror(rows->stream)) {
    rows->whole = ftell(rows->stream);
    return FLESH_OK;
  }
  int reason = errno;
  __fpurge(rows->stream); /* closing must not write again */
  if (ftruncate(fileno(rows->stream), rows->whole)) errno = 0; /* if this fails, half a row stays */
  return flesh_fail(FLESH_ERR_FILE, "%s: could not be written completely: %s", rows->path,
                    reason ? strerror(reason) : "the disk may be full");
}

int flesh_rows_open(const char *path, flesh_rows *rows)
{
  struct stat info;
  *rows = (flesh_rows){0};
  if (!flesh_path_stat(path, &info) && !S_ISREG(info.st_mode) && !S_ISLNK(info.st_mode))
    return flesh_fail_kind(path, info.st_mode);
  rows->path = strdup(path);
  if (!rows->path) return flesh_no_memory_for(path);
  /* Makes a new file, as the older one may be open in a viewer, and a link must not be written through. */
  flesh_path_unlink(path);
  const int descriptor = flesh_path_open(path, O_WRONLY | O_CREAT | O_EXCL, 0666);
  rows->stream = descriptor < 0 ? NULL : fdopen(descriptor, "w");
  if (rows->stream) return FLESH_OK;
  if (descriptor >= 0) close(descriptor);
  int status = flesh_fail(errno == ENOMEM ? FLESH_ERR_MEMORY : FLESH_ERR_FILE, "%s: cannot be written: %s", path,
                          flesh_path_reason(path, errno));
  flesh_rows_close(rows);
  return status;
}

/* Cuts off data after the whole rows. */
static int go_on(flesh_rows *rows)
{
  const int failed = !rows->stream || fseek(rows->stream, 0, SEEK_END);
  const long size = failed ? 0 : ftell(rows->stream);
  if (!failed && size < rows->whole)
    return flesh_fail(FLESH_ERR_FILE, "%s: has %ld bytes; the run had written %ld at its checkpoint", rows->path, size,
                      rows->whole);
  if (!failed && !ftruncate(fileno(rows->stream), rows->whole) && !fseek(rows->stream, rows->whole, SEEK_SET))
    return FLESH_OK;
  return flesh_fail(FLESH_ERR_FILE, "%s: cannot be continued: %s", rows->path, flesh_path_reason(rows->path, errno));
}

int flesh_rows_resume(const char *path, long whole, flesh_rows *rows)
{
  *rows = (flesh_rows){.path = strdup(path), .whole = whole};
  if (!rows->path) return flesh_no_memory_for(path);
  int status = flesh_path_check(path);
  const int descriptor = status ? -1 : flesh_path_open(path, O_RDWR | O_NONBLOCK, 0);
  rows->stream = descriptor < 0 ? NULL : fdopen(descriptor, "r+");
  if (!status) status = go_on(rows);
  if (!status) return FLESH_OK;
  if (rows->stream) fclose(rows->stream);
  rows->stream = NULL;
  flesh_rows_close(rows);
  return status;
}

int flesh_rows_close(flesh_rows *rows)
{
  int status = FLESH_OK;
  if (rows->stream) {
    status = flesh_rows_flush(rows);
    fclose(rows->stream);
  }
  free(rows->path);
  *rows = (flesh_rows){0};
  return status;
}
