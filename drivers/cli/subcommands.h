/* subcommands.h: commands of several words, as `flesh mesh info`: which one it is, and their help. */
#ifndef FLESH_CLI_SUBCOMMANDS_H
#define FLESH_CLI_SUBCOMMANDS_H

#include "cli/usage.h"

/* Runs the one that argv[1] names, which gets the words from there on, or prints the help: `about` above the list and
 * `more` (may be NULL) below it. Returns the exit code; 2 after one sentence on stderr for want of a known name. */
int flesh_subcommand_run(const char *command, const char *about, const char *more, const flesh_subcommand *list,
                         int argc, char **argv);

#endif
