/* sync.c: fsync of files and folders. */
#include "base/confine.h"
#include "base/sync.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/error.h"

static int sync_descriptor(int descriptor, const char *path)
{
  if (!fsync(descriptor) || errno == EINVAL || errno == EROFS) return FLESH_OK;
  return flesh_fail(FLESH_ERR_FILE, "%s: could not be written to the disk: %s", path, strerror(errno));
}

int flesh_sync(const char *path)
{
  const int descriptor = flesh_path_open(path, O_RDONLY | O_NONBLOCK, 0);
  if (descriptor < 0)
    return errno == ENOENT ? FLESH_OK
                           : flesh_fail(FLESH_ERR_FILE, "%s: could not be written to the disk: %s", path, strerror(errno));
  const int status = sync_descriptor(descriptor, path);
  close(descriptor);
  return status;
}

static int sync_folder_of(const char *path)
{
  const char *slash = strrchr(path, '/');
  char *folder = slash ? strndup(path, slash == path ? 1 : (size_t)(slash - path)) : strdup(".");
  if (!folder) return flesh_no_memory_for(path);
  const int status = flesh_sync(folder);
  free(folder);
  return status;
}

/* Returns the number after the last '_' of a name and before its suffix; -1 without one. */
static long number_of(const char *name)
{
  const char *mark = strrchr(name, '_');
  char *end;
  if (!mark || mark[1] < '0' || mark[1] > '9') return -1;
  const long number = strtol(mark + 1, &end, 10);
  return *end == '.' ? number : -1;
}

int flesh_sync_folder(const char *path, int settled)
{
  DIR *folder = flesh_path_list(path);
  if (!folder) return FLESH_OK;
  int status = FLESH_OK;
  for (struct dirent *entry; !status && (entry = readdir(folder));) {
    const long number = number_of(entry->d_name);
    if (*entry->d_name == '.' || (number >= 0 && number <= settled)) continue;
    const int descriptor = openat(dirfd(folder), entry->d_name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (descriptor < 0) continue; /* gone, a link, or not accessible */
    status = sync_descriptor(descriptor, path);
    close(descriptor);
  }
  if (!status) status = sync_descriptor(dirfd(folder), path);
  closedir(folder);
  return status;
}

int flesh_sync_commit(flesh_file *file)
{
  char *path = strdup(file->path);
  if (!path) {
    flesh_file_abandon(file);
    return flesh_no_memory();
  }
  int status = fflush(file->stream) ? FLESH_OK /* the commit finds this error, too */
                                    : sync_descriptor(fileno(file->stream), path);
  if (status) flesh_file_abandon(file);
  else status = flesh_file_commit(file);
  if (!status) status = sync_folder_of(path);
  free(path);
  return status;
}
