/* folder.c: makes, claims and clears folders of results. */
#include "base/confine.h"
#include "base/folder.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "base/error.h"

static const char lock_name[] = ".flesh.lock";

int flesh_folder_make(const char *path)
{
  if (!*path) return flesh_fail(FLESH_ERR_FILE, "the name of a directory is empty");
  char *part = strdup(path);
  if (!part) return flesh_no_memory_for(path);
  int reason = 0;
  for (char *c = part + 1;; c++) {
    if (*c && *c != '/') continue;
    char separator = *c;
    *c = 0;
    if (flesh_path_make_folder(part) && errno != EEXIST) reason = errno;
    else reason = 0;
    *c = separator;
    if (reason || !separator) break;
  }
  free(part);
  struct stat info;
  if (!reason && flesh_path_stat(path, &info)) reason = errno;
  if (reason)
    return flesh_fail(FLESH_ERR_FILE, "%s: cannot make this directory: %s", path, flesh_path_reason(path, reason));
  if (S_ISLNK(info.st_mode))
    return flesh_fail(FLESH_ERR_FILE, "%s: cannot be used: %s", path, flesh_path_reason(path, ELOOP));
  if (!S_ISDIR(info.st_mode))
    return flesh_fail(FLESH_ERR_FILE, "%s: is a file; it must be a directory", path);
  if (flesh_path_access(path, W_OK | X_OK))
    return flesh_fail(FLESH_ERR_FILE, "%s: cannot write into this directory: %s", path,
                      strerror(errno));
  return FLESH_OK;
}

/* Fails with a sentence that names the holder of the lock, as written in the lock file. */
static int refuse(const char *folder, int descriptor)
{
  char who[256];
  ssize_t got = pread(descriptor, who, sizeof who - 1, 0);
  who[got > 0 ? got : 0] = 0;
  for (char *c = who; *c; c++)
    if ((unsigned char)*c < ' ' || *c == 0x7f) *c = ' ';
  return flesh_fail(FLESH_ERR_FILE,
                    "%s: another process writes its results there%s%s%s; wait for its end or give another folder",
                    folder, *who ? " (" : "", who, *who ? ")" : "");
}

/* Returns whether the path still names the open file: the last holder of the lock may have removed it meanwhile. */
static int is_named(const char *path, int descriptor)
{
  struct stat named, held;
  return !flesh_path_stat(path, &named) && !fstat(descriptor, &held) && named.st_dev == held.st_dev &&
         named.st_ino == held.st_ino;
}

static int take_lock(const char *folder, const char *who, double patience, flesh_folder_claim *claim)
{
  const double pause = 0.01;
  for (double waited = 0;;) {
    /* The flags follow no link and do not wait for a pipe. */
    int descriptor = flesh_path_open(claim->path, O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK, 0666);
    if (descriptor < 0 && errno == ENOENT && !flesh_folder_make(folder)) continue; /* the last holder removed it */
    if (descriptor < 0)
      return flesh_fail(FLESH_ERR_FILE, "%s: cannot be written: %s", claim->path, flesh_path_reason(claim->path, errno));
    if (flock(descriptor, LOCK_EX | LOCK_NB) && errno == EWOULDBLOCK) {
      int status = waited < patience ? FLESH_OK : refuse(folder, descriptor);
      close(descriptor);
      if (status) return status;
      nanosleep(&(struct timespec){.tv_nsec = (long)(1e9 * pause)}, NULL); /* a signal only shortens the pause */
      waited += pause;
      continue;
    }
    if (!is_named(claim->path, descriptor)) {
      close(descriptor);
      continue;
    }
    /* `who` only informs others; the lock holds even if it cannot be written. */
    if (ftruncate(descriptor, 0) || pwrite(descriptor, who, strlen(who), 0) < 0) errno = 0;
    claim->descriptor = descriptor;
    return FLESH_OK;
  }
}

int flesh_folder_claim_take(const char *path, const char *who, double patience, flesh_folder_claim *claim)
{
  *claim = (flesh_folder_claim){.descriptor = -1, .made = flesh_path_access(path, F_OK) != 0};
  int status = flesh_folder_make(path);
  if (!status) status = flesh_confine(path);
  if (status) return status;
  size_t length = strlen(path) + sizeof lock_name + 1;
  claim->path = malloc(length);
  if (!claim->path) return flesh_no_memory_for(path);
  strcpy(stpcpy(stpcpy(claim->path, path), "/"), lock_name);
  status = take_lock(path, who, patience, claim);
  if (status) {
    free(claim->path);
    claim->path = NULL;
    return status;
  }
  flesh_folder_clear(path);
  return FLESH_OK;
}

void flesh_folder_claim_release(flesh_folder_claim *claim)
{
  if (!claim->path) return;
  flesh_path_unlink(claim->path);
  claim->path[strlen(claim->path) - strlen(lock_name) - 1] = 0;
  if (claim->made) flesh_path_remove_folder(claim->path);
  close(claim->descriptor);
  free(claim->path);
  *claim = (flesh_folder_claim){.descriptor = -1};
}

/* Returns the end of NAME in NAME.part-<process>-<number> or NAME.part-<process><suffix>; NULL for other names.
 * *locked: the name is of the first kind, whose writer holds a lock. */
static const char *part_mark(const char *name, long *process, int *locked)
{
  const char *mark = NULL;
  for (const char *at = name; (at = strstr(at, ".part-")); at++) mark = at;
  if (!mark || mark == name) return NULL;
  size_t digits = strspn(mark + 6, "0123456789");
  const char *rest = mark + 6 + digits;
  if (!digits || digits > 9) return NULL;
  *process = strtol(mark + 6, NULL, 10);
  *locked = *rest == '-';
  if (!*locked) return *rest == '.' ? mark : NULL;
  size_t number = strspn(rest + 1, "0123456789");
  return number && !rest[1 + number] ? mark : NULL;
}

static void remove_stale(int folder, const char *name)
{
  struct stat info;
  int descriptor = openat(folder, name, O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) return;
  if (!fstat(descriptor, &info) && S_ISREG(info.st_mode) && !flock(descriptor, LOCK_EX | LOCK_NB))
    unlinkat(folder, name, 0);
  close(descriptor);
}

/* Removes stale temporary files in a folder: those of the target named `base`, or all if it is NULL. */
static void clear(const char *path, const char *base)
{
  DIR *list = flesh_path_list(path);
  if (!list) return;
  for (struct dirent *entry; (entry = readdir(list));) {
    long process;
    int locked;
    const char *mark = part_mark(entry->d_name, &process, &locked);
    if (!mark || (!locked && (!kill((pid_t)process, 0) || errno != ESRCH))) continue;
    size_t length = (size_t)(mark - entry->d_name);
    if (!base || (strlen(base) == length && !strncmp(base, entry->d_name, length)))
      remove_stale(dirfd(list), entry->d_name);
  }
  closedir(list);
}

void flesh_folder_clear(const char *path) { clear(path, NULL); }

void flesh_file_clear(const char *target)
{
  char *whole = realpath(target, NULL), *folder = whole ? whole : strdup(target);
  if (!folder) return;
  char *slash = strrchr(folder, '/');
  if (slash) *slash = 0;
  clear(!slash ? "." : slash == folder ? "/" : folder, slash ? slash + 1 : folder);
  free(folder);
}
