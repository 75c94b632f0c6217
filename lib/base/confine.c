/* confine.c: resolves paths folder by folder without following links. */
#define _GNU_SOURCE /* O_PATH */
#include "base/confine.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/error.h"

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static char **roots; /* confined folders, without trailing slashes */
static int root_count;

/* Returns the rest of the path after a confined folder (empty, or beginning with a slash); NULL: the path begins with
 * no such folder. */
static const char *behind_root(const char *path)
{
  const char *inner = NULL;
  pthread_mutex_lock(&lock);
  for (int k = 0; k < root_count && !inner; k++) {
    const size_t length = strlen(roots[k]);
    if (!strncmp(path, roots[k], length) && (path[length] == '/' || !path[length])) inner = path + length;
  }
  pthread_mutex_unlock(&lock);
  return inner;
}

/* Returns the part of the path inside a confined folder, with a slash before it; NULL for other paths and for the
 * folder itself. */
static const char *inner_part(const char *path)
{
  const char *inner = behind_root(path);
  return inner && inner[strspn(inner, "/")] ? inner : NULL;
}

int flesh_is_confined(const char *path) { return inner_part(path) != NULL; }

int flesh_confine(const char *folder)
{
  size_t length = strlen(folder);
  while (length > 0 && folder[length - 1] == '/') length--;
  if (!length || behind_root(folder)) return FLESH_OK;
  pthread_mutex_lock(&lock);
  char *root = strndup(folder, length), **longer = realloc(roots, ((size_t)root_count + 1) * sizeof *roots);
  if (longer) roots = longer;
  if (longer && root) roots[root_count++] = root;
  else free(root);
  pthread_mutex_unlock(&lock);
  return longer && root ? FLESH_OK : flesh_no_memory_for(folder);
}

/* A path in the form that the system's *at functions take. It allocates nothing, so that files can be removed when
 * memory has run out. */
typedef struct place {
  int folder, confined;
  char copy[PATH_MAX];
  const char *name; /* in the folder */
} place;

static void leave(place *p)
{
  const int reason = errno;
  if (p->folder >= 0) close(p->folder);
  errno = reason;
}

/* Returns whether the name is a symbolic link; opening a link or a file as a folder fails with the same ENOTDIR. */
static int is_link(int folder, const char *name)
{
  struct stat info;
  return !fstatat(folder, name, &info, AT_SYMLINK_NOFOLLOW) && S_ISLNK(info.st_mode);
}

