/* provenance.h: what a result was made from: program, machine, inputs. */
#ifndef FLESH_RUN_PROVENANCE_H
#define FLESH_RUN_PROVENANCE_H

#include <jansson.h>

#include "flesh/scene.h"

/* Prints the version and what it was built with, for `flesh --version`. */
void flesh_provenance_print_version(void);

/* Identifies the running program in one line: programs with the same line give the same bits. */
enum { FLESH_IDENTITY_SIZE = 512 };
void flesh_provenance_identity(char text[FLESH_IDENTITY_SIZE]);

/* Returns a new object with program, libraries, machine, command line and date. */
json_t *flesh_provenance_program(int argc, char **argv);

/* Returns a new object with the mesh's counts and volume. */
json_t *flesh_provenance_mesh(const flesh_mesh_info *info);

/* Returns a new object with path and sha256 of the scene and of its mesh files, mesh counts and seed. */
json_t *flesh_provenance_scene(const flesh_scene *scene, const char *path);

#endif
