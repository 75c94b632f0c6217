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

static void print_commands(int zsh)
{
  printf(zsh ? "_flesh_commands=(" : "_flesh_commands='");
  for (const flesh_subcommand *c = flesh_help_commands; c->name; c++) {
    char row[160];
    snprintf(row, sizeof row, "%s:%s", c->name, c->summary);
    if (zsh) flesh_help_quote(row);
    else printf("%s", c->name);
    if (c[1].name) putchar(' ');
  }
  puts(zsh ? ")" : "'");
}

/* Prints the paths of a scene's keys with = behind each, as --set takes them. */
static int print_keys(int zsh)
{
  char *paths = NULL;
  int status = flesh_scene_schema_section(FLESH_SCHEMA_PATHS, NULL, &paths);
  if (status) return status;
  printf(zsh ? "_flesh_keys=(\n" : "_flesh_keys='\n");
  for (char *at = strtok(paths, "\n"); at; at = strtok(NULL, "\n")) printf(zsh ? "'%s='\n" : "%s=\n", at);
  puts(zsh ? ")" : "'");
  free(paths);
  return FLESH_OK;
}

/* Prints the script's branches, one for each command. */
static void print_branches(int zsh)
{
  flesh_help_set_format(zsh ? FLESH_HELP_ZSH : FLESH_HELP_BASH);
  flesh_help_print_all(flesh_help_commands);
}

int flesh_command_completion(int argc, char **argv)
{
  static const flesh_option none[] = {{0}};
  const flesh_usage usage = {"completion", "bash|zsh", "Prints the script by which a shell completes command lines.",
                             flesh_own_text("completion_help"), 1, 1, none, NULL, 0};
  int count, code = flesh_options_read(&usage, argc, argv, &count);
  if (code != FLESH_OPTIONS_GO_ON) return code;
  const int zsh = !strcmp(argv[1], "zsh");
  if (!zsh && strcmp(argv[1], "bash"))
    return flesh_command_refuse("completion", "there is no script for '%.100s'; the shell must be bash or zsh", argv[1]);
  /* Lines like @KEYS@ are replaced by what they name. */
  int status = FLESH_OK;
  for (const char *line = flesh_embedded_text(flesh_completions, argv[1]), *end; *line && !status; line = end) {
    end = line + strcspn(line, "\n") + 1;
    if (!strncmp(line, "@COMMANDS@", 10)) print_commands(zsh);
    else if (!strncmp(line, "@KEYS@", 6)) status = print_keys(zsh);
    else if (!strncmp(line, "@BRANCHES@", 10)) print_branches(zsh);
    else printf("%.*s", (int)(end - line), line);
  }
  return status ? flesh_command_fail("completion", status) : 0;
}
