/* command.h: `flesh run`. */
#ifndef FLESH_RUN_COMMAND_H
#define FLESH_RUN_COMMAND_H

/* Returns the exit code. */
int flesh_command_run(int argc, char **argv);

#endif
