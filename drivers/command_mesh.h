/* command_mesh.h: `flesh mesh`: inspecting, converting and making meshes. */
#ifndef FLESH_DRIVERS_COMMAND_MESH_H
#define FLESH_DRIVERS_COMMAND_MESH_H

/* argv[0] is "mesh". Returns the exit code. */
int flesh_command_mesh(int argc, char **argv);

#endif
