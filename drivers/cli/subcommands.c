/* subcommands.c: chooses one of a command's commands. */
#include "cli/subcommands.h"

#include <stdio.h>
#include <string.h>

#include "cli/help.h"
#include "cli/options.h"

int flesh_subcommand_run(const char *command, const char *about, const char *more, const flesh_subcommand *list,
                         int argc, char **argv)
{
  const char *name = argc > 1 ? argv[1] : NULL;
  if (name && (!strcmp(name, "--help") || !strcmp(name, "-h"))) {
    flesh_help_print_list(command, about, more, list);
    return 0;
  }
  char known[128] = "";
  for (int k = 0; list[k].name; k++) {
    if (name && !strcmp(name, list[k].name)) return list[k].run(argc - 1, argv + 1);
    const size_t length = strlen(known);
    snprintf(known + length, sizeof known - length, "%s%s", !k ? "" : list[k + 1].name ? ", " : " and ", list[k].name);
  }
  if (!name) return flesh_command_refuse(command, "no command given; the commands are %s", known);
  return flesh_command_refuse(command, "unknown command '%.100s'; the commands are %s", name, known);
}
