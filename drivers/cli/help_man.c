/* help_man.c: a command's help as a manual page in roff. */
#include "cli/help.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "flesh/version.h"
#include "scene/roff.h"

/* `text` between `before` and `after`, which are roff. */
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

void flesh_help_man_exits(unsigned exits)
{
  printf(".SH EXIT STATUS\n");
  for (const flesh_exit_row *row = flesh_exit_rows; row->code; row++) {
    if (row->exits && !(row->exits & exits)) continue;
    say(".TP\n", row->code, "\n");
    say("", row->doc, "\n");
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

void flesh_help_man(const flesh_usage *usage)
{
  if (strchr(usage->command, ' ')) { /* within the page of its first word */
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
  flesh_help_man_exits(usage->exits);
}

void flesh_help_man_end(void) { printf(".SH SEE ALSO\n\\fBflesh\\fR(1), \\fBflesh\\-scene\\fR(5)\n"); }
