/* command_run.h: `flesh run`. */
#ifndef FLESH_DRIVERS_COMMAND_RUN_H
#define FLESH_DRIVERS_COMMAND_RUN_H

/* Returns the exit code. */
int flesh_command_run(int argc, char **argv);

#endif
