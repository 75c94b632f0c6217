/* main.c: the `flesh` program: finds the command and runs it. */
#include <signal.h>
#include <stdio.h>
#include <string.h>

#include "command_accuracy.h"
#include "command_bench.h"
#include "command_check.h"
#include "command_drift.h"
#include "command_film.h"
#include "command_material.h"
#include "command_mesh.h"
#include "command_run.h"
#include "command_schema.h"
#include "command_skin.h"
#include "command_snap.h"
#include "command_stress.h"
#include "command_sweep.h"
#include "options.h"
#include "provenance.h"

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
    {"stress", flesh_command_stress, "put solver settings through a battery of hard cases"},
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

static void print_help(void)
{
  printf("Usage: flesh COMMAND [ARGUMENT]...\n"
         "Dynamics of soft, nearly incompressible bodies.\n\nCommands:\n");
  for (int c = 0; c < COMMAND_COUNT; c++)
    printf("  %-10s %s\n", commands[c].name, commands[c].summary);
  printf(
      "\n`flesh COMMAND --help` tells more about a command, `flesh --version` the version.\n\n%s",
      flesh_exit_codes_text);
}

int main(int argc, char **argv)
{
  /* Writing to a closed pipe or beyond a file's allowed size then fails like any other write. */
  signal(SIGPIPE, SIG_IGN);
  signal(SIGXFSZ, SIG_IGN);
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
    if (!found) {
      fprintf(stderr, "flesh: unknown command '%s'; the commands are", name);
      for (int c = 0; c < COMMAND_COUNT; c++)
        fprintf(stderr, "%s %s", c ? "," : "", commands[c].name);
      fputc('\n', stderr);
      return 2;
    }
    code = found->run(argc - 1, argv + 1);
  }
  if ((fflush(stdout) || ferror(stdout)) && !code) {
    fprintf(stderr, "flesh: standard output could not be written completely\n");
    code = 3;
  }
  return code;
}
