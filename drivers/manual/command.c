/* command.c: `flesh manual`: prints manual pages, made from the tables that --help prints. */
#include "commands.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "scene/schema.h"
#include "cli/help.h"
#include "cli/options.h"
#include "study/embedded.h"

static void print_program(void)
{
  flesh_help_man_head("flesh", "Dynamics of soft, nearly incompressible bodies.");
  printf(".SH SYNOPSIS\n\\fBflesh\\fR \\fICOMMAND\\fR [\\fIARGUMENT\\fR]...\n.br\n\\fBflesh\\fR \\-\\-help | \\-\\-version\n"
         ".SH DESCRIPTION\n");
  flesh_help_man_text("Stable neo-Hookean finite elements on tetrahedra, solved and integrated by SUNDIALS. A scene, whose keys "
                      "are in\nflesh-scene(5), says what the body is, what acts on it and how time goes on; `flesh run` "
                      "simulates it.\n");
  printf(".SH COMMANDS\n");
  for (const flesh_subcommand *c = flesh_help_commands; c->name; c++)
    printf(".TP\n\\fBflesh\\-%s\\fR(1)\n%s\n", c->name, c->summary);
  flesh_help_print_exits(FLESH_EXITS_ALL);
  printf(".SH SEE ALSO\n\\fBflesh\\-scene\\fR(5)\n");
}

static int print_scene(void)
{
  char *text = NULL;
  int status = flesh_scene_schema_section(FLESH_SCHEMA_MAN, NULL, &text);
  if (status) return flesh_command_fail("manual", status);
  fputs(text, stdout);
  free(text);
  return 0;
}

int flesh_command_manual(int argc, char **argv)
{
  static const flesh_option none[] = {{0}};
  const flesh_usage usage = {"manual", "[COMMAND]", "Prints a manual page.", flesh_own_text("manual_help"), 0, 1, none, NULL, 0};
  int count, code = flesh_options_read(&usage, argc, argv, &count);
  if (code != FLESH_OPTIONS_GO_ON) return code;
  flesh_help_set_format(FLESH_HELP_MAN);
  if (!count || !strcmp(argv[1], "flesh")) {
    print_program();
    return 0;
  }
  if (!strcmp(argv[1], "scene")) return print_scene();
  for (const flesh_subcommand *c = flesh_help_commands; c->name; c++) {
    char help[] = "--help", *words[] = {argv[1], help, NULL};
    if (strcmp(c->name, argv[1])) continue;
    return c->run(2, words);
  }
  return flesh_command_refuse("manual", "'%.100s' has no page; `flesh --help` lists the commands, and there is scene", argv[1]);
}
