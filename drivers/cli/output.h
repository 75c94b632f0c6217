/* output.h: checks the places that a command will write to: claims folders, and refuses what would destroy something,
 * above all the files that the command reads. */
#ifndef FLESH_CLI_OUTPUT_H
#define FLESH_CLI_OUTPUT_H

#include "base/folder.h"
#include "flesh/scene.h"

/* The files that a command reads. */
typedef struct flesh_inputs {
  int count, room, failed; /* failed: memory ran out */
  struct flesh_input *files;
} flesh_inputs;

/* Adds the file and, for a mesh of TetGen, its other half. Files that do not exist are ignored. *inputs is
 * zero-initialised first. */
void flesh_inputs_add(flesh_inputs *inputs, const char *path);
/* Adds the scene's file and all files that the scene names. */
void flesh_inputs_add_scene(flesh_inputs *inputs, const char *path, const flesh_scene *scene);
/* Returns the other of TetGen's files NAME.node and NAME.ele, for the next few calls (path.h); NULL for other names. */
const char *flesh_tetgen_partner(const char *path);
void flesh_inputs_close(flesh_inputs *inputs);

/* Fails with FLESH_ERR_ARGUMENT and a sentence if folder/names[k] is one of the inputs, under any name, or one is in
 * folder/subfolders[k], which is replaced as a whole; then closes the inputs. NULL ends the lists; `subfolders` may be
 * NULL. */
int flesh_inputs_spare_in(flesh_inputs *inputs, const char *folder, const char *const *names, const char *const *subfolders);

/* Claims a folder for a command; the lock file says `flesh COMMAND`, the process and the host. Waits 0.3 s for a
 * process that was just killed to release it. */
int flesh_output_claim(const char *folder, const char *command, flesh_folder_claim *claim);

/* Prepares a single file (for TetGen's meshes, both) to be written: FLESH_ERR_ARGUMENT if it is one of the inputs.
 * Removes temporary files of it that killed processes left. */
int flesh_output_prepare(const char *path, const flesh_inputs *inputs);
/* Fails with FLESH_ERR_FILE if the folder of a file to be written is missing, so that this is reported before the work
 * is done. */
int flesh_output_check_folder(const char *path);
/* Does the same as flesh_output_prepare, with `count` files or folders and one more (may be NULL) as inputs; checks the
 * folder, too. */
int flesh_output_prepare_from(const char *path, int count, char *const *inputs, const char *further);

#endif
