/* command_stress.h: `flesh stress`. */
#ifndef FLESH_DRIVERS_COMMAND_STRESS_H
#define FLESH_DRIVERS_COMMAND_STRESS_H

/* argv[0] is "stress"; returns the exit code. */
int flesh_command_stress(int argc, char **argv);

#endif
