/* command.c: `flesh completion`: prints scripts that complete command lines, made from the tables that --help
 * prints. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "scene/schema.h"
#include "cli/help.h"
#include "cli/options.h"
#include "study/embedded.h"

/* Prints the paths of a scene's keys with = behind each, as --set takes them. */
static int print_keys(void)
{
  char *paths = NULL;
  int status = flesh_scene_schema_section(FLESH_SCHEMA_PATHS, NULL, &paths);
  if (status) return status;
  for (char *at = strtok(paths, "\n"); at; at = strtok(NULL, "\n")) printf("%s=\n", at);
  free(paths);
  return FLESH_OK;
}

int flesh_command_completion(int argc, char **argv)
{
  static const flesh_option none[] = {{0}};
  const flesh_usage usage = {"completion", "bash|zsh", "Prints the script by which a shell completes command lines.",
                             flesh_own_text("completion_help"), 1, 1, none, NULL, 0};
  int count, code = flesh_options_read(&usage, argc, argv, &count);
  if (code != FLESH_OPTIONS_GO_ON) return code;
  if (strcmp(argv[1], "zsh") && strcmp(argv[1], "bash"))
    return flesh_command_refuse("completion", "there is no script for '%.100s'; the shell must be bash or zsh", argv[1]);
  const flesh_usage all = {.command = "flesh", .options = none, .commands = flesh_help_commands};
  flesh_help_set_format(FLESH_HELP_TABLE);
  /* Lines like @KEYS@ are replaced by what they name. */
  int status = FLESH_OK;
  for (const char *line = flesh_embedded_text(flesh_completions, argv[1]), *end; *line && !status; line = end) {
    end = line + strcspn(line, "\n") + 1;
    if (!strncmp(line, "@KEYS@", 6)) status = print_keys();
    else if (!strncmp(line, "@TABLE@", 7)) flesh_help_print(&all);
    else printf("%.*s", (int)(end - line), line);
  }
  return status ? flesh_command_fail("completion", status) : 0;
}
