/* subcommands.c: chooses one of a command's commands. */
#include "shared/subcommands.h"

#include <stdio.h>
#include <string.h>

#include "shared/options.h"

static int print_help(const char *command, const char *about, const char *more, const flesh_subcommand *list)
{
  printf("Usage: flesh %s COMMAND [ARGUMENT]...\n%s\nCommands:\n", command, about);
  for (; list->name; list++) printf("  %-10s %s\n", list->name, list->summary);
  printf("\n`flesh %s COMMAND --help` describes a command.%s%s\n\n%s", command, more ? " " : "", more ? more : "",
         flesh_exit_codes_text);
  return 0;
}

int flesh_subcommand_run(const char *command, const char *about, const char *more, const flesh_subcommand *list,
                         int argc, char **argv)
{
  const char *name = argc > 1 ? argv[1] : NULL;
  if (name && (!strcmp(name, "--help") || !strcmp(name, "-h"))) return print_help(command, about, more, list);
  char known[128] = "";
  for (int k = 0; list[k].name; k++) {
    if (name && !strcmp(name, list[k].name)) return list[k].run(argc - 1, argv + 1);
    const size_t length = strlen(known);
    snprintf(known + length, sizeof known - length, "%s%s", !k ? "" : list[k + 1].name ? ", " : " and ", list[k].name);
  }
  if (!name) return flesh_command_refuse(command, "no command given; the commands are %s", known);
  return flesh_command_refuse(command, "unknown command '%.100s'; the commands are %s", name, known);
}
