/* output.h: where a command is to write: folders are claimed, and what would lose something is refused. */
#ifndef FLESH_CLI_OUTPUT_H
#define FLESH_CLI_OUTPUT_H

#include "base/folder.h"
#include "cli/inputs.h"

/* Before a run writes anything. Claims its folder `out` (NULL: nothing to claim) and checks that none of its files, nor
 * the copy of its state (NULL: none), would replace one that it reads, nor one that no run has written. `scene_path`
 * may be NULL. FLESH_ERR_ARGUMENT, FLESH_ERR_FILE. */
int flesh_run_output_claim(const flesh_scene *scene, const char *scene_path, const char *save_state, const char *out,
                           flesh_folder_claim *claim);

/* Claims a folder for a command, whose lock file then says `flesh COMMAND`, its process and its host. Waits a moment
 * for a process that was killed just now. */
int flesh_output_claim(const char *folder, const char *command, flesh_folder_claim *claim);

/* A single file (of TetGen's meshes both halves) that is to be written: FLESH_ERR_ARGUMENT when it is one of the
 * inputs; clears temporary files of it that killed processes left. */
int flesh_output_prepare(const char *path, const flesh_inputs *inputs);
/* FLESH_ERR_FILE where the folder of a file that is to be written is missing: it is told before the work is done. */
int flesh_output_check_folder(const char *path);
/* Like flesh_output_prepare, with `count` files or folders and one more (may be NULL) as inputs; checks the folder, too. */
int flesh_output_prepare_from(const char *path, int count, char *const *inputs, const char *further);

#endif
