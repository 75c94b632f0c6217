/* file.c: writes files whole or not at all, and numbers as exact text. */
#include "base/confine.h"
#include "base/file.h"

#include <errno.h>
#include <fcntl.h>
#include <locale.h>
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/error.h"

/* Names of the temporary files that are being written, for flesh_file_drop_all. */
static _Atomic(char *) parts[16];

/* Replaces the name `before` by `now`; either may be NULL for none. If all places are taken, `now` is not recorded. */
static void note(char *before, char *now)
{
  char *seen = before;
  for (size_t k = 0; k < sizeof parts / sizeof *parts && !atomic_compare_exchange_strong(&parts[k], &seen, now); k++)
    seen = before;
}

void flesh_file_drop_all(void)
{
  for (size_t k = 0; k < sizeof parts / sizeof *parts; k++) {
    const char *name = atomic_load(&parts[k]);
    if (name) flesh_path_drop(name);
  }
}

static void forget_temporary(flesh_file *file)
{
  if (file->temporary) note(file->temporary, NULL);
  free(file->temporary);
  file->temporary = NULL;
}

static char *path_with_suffix(const char *path, long pid, unsigned number)
{
  size_t size = strlen(path) + 48;
  char *text = malloc(size);
  if (text) snprintf(text, size, "%s.part-%ld-%u", path, pid, number);
  return text;
}

/* Opens a device or a pipe. A pipe without a reader is refused, as opening it would otherwise wait for one. */
static int open_directly(const char *path)
{
  int descriptor = flesh_path_open(path, O_WRONLY | O_NONBLOCK, 0);
  if (descriptor >= 0) fcntl(descriptor, F_SETFL, fcntl(descriptor, F_GETFL) & ~O_NONBLOCK);
  return descriptor;
}

/* Creates a temporary file beside the target. Its lock tells flesh_folder_clear that the writer is alive; a file system
 * without locks is accepted. A name can be taken, as process numbers recur and other hosts have the same ones. */
static int open_temporary(flesh_file *file, mode_t mode)
{
  static atomic_uint opened; /* gives each thread another name */
  for (;;) {
    free(file->temporary);
    file->temporary = path_with_suffix(file->path, (long)getpid(), atomic_fetch_add(&opened, 1));
    if (!file->temporary) return -1;
    int descriptor = flesh_path_open(file->temporary, O_WRONLY | O_CREAT | O_EXCL, mode);
    if (descriptor < 0 && errno == EEXIST) continue;
    if (descriptor < 0) return -1;
    struct stat info;
    flock(descriptor, LOCK_EX);
    if (!fstat(descriptor, &info) && info.st_nlink) {
      note(NULL, file->temporary);
      return descriptor;
    }
    close(descriptor); /* another process removed it before it was locked */
  }
}

int flesh_file_open(const char *path, flesh_file *file)
{
  *file = (flesh_file){0};
  struct stat info;
  int exists = !flesh_path_stat(path, &info);
  if (exists && S_ISDIR(info.st_mode))
    return flesh_fail(FLESH_ERR_FILE, "%s: cannot be written: it is a directory", path);
  if (flesh_is_confined(path) && flesh_path_check(path)) return FLESH_ERR_FILE;
  if (exists && S_ISREG(info.st_mode) && flesh_path_access(path, W_OK))
    return flesh_fail(FLESH_ERR_FILE, "%s: cannot be written: %s", path, strerror(errno));
  int direct = exists && !S_ISREG(info.st_mode);
  file->path = exists && !direct && !flesh_is_confined(path) ? realpath(path, NULL) : strdup(path);
  if (!file->path)
    return flesh_fail(errno == ENOMEM ? FLESH_ERR_MEMORY : FLESH_ERR_FILE, "%s: cannot be written: %s", path,
                      strerror(errno));
  int descriptor =
      direct ? open_directly(file->path) : open_temporary(file, exists ? info.st_mode & 0777 : 0666);
  if (descriptor >= 0) file->stream = fdopen(descriptor, "w");
  if (!file->stream) {
    int reason = errno;
    if (descriptor >= 0) close(descriptor);
    else forget_temporary(file); /* this file was not made here */
    flesh_file_abandon(file);
    return flesh_fail(reason == ENOMEM ? FLESH_ERR_MEMORY : FLESH_ERR_FILE, "%s: cannot be written: %s%s", path,
                      flesh_path_reason(path, reason), reason == ENXIO ? " (nobody reads this pipe)" : "");
  }
  return FLESH_OK;
}

int flesh_file_commit(flesh_file *file)
{
  if (!file->stream) return flesh_fail(FLESH_ERR_ARGUMENT, "commit of a file that is not open");
  errno = 0;
  int failed = fflush(file->stream) != 0 || ferror(file->stream);
  int reason = errno;
  int lock = dup(fileno(file->stream)); /* the duplicate keeps the lock until the file has its final name */
  if (fclose(file->stream) && !failed) failed = 1, reason = errno;
  file->stream = NULL;
  if (!failed && file->temporary) {
    if (flesh_path_rename(file->temporary, file->path)) failed = 1, reason = errno;
    else forget_temporary(file);
  }
  if (lock >= 0) close(lock);
  if (failed)
    flesh_fail(FLESH_ERR_FILE, "%s: could not be written completely: %s", file->path,
               reason ? strerror(reason) : "the disk may be full");
  flesh_file_abandon(file);
  return failed ? FLESH_ERR_FILE : FLESH_OK;
}

void flesh_file_abandon(flesh_file *file)
{
  if (file->stream) fclose(file->stream);
  if (file->temporary) flesh_path_unlink(file->temporary);
  forget_temporary(file);
  free(file->path);
  *file = (flesh_file){0};
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

void flesh_word_write(FILE *stream, uint32_t word)
{
  const uint8_t bytes[4] = {word & 255, word >> 8 & 255, word >> 16 & 255, word >> 24};
  fwrite(bytes, 1, sizeof bytes, stream);
}

void flesh_single_write(FILE *stream, double value)
{
  const float single = (float)value;
  uint32_t word;
  memcpy(&word, &single, sizeof word);
  flesh_word_write(stream, word);
}
