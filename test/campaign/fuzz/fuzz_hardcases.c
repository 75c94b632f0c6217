/* fuzz_hardcases.c: files of hard cases. The effects of a valid case are a list that a scene's reader accepts. */
#define _GNU_SOURCE
#include "fuzz.h"

#include "hardcases/cases.h"
#include "scene/effect_list.h"

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
  (void)argc, (void)argv;
  fuzz_start();
  return 0;
}

static void read_again(const char *effects)
{
  flesh_arena arena = {0};
  flesh_node *list = NULL;
  flesh_objects entries;
  const flesh_key_reader reader = {&arena, NULL};
  const flesh_source source = {"effects", 0};
  fuzz_expect(!flesh_yaml_parse(&arena, effects, strlen(effects), &source, &list), "effects that are not YAML");
  if (list) fuzz_expect(!flesh_effect_key_list.read(&reader, list, "effects", &entries), "effects that are not read");
  flesh_arena_free(&arena);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
  flesh_hardcases_battery battery;
  fuzz_write("cases.yaml", data, size);
  int status = flesh_hardcases_open_battery("cases.yaml", "battery", &battery);
  fuzz_status(status);
  if (!status) fuzz_expect(battery.count >= 1, "a battery without a case");
  for (int k = 0; !status && k < battery.count; k++) {
    const flesh_hardcases_case *row = &battery.cases[k];
    fuzz_expect(row->amount - row->amount == 0 && row->noise >= 0, "a start that is not finite");
    fuzz_expect(!strchr(row->doc, '\n') && !strchr(row->name, '/'), "a name or a line that is none");
    read_again(row->effects);
  }
  flesh_hardcases_close_battery(&battery);
  return 0;
}
