/* command.h: `flesh hardcases`. */
#ifndef FLESH_HARDCASES_COMMAND_H
#define FLESH_HARDCASES_COMMAND_H

/* argv[0] is "hardcases"; returns the exit code. */
int flesh_command_hardcases(int argc, char **argv);

#endif
