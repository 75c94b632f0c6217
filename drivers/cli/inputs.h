/* inputs.h: the files that a command reads, which nothing that it writes may replace. */
#ifndef FLESH_CLI_INPUTS_H
#define FLESH_CLI_INPUTS_H

#include "flesh/scene.h"

typedef struct flesh_inputs {
  int count, room, failed; /* failed: memory ran out */
  struct flesh_input *files;
} flesh_inputs;

/* Adds the file, with the other half of a mesh of TetGen. Only files that are there count. Zero-initialise before. */
void flesh_inputs_add(flesh_inputs *inputs, const char *path);
/* The scene's file and all that it names. */
void flesh_inputs_add_scene(flesh_inputs *inputs, const char *path, const flesh_scene *scene);
/* The other of TetGen's two files NAME.node and NAME.ele, for the next few calls (path.h); NULL for other names. */
const char *flesh_tetgen_partner(const char *path);
void flesh_inputs_close(flesh_inputs *inputs);

/* FLESH_ERR_ARGUMENT with a sentence when `path` is one of the inputs, by whatever name. */
int flesh_inputs_spare(const flesh_inputs *inputs, const char *path);
/* Checks folder/names[k] likewise, and everything in folder/subfolders[k], which is replaced as a whole; then closes the
 * inputs. The lists end with NULL; `subfolders` may be NULL. */
int flesh_inputs_spare_in(flesh_inputs *inputs, const char *folder, const char *const *names, const char *const *subfolders);

#endif
