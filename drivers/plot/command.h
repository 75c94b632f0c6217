/* command.h: `flesh plot`. */
#ifndef FLESH_PLOT_COMMAND_H
#define FLESH_PLOT_COMMAND_H

int flesh_command_plot(int argc, char **argv);

#endif
