/* command.c: `flesh schema`: prints the documentation of a scene's keys and of results. */
#include "commands.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "cli/options.h"
#include "scene/schema.h"
#include "study/embedded.h"

/* Prints a section of results.txt: "result.json", "history.csv", "probes.csv" or "frames"; all of them for "results".
 * Returns 0 for any other name, and prints nothing. */
static int print_results(const char *section)
{
  static const char head[] = "\n## ";
  const char *at = flesh_own_text("results"), *next;
  const size_t size = strlen(section);
  if (!strcmp(section, "results")) return fputs(at, stdout) >= 0;
  while ((at = strstr(at, head)) && (strncmp(at += strlen(head), section, size) || at[size] != '\n')) continue;
  if (!at) return 0;
  next = strstr(at, head);
  printf("## %.*s", (int)(next ? next - at : (ptrdiff_t)strlen(at)), at);
  return 1;
}

int flesh_command_schema(int argc, char **argv)
{
  int format = FLESH_SCHEMA_MARKDOWN;
  const flesh_option rows[] = {{"format", "markdown|json|man|paths", FLESH_OPTION_CHOICE, &format, /* of flesh_schema_format */
                                "tables to read (default), JSON Schema, flesh-scene(5), or the paths of the keys"},
                               {0}};
  const flesh_usage usage = {"schema", "[SECTION]", "Documents the keys of a scene and the results of a run.",
                             flesh_own_text("schema_help"), 0, 1, rows, NULL, 0};
  int positionals, code = flesh_options_read(&usage, argc, argv, &positionals);
  if (code != FLESH_OPTIONS_GO_ON) return code;
  char *text = NULL;
  if (positionals && format == FLESH_SCHEMA_MARKDOWN && print_results(argv[1])) return 0;
  const int status = flesh_scene_schema_section((flesh_schema_format)format, positionals ? argv[1] : NULL, &text);
  if (status) return flesh_command_fail("schema", status);
  fputs(text, stdout); /* errors of stdout are checked at the end of the program */
  free(text);
  return 0;
}
