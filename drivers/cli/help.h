/* help.h: the help of a command, made from its table of options: as text, as a manual page, or as a table for completion
 * scripts, whose columns are separated by tabs: command, option or subcommand, name of the value, description.
 *
 * A command's table exists while the command runs. `flesh COMMAND --help` prints it in the format that is set; `flesh
 * manual` and `flesh completion` set a format and run every command with --help. */
#ifndef FLESH_CLI_HELP_H
#define FLESH_CLI_HELP_H

#include "cli/usage.h"

typedef enum flesh_help_format { FLESH_HELP_TEXT, FLESH_HELP_MAN, FLESH_HELP_TABLE } flesh_help_format;

/* Sets the format of all help from now on; at first it is text. */
void flesh_help_set_format(flesh_help_format format);

/* Prints the help to stdout; in other formats than text, the help of usage->commands, too. */
void flesh_help_print(const flesh_usage *usage);
/* Prints the help of a command that is only a list of subcommands, as flesh_subcommand_run takes it. */
void flesh_help_print_list(const char *command, const char *about, const char *more, const flesh_subcommand *list);

/* Prints the exit codes of a command with these `exits` (flesh_exits, or'ed): as a section if the format is a manual page,
 * else as text. */
void flesh_help_print_exits(unsigned exits);

/* The commands of the program, for help on the whole of it; set by main.c. */
extern const flesh_subcommand *flesh_help_commands;

/* Print parts of a manual page in roff to stdout: its head, and paragraphs (lines that begin with a space are kept as
 * they are). */
void flesh_help_man_head(const char *page, const char *summary);
void flesh_help_man_text(const char *text);

#endif
