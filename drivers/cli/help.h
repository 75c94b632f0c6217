/* help.h: the help of a command, made from its table of options: as text, as a manual page, or as what a shell completes.
 *
 * A command's table exists while it runs. `flesh COMMAND --help` prints it in the format that is set: `flesh manual` and
 * `flesh completion` set one and ask every command for its help. */
#ifndef FLESH_CLI_HELP_H
#define FLESH_CLI_HELP_H

#include "cli/usage.h"

typedef enum flesh_help_format { FLESH_HELP_TEXT, FLESH_HELP_MAN, FLESH_HELP_BASH, FLESH_HELP_ZSH } flesh_help_format;

/* The format of all help from now on; text at first. */
void flesh_help_set_format(flesh_help_format format);

/* To stdout, with that of usage->commands where it is not text. */
void flesh_help_print(const flesh_usage *usage);
/* Prints the help of a command that is only a list of subcommands, as flesh_subcommand_run takes it. */
void flesh_help_print_list(const char *command, const char *about, const char *more, const flesh_subcommand *list);

/* The exit codes that a command with these `exits` (flesh_exits, or'ed) may end with. */
void flesh_help_print_exits(unsigned exits);

/* A line on what the program is, and its commands, for help on all of it: main.c sets them. */
extern const char *flesh_help_about;
extern const flesh_subcommand *flesh_help_commands;

/* Manual pages in roff, to stdout: a page's head, paragraphs (lines that begin with a space stand as they are), exit codes. */
void flesh_help_man_head(const char *page, const char *summary);
void flesh_help_man_text(const char *text);
void flesh_help_man_exits(unsigned exits); /* flesh_exits, or'ed */

/* The help of all commands of a list, in the format that is set. */
void flesh_help_print_all(const flesh_subcommand *list);

/* Single-quoted for a shell. */
void flesh_help_quote(const char *word);

#endif
