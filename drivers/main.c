/* main.c: the `flesh` program: finds the command and runs it. */
#include <signal.h>
#include <stdio.h>
#include <string.h>

#include "accuracy/command.h"
#include "bench/command.h"
#include "check/command.h"
#include "drift/command.h"
#include "film/command.h"
#include "hardcases/command.h"
#include "material/command.h"
#include "mesh/command.h"
#include "run/command.h"
#include "schema/command.h"
#include "skin/command.h"
#include "snap/command.h"
#include "sweep/command.h"
#include "shared/json_memory.h"
#include "shared/options.h"
#include "shared/provenance.h"

typedef struct command {
  const char *name;
  int (*run)(int argc, char **argv);
  const char *summary;
} command;

/* A command is a row here, an include above and its file in drivers/meson.build. */
static const command commands[] = {
    {"run", flesh_command_run, "simulate a scene and write its history, frames and result"},
    {"accuracy", flesh_command_accuracy, "show what accuracy costs in time, method by method"},
    {"drift", flesh_command_drift, "compare how well the energies keep the volume"},
    {"hardcases", flesh_command_hardcases, "put solver settings through a battery of hard cases"},
    {"bench", flesh_command_bench, "measure flesh against the limits of this machine"},
    {"sweep", flesh_command_sweep, "run many cases from one spec into one database"},
    {"material", flesh_command_material, "compare the energies along simple deformations"},
    {"snap", flesh_command_snap, "draw frames of runs side by side"},
    {"film", flesh_command_film, "film runs side by side"},
    {"skin", flesh_command_skin, "let a fine surface follow a body's tets"},
    {"mesh", flesh_command_mesh, "inspect, convert and make meshes"},
    {"schema", flesh_command_schema, "document the keys of a scene"},
    {"check", flesh_command_check, "validate a scene and differentiate its effects"},
};
enum { COMMAND_COUNT = sizeof commands / sizeof commands[0] };

/* The names of earlier versions. */
static const struct {
  const char *old, *name;
} renamed[] = {{"stress", "hardcases"}};

static void print_help(void)
{
  printf("Usage: flesh COMMAND [ARGUMENT]...\n"
         "Dynamics of soft, nearly incompressible bodies.\n\nCommands:\n");
  for (int c = 0; c < COMMAND_COUNT; c++)
    printf("  %-10s %s\n", commands[c].name, commands[c].summary);
  printf(
      "\n`flesh COMMAND --help` describes a command, `flesh --version` prints the version.\n\n%s",
      flesh_exit_codes_text);
}

int main(int argc, char **argv)
{
  /* Writing to a closed pipe or beyond a file's allowed size then fails like any other write. */
  signal(SIGPIPE, SIG_IGN);
  signal(SIGXFSZ, SIG_IGN);
  flesh_json_watch();
  if (argc < 2) {
    fprintf(stderr, "flesh: no command given; `flesh --help` lists them\n");
    return 2;
  }
  const char *name = argv[1];
  int code = 2;
  if (!strcmp(name, "--help") || !strcmp(name, "-h") || (!strcmp(name, "help") && argc == 2)) {
    print_help();
    code = 0;
  } else if (!strcmp(name, "--version")) {
    flesh_provenance_print_version();
    code = 0;
  } else {
    const command *found = NULL;
    for (int c = 0; c < COMMAND_COUNT; c++)
      if (!strcmp(name, commands[c].name)) found = &commands[c];
    for (size_t r = 0; r < sizeof renamed / sizeof renamed[0]; r++)
      if (!strcmp(name, renamed[r].old))
        return flesh_command_refuse("", "the command %s has been renamed; write flesh %s", name, renamed[r].name);
    if (!found) {
      char known[256];
      size_t used = 0;
      for (int c = 0; c < COMMAND_COUNT && used < sizeof known; c++)
        used += (size_t)snprintf(known + used, sizeof known - used, "%s %s", c ? "," : "", commands[c].name);
      return flesh_command_refuse("", "unknown command '%.100s'; the commands are%s", name, known);
    }
    code = found->run(argc - 1, argv + 1);
  }
  if ((fflush(stdout) || ferror(stdout)) && !code) {
    fprintf(stderr, "flesh: standard output could not be written completely\n");
    code = 3;
  }
  return code;
}
