/* settings.c: reads specs by tables of keys, and the keys of scenes that specs set; condenses a scene into a
 * fingerprint. */
#include "study/settings.h"

#include <sha256.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/scan.h"
#include "scene/scene.h"

const char *const flesh_spacings[] = {"linear", "logarithmic", NULL};

int flesh_keyed_text_read(flesh_arena *arena, const flesh_keyed_text *text, const flesh_key *keys, flesh_node **root,
                          void *target)
{
  const flesh_source source = {text->path, 0};
  const flesh_key whole = {.type = FLESH_KEY_OBJECT, .children = keys};
  char expected[FLESH_EXPECTATION_SIZE];
  int status = flesh_yaml_parse(arena, text->text, text->size, &source, root);
  if (status) return status;
  if (!*root)
    return flesh_fail(FLESH_ERR_ARGUMENT, "%s:1:1: %s is empty; it must be %s", text->path, text->what,
                      flesh_key_expectation(&whole, expected));
  if ((*root)->kind != FLESH_NODE_MAPPING) return flesh_key_fail(&whole, *root, text->what);
  const char *slash = strrchr(text->path, '/');
  const size_t folder = slash ? (size_t)(slash - text->path) + (slash == text->path) : 0;
  const flesh_key_reader reader = {arena, flesh_arena_text(arena, text->path, folder)};
  if (!reader.directory) return flesh_fail(FLESH_ERR_MEMORY, "out of memory while reading %s", text->what);
  return flesh_keys_read(&reader, keys, *root, *root, "", target);
}

int flesh_spec_read(flesh_arena *arena, const char **path, char **text, const flesh_key *keys, flesh_node **root, void *target)
{
  size_t size;
  *path = flesh_arena_print(arena, "%s", *path);
  if (!*path) return flesh_no_memory();
  const int status = flesh_file_load(*path, text, &size);
  return status ? status : flesh_keyed_text_read(arena, &(flesh_keyed_text){*path, *text, size, "the spec"}, keys, root, target);
}

static int is_path(const char *key)
{
  const flesh_key *keys = flesh_scene_table, *found = NULL;
  char word[64];
  if (!strcmp(key, "scene")) return 1;
  for (const char *at = key; *at && keys;) {
    size_t size = strcspn(at, ".[");
    if (!size || size >= sizeof word) return 0;
    snprintf(word, sizeof word, "%.*s", (int)size, at);
    found = flesh_key_named(keys, word);
    if (!found) return 0;
    keys = found->children;
    at += size + (at[size] == '.');
  }
  return found && found->type == FLESH_KEY_PATH;
}

const char *flesh_setting_value(flesh_arena *arena, const char *spec, const char *key, const flesh_node *node)
{
  flesh_text text = {0};
  const char *slash = strrchr(spec, '/');
  if (node->kind == FLESH_NODE_SCALAR && is_path(key)) {
    char *whole = *node->text == '/' || !slash
                      ? flesh_arena_print(arena, "%s", node->text)
                      : flesh_arena_print(arena, "%.*s/%s", (int)(slash - spec), spec, node->text);
    if (!whole || !strcmp(key, "scene")) return whole;
    flesh_text_quote(&text, whole);
  } else flesh_node_write_flow(node, 1, &text);
  const char *value = text.failed ? NULL : flesh_arena_print(arena, "%s", text.data ? text.data : "");
  free(text.data);
  return value;
}

int flesh_settings_read(flesh_arena *arena, const char *spec, const flesh_node *set, flesh_settings *settings)
{
  char shown[FLESH_SHOW_SIZE];
  if (!set || flesh_node_is_null(set)) return FLESH_OK;
  if (set->kind != FLESH_NODE_MAPPING)
    return flesh_node_fail(set, "set is %s; it must be a mapping such as {time.end: 1}", flesh_node_show(set, shown));
  settings->texts = flesh_arena_take(arena, sizeof(char *) * (size_t)set->count);
  settings->nodes = flesh_arena_take(arena, sizeof(flesh_node *) * (size_t)set->count);
  if (!settings->texts || !settings->nodes) return flesh_no_memory();
  for (const flesh_node *child = set->first; child; child = child->next) {
    const char *value = flesh_setting_value(arena, spec, child->key, child);
    const char *text = value ? flesh_arena_print(arena, "%s=%s", child->key, value) : NULL;
    if (!text) return flesh_no_memory();
    settings->nodes[settings->count] = child;
    settings->texts[settings->count++] = text;
  }
  return FLESH_OK;
}

