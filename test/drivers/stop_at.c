/* stop_at.c: when preloaded into a program, sends it a signal (FLESH_STOP_SIGNAL, else SIGKILL) just before the
 * FLESH_STOP_AT-th call, counted from 1, of those that create, rename, truncate, remove or sync files, or just after a
 * file gets the name FLESH_STOP_AFTER in its folder. FLESH_STOP_LOG names a file that gets a line for each call:
 * `rename FROM TO`, `fsync PATH`, `truncate PATH`, `unlink PATH`, `write PATH` (opened for writing). */
#define _GNU_SOURCE
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>

static void stop(void)
{
  const char *number = getenv("FLESH_STOP_SIGNAL");
  kill(getpid(), number ? atoi(number) : SIGKILL);
}

static void note(const char *what, const char *path, const char *to)
{
  static int count;
  const char *at = getenv("FLESH_STOP_AT"), *log = getenv("FLESH_STOP_LOG");
  if (at && ++count == atoi(at)) stop();
  if (!log) return;
  char line[2048];
  const int length = snprintf(line, sizeof line, "%s %s%s%s\n", what, path, to ? " " : "", to ? to : "");
  const int file = (int)syscall(SYS_openat, AT_FDCWD, log, O_WRONLY | O_CREAT | O_APPEND, 0666);
  const ssize_t written = write(file, line, (size_t)length);
  (void)written;
  close(file);
}

static void note_descriptor(const char *what, int descriptor)
{
  char link[64], path[1024] = "";
  snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
  const ssize_t length = readlink(link, path, sizeof path - 1);
  path[length > 0 ? length : 0] = 0;
  note(what, path, NULL);
}

int fsync(int descriptor)
{
  note_descriptor("fsync", descriptor);
  return (int)syscall(SYS_fsync, descriptor);
}

int ftruncate(int descriptor, off_t length)
{
  note_descriptor("truncate", descriptor);
  return (int)syscall(SYS_ftruncate, descriptor, length);
}

/* Returns the path of a name in an open folder. */
static const char *place(int folder, const char *name, char path[1024])
{
  char link[64];
  if (folder == AT_FDCWD || *name == '/') return name;
  snprintf(link, sizeof link, "/proc/self/fd/%d", folder);
  const ssize_t got = readlink(link, path, 1023);
  const size_t length = got > 0 ? (size_t)got : 0;
  snprintf(path + length, 1024 - length, "/%s", name);
  return path;
}

int renameat(int from_folder, const char *from, int to_folder, const char *to)
{
  char paths[2][1024];
  note("rename", place(from_folder, from, paths[0]), place(to_folder, to, paths[1]));
  const int result = (int)syscall(SYS_renameat2, from_folder, from, to_folder, to, 0);
  const char *after = getenv("FLESH_STOP_AFTER"), *slash = strrchr(to, '/');
  if (after && !strcmp(slash ? slash + 1 : to, after)) stop();
  return result;
}

int unlinkat(int folder, const char *name, int flags)
{
  char path[1024];
  note("unlink", place(folder, name, path), NULL);
  return (int)syscall(SYS_unlinkat, folder, name, flags);
}

int openat(int folder, const char *name, int flags, ...)
{
  char path[1024];
  va_list rest;
  va_start(rest, flags);
  const int mode = flags & O_CREAT ? va_arg(rest, int) : 0;
  va_end(rest);
  if (flags & (O_WRONLY | O_RDWR)) note("write", place(folder, name, path), NULL);
  return (int)syscall(SYS_openat, folder, name, flags, mode);
}
