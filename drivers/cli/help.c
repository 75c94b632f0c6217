/* help.c: prints the help of a command as text, as a manual page in roff, or as rows of the table of completion scripts,
 * in the format that is set. */
#include "cli/help.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "flesh/status.h"
#include "flesh/version.h"
#include "scene/roff.h"

const flesh_exit_row flesh_exit_rows[] = {
    {FLESH_OK, "0", "fine", 0},
    {FLESH_ERR_MEMORY, "1", "out of memory or an internal failure", 0},
    {FLESH_ERR_ARGUMENT, "2", "bad usage or scene", 0},
    {FLESH_ERR_FILE, "3", "bad or unwritable file, or bad mesh", 0},
    {FLESH_ERR_SOLVE, "4", "a solve failed", FLESH_EXITS_OF_SOLVES},
    {FLESH_ERR_INTEGRATOR, "5", "the time integrator failed", FLESH_EXITS_OF_SOLVES},
    {FLESH_ERR_BUDGET, "6", "a budget (--max-seconds, the meshes of --to) is spent", FLESH_EXITS_OF_BUDGETS},
    {FLESH_ERR_NONFINITE, "7", "a number became non-finite", FLESH_EXITS_OF_SOLVES},
    {FLESH_ERR_ENERGY, "8", "the energy grew beyond the work put in (time.max_energy_gain)", FLESH_EXITS_OF_SOLVES},
    {FLESH_ERR_INTERRUPTED, "130/143", "interrupted by SIGINT/SIGTERM (129: SIGHUP); what was done is kept and valid",
     FLESH_EXITS_OF_INTERRUPTS},
    {0}};

const flesh_subcommand *flesh_help_commands = NULL;

static flesh_help_format chosen = FLESH_HELP_TEXT;

void flesh_help_set_format(flesh_help_format format) { chosen = format; }

/* Prints a name and beside it (below, if the name is long) its description, in lines of at most 110 characters. */
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

/* Prints `text`, escaped for roff, between `before` and `after`, which are roff. */
static void say(const char *before, const char *text, const char *after)
{
  flesh_text made = {0};
  flesh_roff_print(&made, text);
  printf("%s%s%s", before, made.data ? made.data : "", after);
  free(made.data);
}

void flesh_help_man_head(const char *page, const char *summary)
{
  printf(".TH ");
  for (const char *at = page; *at; at++) printf("%s", (char[]){*at >= 'a' && *at <= 'z' ? (char)(*at - 32) : *at, 0});
  say(" 1 \"\" \"flesh " FLESH_VERSION_STRING "\" \"User commands\"\n.SH NAME\n", page, "");
  say(" \\- ", summary, "\n");
}

void flesh_help_man_text(const char *text)
{
  int as_is = 0;
  for (size_t length; *text; text += length + (text[length] == '\n')) {
    char line[1024];
    length = strcspn(text, "\n");
    snprintf(line, sizeof line, "%.*s", (int)length, text);
    const int indented = *line == ' ';
    if (as_is != indented && *line) printf("%s\n", indented ? ".PP\n.nf" : ".fi\n.PP");
    if (*line) as_is = indented;
    if (*line) say("", line, "\n");
    else if (text[1] && as_is == (text[1] == ' ')) printf(".PP\n");
  }
  if (as_is) printf(".fi\n");
}

void flesh_help_print_exits(unsigned exits)
{
  const int man = chosen == FLESH_HELP_MAN;
  printf(man ? ".SH EXIT STATUS\n" : "Exit codes:\n");
  for (const flesh_exit_row *row = flesh_exit_rows; row->code; row++) {
    if (row->exits && !(row->exits & exits)) continue;
    if (man) say(".TP\n", row->code, "\n"), say("", row->doc, "\n");
    else printf("  %-8s %s\n", row->code, row->doc);
  }
}

static void synopsis(const flesh_usage *usage)
{
  say("\\fBflesh ", usage->command, "\\fR");
  if (usage->options->name) printf(" [\\fIOPTION\\fR]...");
  say(*usage->positionals ? " \\fI" : "", usage->positionals, *usage->positionals ? "\\fR\n" : "\n");
}

