/* command.h: `flesh check`. */
#ifndef FLESH_CHECK_COMMAND_H
#define FLESH_CHECK_COMMAND_H

/* Returns the exit code. */
int flesh_command_check(int argc, char **argv);

#endif
