/* command_sweep.h: `flesh sweep`. */
#ifndef FLESH_DRIVERS_COMMAND_SWEEP_H
#define FLESH_DRIVERS_COMMAND_SWEEP_H

int flesh_command_sweep(int argc, char **argv);

#endif
