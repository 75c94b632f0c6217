/* command.h: `flesh mesh`: inspecting, converting and making meshes. */
#ifndef FLESH_MESH_COMMAND_H
#define FLESH_MESH_COMMAND_H

/* argv[0] is "mesh". Returns the exit code. */
int flesh_command_mesh(int argc, char **argv);

#endif