static void options(const flesh_usage *usage)
{
  for (const flesh_option *option = usage->options; option->name; option++) {
    say(".TP\n\\fB\\-\\-", option->name, "\\fR");
    if (option->argument) say(" \\fI", option->argument, "\\fR");
    say("\n", option->doc, "");
    printf("%s\n", option->kind == FLESH_OPTION_LIST ? " (may be repeated)" : "");
  }
  printf(".TP\n\\fB\\-\\-help\\fR\nprint a summary\n");
}

static void commands(const flesh_usage *usage)
{
  if (!usage->commands) return;
  printf(".SH COMMANDS\n");
  for (const flesh_subcommand *c = usage->commands; c->name; c++) {
    say(".TP\n\\fB", usage->command, " ");
    say("", c->name, "\\fR\n");
    say("", c->summary, "\n");
  }
}

/* Prints the manual page of "run", without its end; for "mesh info" a section of the page of "mesh". */
static void print_man(const flesh_usage *usage)
{
  if (strchr(usage->command, ' ')) { /* a section of its first word's page */
    say(".SH \"FLESH ", usage->command, "\"\n");
    synopsis(usage);
    say(".PP\n", usage->summary, "\n");
    if (usage->details) printf(".PP\n"), flesh_help_man_text(usage->details);
    options(usage);
    return;
  }
  char page[64];
  snprintf(page, sizeof page, "flesh-%s", usage->command);
  flesh_help_man_head(page, usage->summary);
  printf(".SH SYNOPSIS\n");
  synopsis(usage);
  printf(".SH DESCRIPTION\n");
  if (usage->details) flesh_help_man_text(usage->details);
  else say("", usage->summary, "\n");
  printf(".SH OPTIONS\n");
  options(usage);
  commands(usage);
  flesh_help_print_exits(usage->exits);
}

/* Prints a row of the table: an option or a command, its value's name (- if it takes none), what it does. */
static void print_row(const char *command, const char *before, const char *word, const char *argument, const char *doc)
{
  printf("%s\t%s%s\t%s\t", command, before, word, argument ? argument : "-");
  for (; *doc; doc++) putchar(*doc == '\n' ? ' ' : *doc);
  putchar('\n');
}

static void print_table(const flesh_usage *usage)
{
  for (const flesh_option *option = usage->options; option->name; option++)
    print_row(usage->command, option->kind == FLESH_OPTION_LIST ? "*--" : "--", option->name, option->argument, option->doc);
  for (const flesh_subcommand *c = usage->commands; c && c->name; c++) print_row(usage->command, "", c->name, NULL, c->summary);
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
  const char *blank = *command ? " " : "";
  printf("Usage: flesh%s%s COMMAND [ARGUMENT]...\n%s\nCommands:\n", blank, command, about);
  for (; list->name; list++) printf("  %-11s %s\n", list->name, list->summary);
  printf("\n`flesh%s%s COMMAND --help` describes a command.%s%s\n\n", blank, command, more ? " " : "", more ? more : "");
  flesh_help_print_exits(*command ? 0 : FLESH_EXITS_ALL);
}

/* Prints the help of all commands of a list. */
static void print_all(const flesh_subcommand *list)
{
  for (; list && list->name; list++) {
    char name[32], help[] = "--help", *words[] = {name, help, NULL};
    snprintf(name, sizeof name, "%s", list->name);
    list->run(2, words);
  }
}

void flesh_help_print(const flesh_usage *usage)
{
  static void (*const print[])(const flesh_usage *) = {[FLESH_HELP_TEXT] = print_text,
                                                       [FLESH_HELP_MAN] = print_man,
                                                       [FLESH_HELP_TABLE] = print_table};
  print[chosen](usage);
  if (chosen != FLESH_HELP_TEXT) print_all(usage->commands);
  if (chosen == FLESH_HELP_MAN && !strchr(usage->command, ' '))
    printf(".SH SEE ALSO\n\\fBflesh\\fR(1), \\fBflesh\\-scene\\fR(5)\n");
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
