/* command_schema.c: `flesh schema`: the documentation of a scene's keys. */
#include "command_schema.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "scene/schema.h"

enum { EXIT_FINE = 0, EXIT_USAGE = 2, EXIT_FILE = 3 };

static const char help[] =
    "usage: flesh schema [--format markdown|json] [SECTION]\n"
    "\n"
    "Prints every key of a scene with what it may be, its default and its meaning.\n"
    "  SECTION              only a part: body, body.material, solver, time.step, effects.pin, pin "
    "...\n"
    "  --format markdown    tables to read (the default)\n"
    "  --format json        JSON Schema, draft 2020-12, for editors and programs\n"
    "Exit codes: 0 fine, 2 usage, 3 the output cannot be written.\n"
    "Example: flesh schema --format json > scene.schema.json\n";

static int misuse(const char *what, const char *argument)
{
  fprintf(stderr, "flesh schema: %s '%s'; see flesh schema --help\n", what, argument);
  return EXIT_USAGE;
}

static int read_format(const char *name, flesh_schema_format *format)
{
  int json = !strcmp(name, "json");
  *format = json ? FLESH_SCHEMA_JSON : FLESH_SCHEMA_MARKDOWN;
  return json || !strcmp(name, "markdown") ? 0 : misuse("--format is markdown or json, not", name);
}

int flesh_command_schema(int argc, char **argv)
{
  static const char option[] = "--format";
  const size_t length = sizeof option - 1;
  flesh_schema_format format = FLESH_SCHEMA_MARKDOWN;
  const char *section = NULL;
  for (int a = 1; a < argc; a++) {
    int bad = 0;
    if (!strcmp(argv[a], "--help") || !strcmp(argv[a], "-h")) {
      fputs(help, stdout);
      return EXIT_FINE;
    }
    if (!strcmp(argv[a], option))
      bad = a + 1 < argc ? read_format(argv[++a], &format) : misuse("no value for", option);
    else if (!strncmp(argv[a], option, length) && argv[a][length] == '=')
      bad = read_format(argv[a] + length + 1, &format);
    else if (argv[a][0] == '-') bad = misuse("unknown option", argv[a]);
    else if (section) bad = misuse("one section at most, but there is also", argv[a]);
    else section = argv[a];
    if (bad) return bad;
  }
  char *text;
  int status = flesh_scene_schema_section(format, section, &text);
  if (status) {
    fprintf(stderr, "flesh schema: %s\n", flesh_error_text());
    return EXIT_USAGE;
  }
  int failed = fputs(text, stdout) < 0 || fflush(stdout);
  free(text);
  if (failed) perror("flesh schema: standard output");
  return failed ? EXIT_FILE : EXIT_FINE;
}
