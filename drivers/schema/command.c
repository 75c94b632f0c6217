/* command.c: `flesh schema`: the documentation of a scene's keys. */
#include "schema/command.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "shared/options.h"
#include "scene/schema.h"

static const char details[] =
    "Prints every key with what it may be, its default and its meaning, or only those of SECTION:\n"
    "body, body.material, solver, time.step, effects.pin, pin ... `flesh schema --format json >\n"
    "scene.schema.json` makes a JSON Schema (draft 2020-12) for editors and programs.\n";

static int read_format(const char *name, flesh_schema_format *format)
{
  int json = !strcmp(name, "json");
  *format = json ? FLESH_SCHEMA_JSON : FLESH_SCHEMA_MARKDOWN;
  if (json || !strcmp(name, "markdown")) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT, "--format is '%s'; it must be markdown or json", name);
}

int flesh_command_schema(int argc, char **argv)
{
  const char *format_name = "markdown";
  const flesh_option rows[] = {{"format", "FORMAT", FLESH_OPTION_TEXT, &format_name,
                                "markdown (tables to read, the default) or json"},
                               {0}};
  const flesh_usage usage = {"schema", "[SECTION]", "Documents the keys of a scene.", details, 0,
                             1,        rows};
  int positionals, code = flesh_options_read(&usage, argc, argv, &positionals);
  if (code != FLESH_OPTIONS_GO_ON) return code;
  flesh_schema_format format;
  char *text = NULL;
  int status = read_format(format_name, &format);
  if (!status) status = flesh_scene_schema_section(format, positionals ? argv[1] : NULL, &text);
  if (status) return flesh_command_fail("schema", status);
  fputs(text, stdout); /* whether it could be written is asked at the program's end */
  free(text);
  return 0;
}
