/* command_check.h: `flesh check`. */
#ifndef FLESH_DRIVERS_COMMAND_CHECK_H
#define FLESH_DRIVERS_COMMAND_CHECK_H

/* Returns the exit code. */
int flesh_command_check(int argc, char **argv);

#endif
