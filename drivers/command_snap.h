/* command_snap.h: `flesh snap`. */
#ifndef FLESH_DRIVERS_COMMAND_SNAP_H
#define FLESH_DRIVERS_COMMAND_SNAP_H

int flesh_command_snap(int argc, char **argv);

#endif
