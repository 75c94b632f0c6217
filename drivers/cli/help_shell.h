/* help_shell.h: a command's options and commands as branches of the scripts of completion/command.c, to stdout. */
#ifndef FLESH_CLI_HELP_SHELL_H
#define FLESH_CLI_HELP_SHELL_H

#include "cli/usage.h"

void flesh_help_bash(const flesh_usage *usage);
void flesh_help_zsh(const flesh_usage *usage);
/* Single-quoted for a shell. */
void flesh_help_quote(const char *word);

#endif
