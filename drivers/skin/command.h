/* command.h: `flesh skin`. */
#ifndef FLESH_SKIN_COMMAND_H
#define FLESH_SKIN_COMMAND_H

int flesh_command_skin(int argc, char **argv);

#endif
