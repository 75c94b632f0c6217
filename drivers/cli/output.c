/* output.c: claims folders, and checks that writing destroys nothing; recognises files that are read by device and inode,
 * not by their names. */
#include "cli/output.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/confine.h"
#include "base/error.h"
#include "base/memory.h"
#include "cli/path.h"
#include "scene/scene.h"

/* The file and its folder. */
struct flesh_input {
  dev_t device[2];
  ino_t number[2];
};

static void add_one(flesh_inputs *inputs, const char *path)
{
  struct stat file, folder = {0};
  errno = 0;
  char *whole = realpath(path, NULL), *slash = whole ? strrchr(whole, '/') : NULL;
  inputs->failed |= !whole && errno == ENOMEM;
  if (!slash || stat(whole, &file) || !S_ISREG(file.st_mode)) {
    free(whole);
    return;
  }
  *slash = 0;
  stat(slash == whole ? "/" : whole, &folder); /* zeros if there is none that can be seen */
  free(whole);
  if (!flesh_grow(&inputs->files, sizeof *inputs->files, inputs->count, &inputs->room)) {
    inputs->failed = 1;
    return;
  }
  inputs->files[inputs->count++] =
      (struct flesh_input){{file.st_dev, folder.st_dev}, {file.st_ino, folder.st_ino}};
}

const char *flesh_tetgen_partner(const char *path)
{
  const char *dot = strrchr(path, '.');
  const char *partner = dot && !strcmp(dot, ".node") ? "ele" : dot && !strcmp(dot, ".ele") ? "node" : NULL;
  return partner ? flesh_path("%.*s%s", (int)(dot + 1 - path), path, partner) : NULL;
}

void flesh_inputs_add(flesh_inputs *inputs, const char *path)
{
  add_one(inputs, path);
  const char *other = flesh_tetgen_partner(path);
  if (other) add_one(inputs, other);
}

static void visit(void *data, const char *path) { flesh_inputs_add(data, path); }

void flesh_inputs_add_scene(flesh_inputs *inputs, const char *path, const flesh_scene *scene)
{
  flesh_inputs_add(inputs, path);
  flesh_scene_visit_files(scene, visit, inputs);
}

void flesh_inputs_close(flesh_inputs *inputs)
{
  free(inputs->files);
  *inputs = (flesh_inputs){0};
}

/* Fails if the path is one of the inputs or, with `folder`, if it is the folder of one. */
static int spare(const flesh_inputs *inputs, const char *path, int folder)
{
  struct stat info;
  if (stat(path, &info) || (folder && !S_ISDIR(info.st_mode))) return FLESH_OK;
  for (int k = 0; k < inputs->count; k++)
    if (inputs->files[k].device[folder] == info.st_dev && inputs->files[k].number[folder] == info.st_ino)
      return flesh_fail(FLESH_ERR_ARGUMENT,
                        folder ? "%s: a file in it is read by this command, whose results would replace all that is there; "
                                 "give another place for them"
                               : "%s: is read by this command, whose results would replace it; give another place for them",
                        path);
  return FLESH_OK;
}

/* Fails if the path is one of the inputs. */
static int spare_file(const flesh_inputs *inputs, const char *path)
{
  return inputs->failed ? flesh_no_memory() : spare(inputs, path, 0);
}

int flesh_inputs_spare_in(flesh_inputs *inputs, const char *folder, const char *const *names, const char *const *subfolders)
{
  int status = FLESH_OK;
  for (; names && *names && !status; names++) status = spare_file(inputs, flesh_path("%s/%s", folder, *names));
  for (; subfolders && *subfolders && !status; subfolders++)
    status = spare(inputs, flesh_path("%s/%s", folder, *subfolders), 1);
  flesh_inputs_close(inputs);
  return status;
}

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
  int status = spare_file(inputs, path);
  if (status) return status;
  flesh_file_clear(path);
  const char *other = flesh_tetgen_partner(path);
  if (!other) return FLESH_OK;
  status = spare_file(inputs, other);
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
