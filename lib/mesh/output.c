/* output.c: writing under a temporary name and renaming. */
#include "mesh/output.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/error.h"

static int fail_to_write(const char *path)
{
  return flesh_fail(FLESH_ERR_FILE, "%s: cannot be written: %s", path, strerror(errno));
}

int flesh_output_open(const char *path, flesh_output *output)
{
  struct stat there;
  *output = (flesh_output){.path = path};
  if (!stat(path, &there) && !S_ISREG(there.st_mode))
    return flesh_fail(FLESH_ERR_FILE, "%s: is there and is no regular file; it cannot be replaced",
                      path);
  size_t room = strlen(path) + 64;
  output->temporary = malloc(room);
  if (!output->temporary) return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a path");
  int file = -1;
  /* Not mkstemp: the file is to have the permissions that the user's umask asks for. */
  for (int attempt = 0; attempt < 100 && file < 0; attempt++) {
    snprintf(output->temporary, room, "%s.%ld-%d.part", path, (long)getpid(), attempt);
    file = open(output->temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file < 0 && errno != EEXIST) break;
  }
  if (file >= 0) {
    output->file = fdopen(file, "wb");
    if (output->file) return FLESH_OK;
    close(file);
    unlink(output->temporary);
  }
  free(output->temporary);
  output->temporary = NULL;
  return fail_to_write(path);
}

int flesh_output_close(flesh_output *output)
{
  int lost = ferror(output->file);
  lost |= fclose(output->file);
  output->file = NULL;
  return lost ? fail_to_write(output->path) : FLESH_OK;
}

int flesh_output_commit(flesh_output *output)
{
  if (rename(output->temporary, output->path)) return fail_to_write(output->path);
  free(output->temporary);
  output->temporary = NULL;
  return FLESH_OK;
}

void flesh_output_discard(flesh_output *output)
{
  if (output->file) fclose(output->file);
  output->file = NULL;
  if (output->temporary) unlink(output->temporary);
  free(output->temporary);
  output->temporary = NULL;
}
