/* command.h: `flesh snap`. */
#ifndef FLESH_SNAP_COMMAND_H
#define FLESH_SNAP_COMMAND_H

int flesh_command_snap(int argc, char **argv);

#endif
