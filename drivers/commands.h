/* commands.h: the commands of the program. */
#ifndef FLESH_COMMANDS_H
#define FLESH_COMMANDS_H

#include "cli/subcommands.h"

extern const char flesh_about[]; /* one line */
extern const flesh_subcommand flesh_commands[];

#endif
