/* provenance.h: what a result came from: program, machine, inputs. */
#ifndef FLESH_RUN_PROVENANCE_H
#define FLESH_RUN_PROVENANCE_H

#include <jansson.h>

#include "flesh/scene.h"

/* `flesh --version`: the version and what it was built with. */
void flesh_provenance_print_version(void);

/* Identifies the running program in one line: programs with the same line give the same bits. */
enum { FLESH_IDENTITY_SIZE = 512 };
void flesh_provenance_identity(char text[FLESH_IDENTITY_SIZE]);

/* A new object with program, libraries, machine, command line and date. */
json_t *flesh_provenance_program(int argc, char **argv);

/* A new object of the mesh's counts and volume. */
json_t *flesh_provenance_mesh(const flesh_mesh_info *info);

/* A new object with the scene's path and sha256, those of its mesh files, mesh counts and seed. */
json_t *flesh_provenance_scene(const flesh_scene *scene, const char *path);

#endif