int flesh_settings_check(const flesh_node *place, const char *scene, int count, const char **overrides)
{
  int status = flesh_scene_check_keys(scene, count, overrides);
  if (!status) return FLESH_OK;
  /* Replace the prefix for a command line by the place in the spec. */
  char words[1600], prefix[1600];
  snprintf(words, sizeof words, "%s", flesh_error_text());
  snprintf(prefix, sizeof prefix, "--set %s: ", count ? overrides[count - 1] : "");
  const char *rest = strncmp(words, prefix, strlen(prefix)) ? words : words + strlen(prefix);
  flesh_fail(status, "%s", rest);
  return flesh_node_fail_within(status, place, "%s", "");
}

char *flesh_setting_name(flesh_arena *arena, const char *key, char **whole)
{
  const char *dot = strrchr(key, '.');
  *whole = flesh_arena_print(arena, "%s", key);
  if (!*whole) return NULL;
  for (char *letter = *whole; *letter; letter++)
    if (strchr(".[]", *letter)) *letter = '_';
  const size_t length = strlen(*whole);
  if (length && (*whole)[length - 1] == '_') (*whole)[length - 1] = 0;
  return *whole + (dot ? dot + 1 - key : 0);
}

int flesh_setting_check_name(const flesh_node *place, const char *name)
{
  static const char letters[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_0123456789";
  if (strspn(name, letters) == strlen(name) && !(*name >= '0' && *name <= '9')) return FLESH_OK;
  char shown[FLESH_SHOW_SIZE];
  return flesh_node_fail(place, "name is %s; it must be of letters, digits and _", flesh_word_show(name, shown));
}

/* Prints a table of keys, with the tables below it except `apart`. */
static void describe(FILE *stream, const flesh_key *keys, const flesh_key *apart, int indent)
{
  char expected[FLESH_EXPECTATION_SIZE];
  for (; keys->name; keys++) {
    fprintf(stream, "%*s%-*s %s", indent, "", 14 - indent, keys->name, keys->doc);
    if (keys->type == FLESH_KEY_CHOICE || keys->type == FLESH_KEY_NUMBER || keys->type == FLESH_KEY_INTEGER)
      fprintf(stream, " (%s)", flesh_key_expectation(keys, expected));
    if (keys->default_value && *keys->default_value && !keys->children && !strstr(keys->default_value, "inf"))
      fprintf(stream, "; default %s", keys->default_value);
    putc('\n', stream);
    if (keys->children && keys->children != apart) describe(stream, keys->children, apart, indent + 2);
  }
}

char *flesh_settings_help(const char *before, const flesh_settings_part *parts, const char *after)
{
  char *text = NULL;
  size_t size;
  FILE *stream = open_memstream(&text, &size);
  if (!stream) return NULL;
  fputs(before, stream);
  for (; parts->title; parts++) {
    fprintf(stream, "%s:\n", parts->title);
    describe(stream, parts->keys, parts->apart, 2);
  }
  fputs(after, stream);
  fclose(stream);
  return text;
}

int flesh_settings_hash_file(SHA2_CTX *context, const char *path)
{
  char *text;
  size_t size;
  int status = flesh_file_load(path, &text, &size);
  if (status) return status;
  SHA256Update(context, (const uint8_t *)text, size);
  free(text);
  return FLESH_OK;
}

static void add(SHA2_CTX *hash, const void *data, size_t size) { SHA256Update(hash, data, size); }

int flesh_study_fingerprint(const flesh_scene *scene, const char *path, char text[FLESH_STUDY_FINGERPRINT])
{
  SHA2_CTX hash;
  flesh_text values = {0};
  const flesh_mesh *mesh = flesh_scene_mesh(scene);
  const size_t size = 3 * (size_t)flesh_mesh_node_count(mesh) * sizeof(double), tets = (size_t)flesh_mesh_tet_count(mesh);
  *text = 0;
  flesh_scene_print(scene, &values);
  const int lacks = values.failed;
  if (!lacks) {
    SHA256Init(&hash);
    add(&hash, values.data, values.size);
    add(&hash, scene->start.x, size);
    add(&hash, scene->start.v, size);
    add(&hash, flesh_mesh_positions(mesh), size);
    add(&hash, flesh_mesh_tets(mesh), 4 * sizeof(int) * tets);
    if (flesh_mesh_order(mesh) == 2) add(&hash, flesh_mesh_tet_edges(mesh), 6 * sizeof(int) * tets);
    SHA256End(&hash, text);
  }
  free(values.data);
  return lacks ? flesh_no_memory_for(path) : FLESH_OK;
}
