/* command_skin.h: `flesh skin`. */
#ifndef FLESH_DRIVERS_COMMAND_SKIN_H
#define FLESH_DRIVERS_COMMAND_SKIN_H

int flesh_command_skin(int argc, char **argv);

#endif
