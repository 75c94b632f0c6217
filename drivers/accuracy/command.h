/* command.h: `flesh accuracy`. */
#ifndef FLESH_ACCURACY_COMMAND_H
#define FLESH_ACCURACY_COMMAND_H

/* argv[0] is "accuracy"; returns the exit code. */
int flesh_command_accuracy(int argc, char **argv);

#endif
