/* command.h: `flesh drift`. */
#ifndef FLESH_DRIFT_COMMAND_H
#define FLESH_DRIFT_COMMAND_H

/* argv[0] is "drift"; returns the exit code. */
int flesh_command_drift(int argc, char **argv);

#endif
