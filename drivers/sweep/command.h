/* command.h: `flesh sweep`. */
#ifndef FLESH_SWEEP_COMMAND_H
#define FLESH_SWEEP_COMMAND_H

int flesh_command_sweep(int argc, char **argv);

#endif
