/* output.c: claims folders, and checks that writing destroys nothing. */
#include "cli/output.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/confine.h"
#include "base/error.h"
#include "cli/path.h"
#include "run/checkpoint.h"

/* The files that a run writes into its folder, and how they begin, by which an older run's file is told from other
 * files. */
static const struct {
  const char *name, *begin;
} written[] = {{"scene.yaml", "# Every key in force"},
               {"history.csv", "t,step,h,"},
               {"probes.csv", "t [s],"},
               {"state.txt", "# t "},
               {"result.json", "{\n  \"status\""},
               {FLESH_CHECKPOINT_NAME, "flesh checkpoint"}};
enum { WRITTEN = sizeof written / sizeof *written };

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

/* Refuses a file of that name that begins otherwise: no run has written it. */
static int check_begin(const char *path, const char *begin)
{
  char head[32];
  const int status = flesh_path_check(path), file = status ? -1 : flesh_path_open(path, O_RDONLY | O_NONBLOCK, 0);
  if (file < 0) return status; /* errors are reported when it is replaced */
  const ssize_t got = read(file, head, strlen(begin));
  close(file);
  if (!got || (got == (ssize_t)strlen(begin) && !memcmp(head, begin, (size_t)got))) return FLESH_OK;
  return flesh_fail(FLESH_ERR_FILE,
                    "%s: no run has written this file, and a run into this folder would replace it; give "
                    "another folder, or move it away",
                    path);
}

/* Checks that a subfolder, if there is one, is a folder. */
static int check_subfolder(const char *path)
{
  struct stat info;
  return flesh_path_stat(path, &info) || S_ISDIR(info.st_mode) ? FLESH_OK : flesh_folder_make(path);
}

/* Returns whether both paths name the same place, whether or not there is anything. */
static int same_place(const char *a, const char *b)
{
  const char *paths[2] = {a, b}, *bases[2];
  struct stat folders[2];
  for (int k = 0; k < 2; k++) {
    const char *slash = strrchr(paths[k], '/');
    if (flesh_path_stat(slash ? flesh_path("%.*s", (int)(slash + 1 - paths[k]), paths[k]) : ".", &folders[k])) return 0;
    bases[k] = slash ? slash + 1 : paths[k];
  }
  return folders[0].st_dev == folders[1].st_dev && folders[0].st_ino == folders[1].st_ino &&
         !strcmp(bases[0], bases[1]);
}

static int check_files(const char *out, const char *save_state, flesh_inputs *inputs)
{
  static const char *const subfolders[] = {"frames", "skin", "error", NULL};
  const char *names[WRITTEN + 1] = {NULL};
  for (int k = 0; k < WRITTEN; k++) names[k] = written[k].name;
  int status = flesh_inputs_spare_in(inputs, out, names, subfolders);
  for (int k = 0; k < WRITTEN && !status; k++) {
    const char *path = flesh_path("%s/%s", out, written[k].name);
    status = check_begin(path, written[k].begin);
    if (!status && save_state && strcmp(written[k].name, "state.txt") && same_place(path, save_state))
      status = flesh_fail(FLESH_ERR_ARGUMENT, "--save-state is %s, which the run writes itself; give another name",
                          save_state);
  }
  for (int k = 0; subfolders[k] && !status; k++) status = check_subfolder(flesh_path("%s/%s", out, subfolders[k]));
  return status;
}

int flesh_run_output_claim(const flesh_scene *scene, const char *scene_path, const char *save_state, const char *out,
                           flesh_folder_claim *claim)
{
  flesh_inputs inputs = {0};
  *claim = (flesh_folder_claim){.descriptor = -1};
  if (scene_path) flesh_inputs_add_scene(&inputs, scene_path, scene);
  int status = save_state ? flesh_output_prepare(save_state, &inputs) : FLESH_OK;
  if (!status && out) status = flesh_output_claim(out, "run", claim);
  if (!status && out) status = check_files(out, save_state, &inputs);
  if (status) flesh_folder_claim_release(claim);
  flesh_inputs_close(&inputs);
  return status;
}