/* Replaces p->folder by its subfolder `name`. Returns 0, or -1 with errno. */
static int descend(place *p, const char *name)
{
  const int next = openat(p->folder, name, O_PATH | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (next < 0 && errno == ENOTDIR) errno = is_link(p->folder, name) ? ELOOP : ENOTDIR;
  if (next < 0) return -1;
  close(p->folder);
  p->folder = next;
  return 0;
}

/* Resolves the path. Returns 0, or -1 with errno; the caller calls leave() in both cases. */
static int find(const char *path, place *p)
{
  const char *inner = inner_part(path);
  p->folder = -1, p->confined = inner != NULL, p->name = path;
  if (!inner) {
    p->folder = AT_FDCWD; /* a negative number, so leave() does not close it */
    return 0;
  }
  if (strlen(path) >= sizeof p->copy) {
    errno = ENAMETOOLONG;
    return -1;
  }
  strcpy(p->copy, path);
  char *next = p->copy + (inner - path), *rest;
  *next = 0;
  p->folder = open(p->copy, O_PATH | O_DIRECTORY | O_CLOEXEC);
  if (p->folder < 0) return -1;
  for (char *name = strtok_r(next + 1, "/", &rest), *after; name; name = after) {
    after = strtok_r(NULL, "/", &rest);
    if (!strcmp(name, "..")) {
      errno = EXDEV;
      return -1;
    }
    if (!after) p->name = name;
    else if (descend(p, name)) return -1;
  }
  return 0;
}

int flesh_path_open(const char *path, int flags, mode_t mode)
{
  place p;
  int descriptor = -1;
  if (!find(path, &p)) {
    descriptor = openat(p.folder, p.name, flags | O_CLOEXEC | (p.confined ? O_NOFOLLOW : 0), mode);
    if (descriptor < 0 && errno == ENOTDIR && p.confined && is_link(p.folder, p.name)) errno = ELOOP;
  }
  leave(&p);
  return descriptor;
}

/* Body of a function of one path: resolves the path into `p`, makes the call and returns its status. */
#define AT_PLACE(path, call)                \
  place p;                                  \
  const int status = find(path, &p) || call ? -1 : 0; \
  leave(&p);                                \
  return status

int flesh_path_stat(const char *path, struct stat *info)
{
  AT_PLACE(path, fstatat(p.folder, p.name, info, p.confined ? AT_SYMLINK_NOFOLLOW : 0));
}

/* Like faccessat, but refuses a link in a confined folder, as links there are not followed. */
static int access_at(const place *p, int mode)
{
  if (!p->confined || !is_link(p->folder, p->name)) return faccessat(p->folder, p->name, mode, 0);
  errno = ELOOP;
  return -1;
}

int flesh_path_access(const char *path, int mode) { AT_PLACE(path, access_at(&p, mode)); }

int flesh_path_make_folder(const char *path) { AT_PLACE(path, mkdirat(p.folder, p.name, 0777)); }

int flesh_path_unlink(const char *path) { AT_PLACE(path, unlinkat(p.folder, p.name, 0)); }

int flesh_path_drop(const char *path) { return unlink(path); }

int flesh_path_remove_folder(const char *path) { AT_PLACE(path, unlinkat(p.folder, p.name, AT_REMOVEDIR)); }

int flesh_path_rename(const char *from, const char *to)
{
  place a, b;
  const int found = !find(from, &a), status = find(to, &b) || !found || renameat(a.folder, a.name, b.folder, b.name);
  leave(&a);
  leave(&b);
  return status ? -1 : 0;
}

DIR *flesh_path_list(const char *path)
{
  const int descriptor = flesh_path_open(path, O_RDONLY | O_DIRECTORY | O_NONBLOCK, 0);
  DIR *list = descriptor < 0 ? NULL : fdopendir(descriptor);
  if (!list && descriptor >= 0) close(descriptor);
  return list;
}

const char *flesh_path_reason(const char *path, int reason)
{
  if (flesh_is_confined(path) && reason == ELOOP)
    return "it is a symbolic link, or lies behind one; a folder of results must have the files themselves, as links out of "
           "it are not followed";
  if (flesh_is_confined(path) && reason == EXDEV)
    return "it leads out of the folder of results by '..'; all files of a result must lie in its folder";
  return strerror(reason);
}

int flesh_fail_kind(const char *path, mode_t mode)
{
  return flesh_fail(FLESH_ERR_FILE, "%s: not a regular file%s", path,
                    S_ISDIR(mode)    ? " but a directory"
                    : S_ISFIFO(mode) ? " but a pipe"
                                     : "");
}

static int is_missing(int reason) { return reason == ENOENT || reason == ENOTDIR; }

int flesh_path_check(const char *path)
{
  struct stat info;
  if (flesh_path_stat(path, &info))
    return is_missing(errno) ? FLESH_OK
                             : flesh_fail(FLESH_ERR_FILE, "%s: cannot be used: %s", path, flesh_path_reason(path, errno));
  if (S_ISREG(info.st_mode)) return FLESH_OK;
  if (S_ISLNK(info.st_mode))
    return flesh_fail(FLESH_ERR_FILE, "%s: cannot be used: %s", path, flesh_path_reason(path, ELOOP));
  return flesh_fail_kind(path, info.st_mode);
}

int flesh_path_is_file(const char *path)
{
  struct stat info;
  return !flesh_path_stat(path, &info) && S_ISREG(info.st_mode);
}

int flesh_path_is_there(const char *path)
{
  struct stat info;
  return !flesh_path_stat(path, &info) || !is_missing(errno);
}
