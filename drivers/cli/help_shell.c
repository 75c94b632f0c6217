/* help_shell.c: a command's options and commands as branches of the completion scripts of bash and zsh. */
#include "cli/help.h"

#include <stdio.h>
#include <string.h>

void flesh_help_quote(const char *word)
{
  putchar('\'');
  for (; *word; word++)
    if (*word == '\'') fputs("'\\''", stdout);
    else putchar(*word == '\n' ? ' ' : *word);
  putchar('\'');
}

static int takes_scene_keys(const flesh_option *option)
{
  return option->argument && !strcmp(option->argument, "KEY=VALUE");
}

static int takes_file(const flesh_option *option)
{
  static const char *const files[] = {"FILE", "DIR", "SCENE", "MESH"};
  for (size_t f = 0; f < sizeof files / sizeof *files; f++)
    if (!strncmp(option->argument, files[f], strlen(files[f]))) return 1;
  return 0;
}

/* The values that an option may have, with spaces between them. */
static void print_words(const flesh_option *option)
{
  for (const char *at = option->argument; *at; at++) putchar(*at == '|' ? ' ' : *at);
}

/* The branch sets `options`, `commands`, and `values` of the option before the word: a list, + for files, - for what
 * cannot be completed. */
void flesh_help_bash(const flesh_usage *usage)
{
  printf("    ");
  flesh_help_quote(usage->command);
  printf(")\n      options='");
  for (const flesh_option *option = usage->options; option->name; option++) printf("--%s ", option->name);
  printf("--help'\n");
  if (usage->commands) {
    printf("      commands='");
    for (const flesh_subcommand *c = usage->commands; c->name; c++) printf("%s%s", c == usage->commands ? "" : " ", c->name);
    printf("'\n");
  }
  printf("      case $2 in\n");
  for (const flesh_option *option = usage->options; option->name; option++) {
    if (!option->argument) continue;
    printf("        --%s) values=", option->name);
    if (takes_scene_keys(option)) printf("$_flesh_keys");
    else if (strchr(option->argument, '|')) putchar('\''), print_words(option), putchar('\'');
    else putchar(takes_file(option) ? '+' : '-');
    printf(" ;;\n");
  }
  printf("      esac ;;\n");
}

/* Within an argument of _arguments: brackets, colons and backslashes are its own signs. */
static void print_zsh(const char *text)
{
  for (; *text; text++) {
    if (strchr("[]:\\", *text)) putchar('\\');
    if (*text == '\'') fputs("'\\'", stdout);
    putchar(*text == '\n' ? ' ' : *text);
  }
}

void flesh_help_zsh(const flesh_usage *usage)
{
  printf("    ");
  flesh_help_quote(usage->command);
  printf(")\n");
  if (usage->commands) {
    printf("      commands=(");
    for (const flesh_subcommand *c = usage->commands; c->name; c++) {
      printf("'%s:", c->name);
      print_zsh(c->summary);
      printf("' ");
    }
    printf(")\n");
  }
  printf("      options=(\n");
  for (const flesh_option *option = usage->options; option->name; option++) {
    printf("        '%s--%s[", option->kind == FLESH_OPTION_LIST ? "*" : "", option->name);
    print_zsh(option->doc);
    printf("]");
    if (option->argument) {
      printf(":");
      print_zsh(option->argument);
      if (takes_scene_keys(option)) printf(":compadd -S \"\" -a _flesh_keys");
      else if (strchr(option->argument, '|')) printf(":("), print_words(option), putchar(')');
      else printf(takes_file(option) ? ":_files" : ": ");
    }
    printf("'\n");
  }
  printf("        '--help[print a summary]') ;;\n");
}
