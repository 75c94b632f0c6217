/* command.h: `flesh manual` and `flesh completion`. */
#ifndef FLESH_MANUAL_COMMAND_H
#define FLESH_MANUAL_COMMAND_H

/* argv[0] is "manual" or "completion"; both return the exit code. */
int flesh_command_manual(int argc, char **argv);
int flesh_command_completion(int argc, char **argv);

#endif
