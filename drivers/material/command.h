/* command.h: `flesh material`, the comparison of the energies along simple paths. */
#ifndef FLESH_MATERIAL_COMMAND_H
#define FLESH_MATERIAL_COMMAND_H

/* argv[0] is the command's name. Returns the program's exit code: 0, 2 (usage or constants), 3 (a
 * file could not be written, or gnuplot could not draw). */
int flesh_command_material(int argc, char **argv);

#endif
