/* command_accuracy.h: `flesh accuracy`. */
#ifndef FLESH_DRIVERS_COMMAND_ACCURACY_H
#define FLESH_DRIVERS_COMMAND_ACCURACY_H

/* argv[0] is "accuracy"; returns the exit code. */
int flesh_command_accuracy(int argc, char **argv);

#endif
