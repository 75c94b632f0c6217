/* command_drift.h: `flesh drift`. */
#ifndef FLESH_DRIVERS_COMMAND_DRIFT_H
#define FLESH_DRIVERS_COMMAND_DRIFT_H

/* argv[0] is "drift"; returns the exit code. */
int flesh_command_drift(int argc, char **argv);

#endif
