/* help.c: the help of a command as text, and which format it is printed in. */
#include "cli/help.h"

#include <stdio.h>
#include <string.h>

const flesh_exit_row flesh_exit_rows[] = {
    {"0", "fine", 0},
    {"1", "out of memory or an internal failure", 0},
    {"2", "bad usage or scene", 0},
    {"3", "bad or unwritable file, or bad mesh", 0},
    {"4", "a solve failed", FLESH_EXITS_OF_SOLVES},
    {"5", "the time integrator failed", FLESH_EXITS_OF_SOLVES},
    {"6", "the budget (--max-seconds) is spent", FLESH_EXITS_OF_BUDGETS},
    {"7", "a number became non-finite", FLESH_EXITS_OF_SOLVES},
    {"8", "the energy grew beyond the work put in (time.max_energy_gain)", FLESH_EXITS_OF_SOLVES},
    {"130/143", "interrupted by SIGINT/SIGTERM (129: SIGHUP); what was done is kept and valid", FLESH_EXITS_OF_INTERRUPTS},
    {NULL, NULL, 0}};

const char *flesh_help_about = "";
const flesh_subcommand *flesh_help_commands = NULL;

static flesh_help_format chosen = FLESH_HELP_TEXT;

void flesh_help_set_format(flesh_help_format format) { chosen = format; }

/* A name, and beside it (or below, where it is long) what it means, in lines of at most 110 characters. */
static void print_option(const char *name, const char *doc, const char *more)
{
  enum { COLUMN = 25, WIDTH = 110 };
  char text[1024];
  int at = printf("  %-22s", name);
  snprintf(text, sizeof text, "%s%s", doc, more);
  if (at >= COLUMN) at = printf("\n%*s", COLUMN - 1, "") - 1;
  for (const char *word = text; *word;) {
    const int length = (int)strcspn(word, " \n");
    if (at > COLUMN && at + 1 + length > WIDTH) at = printf("\n%*s", COLUMN - 1, "") - 1;
    at += printf(" %.*s", length, word);
    word += length;
    word += strspn(word, " \n");
  }
  putchar('\n');
}

void flesh_help_print_exits(unsigned exits)
{
  printf("Exit codes:\n");
  for (const flesh_exit_row *row = flesh_exit_rows; row->code; row++)
    if (!row->exits || row->exits & exits) printf("  %-8s %s\n", row->code, row->doc);
}

static void print_text(const flesh_usage *usage)
{
  printf("Usage: flesh %s [OPTION]...%s%s\n%s\n", usage->command, *usage->positionals ? " " : "", usage->positionals,
         usage->summary);
  if (usage->details) printf("\n%s", usage->details);
  printf("\nOptions:\n");
  for (const flesh_option *option = usage->options; option->name; option++) {
    char name[160];
    snprintf(name, sizeof name, "--%s%s%s", option->name, option->argument ? " " : "",
             option->argument ? option->argument : "");
    print_option(name, option->doc, option->kind == FLESH_OPTION_LIST ? " (may be repeated)" : "");
  }
  print_option("--help", "print this", "");
  putchar('\n');
  flesh_help_print_exits(usage->exits);
}

static void print_text_list(const char *command, const char *about, const char *more, const flesh_subcommand *list)
{
  printf("Usage: flesh %s COMMAND [ARGUMENT]...\n%s\nCommands:\n", command, about);
  for (; list->name; list++) printf("  %-10s %s\n", list->name, list->summary);
  printf("\n`flesh %s COMMAND --help` describes a command.%s%s\n\n", command, more ? " " : "", more ? more : "");
  flesh_help_print_exits(0);
}

void flesh_help_print_all(const flesh_subcommand *list)
{
  for (; list && list->name; list++) {
    char name[32], help[] = "--help", *words[] = {name, help, NULL};
    snprintf(name, sizeof name, "%s", list->name);
    list->run(2, words);
  }
}

void flesh_help_print(const flesh_usage *usage)
{
  if (chosen == FLESH_HELP_TEXT) {
    print_text(usage);
    return;
  }
  if (chosen == FLESH_HELP_MAN) flesh_help_man(usage);
  if (chosen == FLESH_HELP_BASH) flesh_help_bash(usage);
  if (chosen == FLESH_HELP_ZSH) flesh_help_zsh(usage);
  flesh_help_print_all(usage->commands);
  if (chosen == FLESH_HELP_MAN && !strchr(usage->command, ' ')) flesh_help_man_end();
}

void flesh_help_print_list(const char *command, const char *about, const char *more, const flesh_subcommand *list)
{
  static const flesh_option none[] = {{0}};
  char summary[128];
  snprintf(summary, sizeof summary, "%.*s", (int)strcspn(about, "\n"), about);
  const char *details = about + strcspn(about, "\n");
  details += strspn(details, "\n");
  const flesh_usage usage = {command, "COMMAND [ARGUMENT]...", summary, *details ? details : more, 0, 0, none, list, 0};
  if (chosen == FLESH_HELP_TEXT) print_text_list(command, about, more, list);
  else flesh_help_print(&usage);
}
