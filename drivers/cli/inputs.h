/* inputs.h: the files that a command reads, which none of its outputs may replace. */
#ifndef FLESH_CLI_INPUTS_H
#define FLESH_CLI_INPUTS_H

#include "flesh/scene.h"

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

/* Fails with FLESH_ERR_ARGUMENT and a sentence if `path` is one of the inputs, under any name. */
int flesh_inputs_spare(const flesh_inputs *inputs, const char *path);
/* Does the same for folder/names[k], and for all files in folder/subfolders[k], which is replaced as a whole; then
 * closes the inputs. NULL ends the lists; `subfolders` may be NULL. */
int flesh_inputs_spare_in(flesh_inputs *inputs, const char *folder, const char *const *names, const char *const *subfolders);

#endif
