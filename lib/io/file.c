/* file.c: whole-or-nothing writing and exact number text. */
#include "io/file.h"

#include <errno.h>
#include <fcntl.h>
#include <locale.h>
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/error.h"

static char *path_with_suffix(const char *path, long pid, unsigned number)
{
  size_t size = strlen(path) + 48;
  char *text = malloc(size);
  if (text) snprintf(text, size, "%s.part-%ld-%u", path, pid, number);
  return text;
}

int flesh_file_open(const char *path, flesh_file *file)
{
  static atomic_uint opened; /* so that two threads never share a temporary name */
  *file = (flesh_file){0};
  struct stat info;
  int exists = !stat(path, &info);
  if (exists && S_ISDIR(info.st_mode))
    return flesh_fail(FLESH_ERR_FILE, "%s: cannot be written: it is a directory", path);
  if (exists && S_ISREG(info.st_mode) && access(path, W_OK))
    return flesh_fail(FLESH_ERR_FILE, "%s: cannot be written: %s", path, strerror(errno));
  file->path = exists ? realpath(path, NULL) : strdup(path);
  if (!file->path)
    return flesh_fail(FLESH_ERR_FILE, "%s: cannot be written: %s", path, strerror(errno));
  int descriptor;
  if (exists && !S_ISREG(info.st_mode)) {
    descriptor = open(file->path, O_WRONLY | O_CLOEXEC);
  } else {
    file->temporary = path_with_suffix(file->path, (long)getpid(), atomic_fetch_add(&opened, 1));
    if (!file->temporary) {
      flesh_file_abandon(file);
      return flesh_fail(FLESH_ERR_MEMORY, "%s: out of memory", path);
    }
    mode_t mode = exists ? info.st_mode & 0777 : 0666;
    descriptor = open(file->temporary, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, mode);
  }
  if (descriptor >= 0) file->stream = fdopen(descriptor, "w");
  if (!file->stream) {
    int reason = errno;
    if (descriptor >= 0) close(descriptor);
    flesh_file_abandon(file);
    return flesh_fail(FLESH_ERR_FILE, "%s: cannot be written: %s", path, strerror(reason));
  }
  return FLESH_OK;
}

int flesh_file_commit(flesh_file *file)
{
  if (!file->stream) return flesh_fail(FLESH_ERR_ARGUMENT, "commit of a file that is not open");
  errno = 0;
  int failed = fflush(file->stream) != 0 || ferror(file->stream);
  int reason = errno;
  if (fclose(file->stream) && !failed) failed = 1, reason = errno;
  file->stream = NULL;
  if (!failed && file->temporary) {
    if (rename(file->temporary, file->path)) {
      failed = 1, reason = errno;
    } else {
      free(file->temporary);
      file->temporary = NULL;
    }
  }
  if (failed)
    flesh_fail(FLESH_ERR_FILE, "%s: could not be written completely: %s", file->path,
               reason ? strerror(reason) : "the disk may be full");
  flesh_file_abandon(file);
  return failed ? FLESH_ERR_FILE : FLESH_OK;
}

void flesh_file_abandon(flesh_file *file)
{
  if (file->stream) fclose(file->stream);
  if (file->temporary) unlink(file->temporary);
  free(file->temporary);
  free(file->path);
  *file = (flesh_file){0};
}

int flesh_folder_make(const char *path)
{
  if (!*path) return flesh_fail(FLESH_ERR_FILE, "the name of a directory is empty");
  char *part = strdup(path);
  if (!part) return flesh_fail(FLESH_ERR_MEMORY, "%s: out of memory", path);
  int reason = 0;
  for (char *c = part + 1;; c++) {
    if (*c && *c != '/') continue;
    char separator = *c;
    *c = 0;
    if (mkdir(part, 0777) && errno != EEXIST) reason = errno;
    else reason = 0;
    *c = separator;
    if (reason || !separator) break;
  }
  free(part);
  struct stat info;
  if (!reason && stat(path, &info)) reason = errno;
  if (reason)
    return flesh_fail(FLESH_ERR_FILE, "%s: cannot make this directory: %s", path, strerror(reason));
  if (!S_ISDIR(info.st_mode))
    return flesh_fail(FLESH_ERR_FILE, "%s: is a file; it must be a directory", path);
  if (access(path, W_OK | X_OK))
    return flesh_fail(FLESH_ERR_FILE, "%s: cannot write into this directory: %s", path,
                      strerror(errno));
  return FLESH_OK;
}

const char *flesh_number_text(double value, char text[FLESH_NUMBER_SIZE])
{
  if (isnan(value)) return strcpy(text, "nan");
  if (isinf(value)) return strcpy(text, value > 0 ? "inf" : "-inf");
  for (int digits = 15; digits <= 17; digits++) {
    snprintf(text, FLESH_NUMBER_SIZE, "%.*g", digits, value);
    if (strtod(text, NULL) == value) break;
  }
  const char *point = localeconv()->decimal_point;
  char *found = strcmp(point, ".") ? strstr(text, point) : NULL;
  if (found) {
    size_t length = strlen(point);
    *found = '.';
    memmove(found + 1, found + length, strlen(found + length) + 1);
  }
  return text;
}

void flesh_number_print(FILE *stream, double value)
{
  char text[FLESH_NUMBER_SIZE];
  fputs(flesh_number_text(value, text), stream);
}
