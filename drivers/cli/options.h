/* options.h: functions by which the commands read their command lines. */
#ifndef FLESH_CLI_OPTIONS_H
#define FLESH_CLI_OPTIONS_H

#include "cli/usage.h"

enum { FLESH_OPTIONS_GO_ON = -1 };

/* Reads the options (they may stand among the positionals) and moves the positionals to argv[1...];
 * *positional_count of them. Returns FLESH_OPTIONS_GO_ON, or the exit code to leave with: 0 after
 * --help was printed, 2 after one sentence on stderr about what is wrong. --help and -h are known
 * to every command. */
int flesh_options_read(const flesh_usage *usage, int argc, char **argv, int *positional_count);

/* Reads a number, or a fraction a/b, as those of scenes are. Returns 0 if the whole text is one and its value is finite. */
int flesh_option_number(const char *text, double *value);

/* Returns the exit code of a status; flesh_exit_rows describes the codes. */
int flesh_exit_code(int status);

/* Prints "flesh COMMAND: <sentence>" to stderr, as one printable line whatever texts it quotes, and returns 2. For
 * command "" the line begins with "flesh: ". */
int flesh_command_refuse(const char *command, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Refuses an option whose value (NULL: missing) is not valid: "--out is missing; it must be a folder". Returns 2. */
int flesh_option_refuse(const char *command, const char *option, const char *value, const char *valid);

/* Prints "flesh COMMAND: <last error>" to stderr and returns the exit code of `status`. */
int flesh_command_fail(const char *command, int status);

/* Runs a command of several words, as `flesh mesh info`, or with the command "" the program: calls the subcommand named by argv[1] with the words from
 * there on, or prints the help, with `about` above the list and `more` (may be NULL) below it. Returns the exit code; 2
 * after a sentence on stderr if the name is missing or unknown. */
int flesh_subcommand_run(const char *command, const char *about, const char *more, const flesh_subcommand *list,
                         int argc, char **argv);

#endif
