/* output.c: claims folders, and checks that writing destroys nothing. */
#include "cli/output.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/confine.h"
#include "base/error.h"
#include "cli/path.h"

int flesh_output_claim(const char *folder, const char *command, flesh_folder_claim *claim)
{
  char host[80] = "", who[256];
  gethostname(host, sizeof host - 1);
  snprintf(who, sizeof who, "flesh %.60s, process %ld on %s", command, (long)getpid(), host);
  const double patience = 0.3; /* s; a process that was just killed holds its folder until it has ended */
  return flesh_folder_claim_take(folder, who, patience, claim);
}

int flesh_output_prepare(const char *path, const flesh_inputs *inputs)
{
  int status = flesh_inputs_spare(inputs, path);
  if (status) return status;
  flesh_file_clear(path);
  const char *other = flesh_tetgen_partner(path);
  if (!other) return FLESH_OK;
  status = flesh_inputs_spare(inputs, other);
  if (!status) flesh_file_clear(other);
  return status;
}

int flesh_output_check_folder(const char *path)
{
  const char *slash = strrchr(path, '/');
  struct stat info;
  if (slash && flesh_path_stat(flesh_path("%.*s", (int)(slash + 1 - path), path), &info) && errno == ENOENT)
    return flesh_fail(FLESH_ERR_FILE, "%s: cannot be written: there is no folder %.*s", path, (int)(slash - path), path);
  return FLESH_OK;
}

int flesh_output_prepare_from(const char *path, int count, char *const *read, const char *further)
{
  flesh_inputs inputs = {0};
  for (int k = 0; k < count; k++) flesh_inputs_add(&inputs, read[k]);
  if (further) flesh_inputs_add(&inputs, further);
  int status = flesh_output_prepare(path, &inputs);
  flesh_inputs_close(&inputs);
  return status ? status : flesh_output_check_folder(path);
}
