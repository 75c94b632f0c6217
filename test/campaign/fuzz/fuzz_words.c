/* fuzz_words.c: values on the command line of every command that takes more than names; the first byte selects the
 * command. Lists and numbers are read before anything else is done, and what would follow fails: the scene does not
 * exist, or a file is in the place of the results' folder. */
#define _GNU_SOURCE
#include "fuzz.h"

#include "commands.h"
#include "cli/overrides.h"
#include "cli/lists.h"
#include "picture/snapshot.h"

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
  (void)argc, (void)argv;
  fuzz_start();
  fuzz_write("file", "", 0);
  return 0;
}

/* NULL is replaced by the value. */
static const struct {
  int (*run)(int argc, char **argv);
  const char *words[12];
  int count;
} commands[] = {
    {flesh_command_bench, {"bench", "--out", "file", "--cells", NULL}, 5},
    {flesh_command_bench, {"bench", "--out", "file", "--energies", NULL}, 5},
    {flesh_command_bench, {"bench", "--out", "file", "--poisson", NULL}, 5},
    {flesh_command_bench, {"bench", "--out", "file", "--threads", NULL}, 5},
    {flesh_command_bench, {"bench", "--out", "file", "--cases", NULL}, 5},
    {flesh_command_bench, {"bench", "--out", "file", "--steps", NULL}, 5},
    {flesh_command_drift, {"drift", "none", "--out", "file", "--energies", NULL}, 6},
    {flesh_command_drift, {"drift", "none", "--out", "file", "--poisson", NULL}, 6},
    {flesh_command_drift, {"drift", "none", "--out", "file", "--solvers", NULL}, 6},
    {flesh_command_accuracy, {"accuracy", "none", "--out", "file", "--methods", NULL}, 6},
    {flesh_command_accuracy, {"accuracy", "none", "--out", "file", "--tolerances", NULL}, 6},
    {flesh_command_accuracy, {"accuracy", "none", "--out", "file", "--steps", NULL}, 6},
    {flesh_command_hardcases, {"hardcases", "--out", "file", "--energies", NULL}, 5},
    {flesh_command_hardcases, {"hardcases", "--out", "file", "--poisson", NULL}, 5},
    {flesh_command_hardcases, {"hardcases", "--out", "file", "--steps", NULL}, 5},
    {flesh_command_hardcases, {"hardcases", "--out", "file", "--cases", NULL}, 5},
    {flesh_command_hardcases, {"hardcases", "--out", "file", "--solvers", NULL}, 5},
    {flesh_command_material, {"material", "--out", "file", "--energies", NULL}, 5},
    {flesh_command_material, {"material", "--out", "file", "--poisson", NULL}, 5},
    {flesh_command_sweep, {"sweep", "none", "--out", "file", "--shard", NULL}, 6},
    {flesh_command_skin, {"skin", "apply", "none", "none", "none", "--out", "file", "--formats", NULL}, 9},
    {flesh_command_snap, {"snap", "none", "--out", "file.png", "--time", NULL}, 6},
    {flesh_command_snap, {"snap", "none", "--out", "file.png", "--frame", NULL}, 6},
    {flesh_command_film, {"film", "none", "--out", "file", "--fps", NULL}, 6},
    {flesh_command_run, {"run", "none", "--out", "file", "--set", NULL}, 6},
    {flesh_command_run, {"run", "none", "--out", "file", "--max-seconds", NULL}, 6},
    {flesh_command_run, {"run", "none", "--out", "file", "--method", NULL}, 6},
    {flesh_command_schema, {"schema", NULL}, 2},
    {flesh_command_mesh, {"mesh", "box", "--cells", "0,0,0", "--size", NULL, "--out", "file/none.msh"}, 8},
    {flesh_command_mesh, {"mesh", "box", "--cells", "1,1,1", "--size", "1,1,1", "--origin", NULL, "--out",
                          "file/none.msh"}, 10},
    {flesh_command_mesh, {"mesh", "box", "--size", "0,0,0", "--out", "file/none.msh", "--cells", NULL}, 8},
};
enum { COMMANDS = sizeof commands / sizeof *commands };

static void try_lists(const char *text)
{
  double values[8];
  int count = flesh_list_parse(text, 8, values);
  fuzz_expect(count >= 0 && count <= 8, "the number of numbers");
  for (int k = 0; k < count; k++) fuzz_expect(values[k] - values[k] == 0, "a number that is not finite");
  flesh_overrides overrides = {0};
  flesh_overrides_add_text(&overrides, "body.mesh", text);
  fuzz_expect(!overrides.failed, "an override");
  flesh_overrides_close(&overrides);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
  if (!size) return 0;
  int which = *data % (COMMANDS + 1);
  char *text = strndup((const char *)data + 1, size - 1), *argv[16] = {NULL};
  if (which == COMMANDS) {
    try_lists(text);
  } else {
    int count = commands[which].count;
    for (int k = 0; k < count; k++) argv[k] = (char *)(commands[which].words[k] ? commands[which].words[k] : text);
    int code = commands[which].run(count, argv);
    int documented = code >= 0 && code <= 7 && code != 1;
    fuzz_expect(documented, "an exit code that is not documented");
  }
  free(text);
  return 0;
}
