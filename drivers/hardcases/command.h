/* command.h: `flesh stress`. */
#ifndef FLESH_HARDCASES_COMMAND_H
#define FLESH_HARDCASES_COMMAND_H

/* argv[0] is "stress"; returns the exit code. */
int flesh_command_stress(int argc, char **argv);

#endif
