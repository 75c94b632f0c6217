/* split_command.h: meshes written in parts. */
#ifndef FLESH_MESH_SPLIT_COMMAND_H
#define FLESH_MESH_SPLIT_COMMAND_H

/* `flesh mesh split`; argv[0] is "split". Returns the exit code. */
int flesh_split_command(int argc, char **argv);

/* `flesh mesh box --parts N`. Returns the exit code. */
int flesh_split_command_box(const int cells[3], const double size[3], const double origin[3], int parts,
                            const char *folder);

#endif
