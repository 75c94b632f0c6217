/* output.h: checks the places that a command will write to: claims folders, and refuses what would destroy
 * something. */
#ifndef FLESH_CLI_OUTPUT_H
#define FLESH_CLI_OUTPUT_H

#include "base/folder.h"
#include "cli/inputs.h"

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
