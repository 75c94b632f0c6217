/* spec_check.c: whether a sweep's values are ones that the scene's keys take, and the fingerprint of its plan. */
#include <sha256.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/scan.h"
#include "scene/scene.h"
#include "sweep/spec.h"

int flesh_sweep_no_memory(void) { return flesh_fail(FLESH_ERR_MEMORY, "out of memory while reading a sweep"); }

static int check(const flesh_node *node, const char *scene, int count, const char **overrides)
{
  int status = flesh_scene_check_keys(scene, count, overrides);
  if (!status) return FLESH_OK;
  /* The spec's place instead of the words that a command line would have had. */
  char words[1600], prefix[1600];
  snprintf(words, sizeof words, "%s", flesh_error_text());
  snprintf(prefix, sizeof prefix, "--set %s: ", count ? overrides[count - 1] : "");
  const char *rest = strncmp(words, prefix, strlen(prefix)) ? words : words + strlen(prefix);
  flesh_fail(status, "%s", rest);
  return flesh_node_fail_within(status, node, "%s", "");
}

int flesh_sweep_check_values(flesh_sweep *sweep)
{
  if (sweep->command == FLESH_SWEEP_HARDCASES) return FLESH_OK; /* its cases' scenes are made when they are run */
  const char **overrides = calloc((size_t)sweep->set_count + 1, sizeof *overrides);
  int status = overrides ? FLESH_OK : flesh_sweep_no_memory();
  for (int s = 0; !status && s <= sweep->set_count; s++) {
    if (s) overrides[s - 1] = sweep->set[s - 1];
    status = check(s ? sweep->set_nodes[s - 1] : sweep->scene_node, sweep->scene, s, overrides);
  }
  for (int g = 0; !status && g < sweep->group_count; g++)
    for (int c = 0; !status && c < sweep->groups[g].columns; c++) {
      const flesh_sweep_column *column = &sweep->columns[sweep->groups[g].first + c];
      int count = sweep->groups[g].count, is_scene = !strcmp(column->key, "scene");
      const flesh_node *last = NULL;
      for (int k = 0; !status && k < count; k++) {
        /* Checks the ends of a range, and some values of a list that is sampled again and again. */
        if (!column->nodes[k] && k && k < count - 1) continue;
        if ((k > 200 || column->nodes[k] == last) && last) continue;
        last = column->nodes[k];
        char *text = malloc(strlen(column->key) + strlen(column->values[k]) + 2);
        if (!text) status = flesh_sweep_no_memory();
        else {
          sprintf(text, "%s=%s", column->key, column->values[k]);
          overrides[sweep->set_count] = text;
          status = check(last ? last : column->place, is_scene ? column->values[k] : sweep->scene,
                         sweep->set_count + !is_scene, overrides);
        }
        free(text);
      }
    }
  free(overrides);
  return status;
}

static int hash_file(SHA2_CTX *context, const char *path)
{
  char *text;
  size_t size;
  int status = flesh_file_load(path, &text, &size);
  if (status) return status;
  SHA256Update(context, (const uint8_t *)text, size);
  free(text);
  return FLESH_OK;
}

static void hash_text(SHA2_CTX *context, const char *text)
{
  SHA256Update(context, (const uint8_t *)text, strlen(text) + 1);
}

/* Hashes what all cases have in common. */
static void hash_common(SHA2_CTX *context, const flesh_sweep *sweep)
{
  char numbers[120];
  snprintf(numbers, sizeof numbers, "%d %d %d %.17g", sweep->command, sweep->repeats > 1, sweep->seed, sweep->max_seconds);
  hash_text(context, numbers);
  for (int k = 0; k < sweep->set_count; k++) hash_text(context, sweep->set[k]);
  for (int k = 0; k < sweep->argument_count; k++) hash_text(context, sweep->arguments[k]);
  for (int k = 0; k < sweep->column_count; k++)
    hash_text(context, sweep->columns[k].name), hash_text(context, sweep->columns[k].key);
  for (int k = 0; k < sweep->derived_count; k++)
    hash_text(context, sweep->derived[k].name), hash_text(context, sweep->derived[k].expression);
}

int flesh_sweep_make_fingerprint(flesh_sweep *sweep)
{
  SHA2_CTX context;
  SHA256Init(&context);
  /* Folders of cases have the numbers of the spec's cases, which must stay. */
  if (flesh_sweep_has_folders(sweep)) hash_text(&context, sweep->text);
  else hash_common(&context, sweep);
  int status = sweep->scene ? hash_file(&context, sweep->scene) : FLESH_OK;
  for (int g = 0; !status && g < sweep->group_count; g++)
    for (int c = 0; !status && c < sweep->groups[g].columns; c++) {
      const flesh_sweep_column *column = &sweep->columns[sweep->groups[g].first + c];
      for (int k = 0; !strcmp(column->key, "scene") && !status && k < sweep->groups[g].count; k++)
        status = hash_file(&context, column->values[k]);
    }
  SHA256End(&context, sweep->fingerprint);
  return status;
}
