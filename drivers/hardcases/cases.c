/* cases.c: reads hard cases by a table of keys, as scenes are read. */
#include "hardcases/cases.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/letter.h"
#include "base/scan.h"
#include "scene/effect_list.h"
#include "study/embedded.h"
#include "study/settings.h"

/* Limits: cases in a file; letters of a name; columns of a line in a scene. */
enum { CASE_LIMIT = 1024, WORD_LIMIT = 40, LINE_LIMIT = 120 };

#define NAME(id, name, ...) name,
static const char *const meshes[] = {FLESH_HARDCASES_MESH_LIST(NAME) NULL};
static const char *const starts[] = {FLESH_HARDCASES_START_LIST(NAME) NULL};
static const char *const holds[] = {"nothing", "face", "feet", NULL};
static const char *const ends[] = {"recovery", "equilibrium", "recovery-to-0.495", NULL};

#define AT(member) .offset = offsetof(flesh_hardcases_case, member)
static const flesh_key start_table[] = {
    {.name = "kind", .type = FLESH_KEY_CHOICE, AT(start), .choices = starts, .default_value = "rest",
     .doc = "where the nodes start"},
    {.name = "amount", .type = FLESH_KEY_NUMBER, AT(amount), .default_value = "",
     .doc = "a factor (scale-x, scale), edges (jitter), turns (twist), turns per step (spin), lengths (throw, gauss), m (fly) "
            "or m/s (speed)"},
    {.name = "noise", .type = FLESH_KEY_NUMBER, AT(noise), .range = FLESH_RANGE_NOT_NEGATIVE, .default_value = "0",
     .doc = "every coordinate is moved besides by up to this part of the node's mean edge"},
    {.name = NULL},
};

static const flesh_key release_table[] = {
    {.name = "seconds", .type = FLESH_KEY_NUMBER, AT(release), .range = FLESH_RANGE_POSITIVE, .unit = "s",
     .doc = "length of a second phase without the effects"},
    {.name = "step", .type = FLESH_KEY_NUMBER, AT(release_step), .range = FLESH_RANGE_POSITIVE, .unit = "s",
     .default_value = "", .doc = "default 1/60"},
    {.name = NULL},
};

static const flesh_key case_table[] = {
    {.name = "name", .type = FLESH_KEY_TEXT, AT(name),
     .doc = "of the case and of its runs' folders, at most 40 letters, digits and _.-+"},
    {.name = "group", .type = FLESH_KEY_TEXT, AT(group),
     .doc = "cases that stand together in pictures; --cases takes it, too"},
    {.name = "doc", .type = FLESH_KEY_TEXT, AT(doc), .doc = "what happens, on a line"},
    {.name = "mesh", .type = FLESH_KEY_CHOICE, AT(mesh), .choices = meshes, .default_value = "block",
     .doc = "body; --meshes replaces it"},
    /* The tables of `start` and `release` refer to members of the case itself, so these keys have no offset. */
    {.name = "start", .type = FLESH_KEY_OBJECT, .children = start_table, .default_value = "{}", .doc = "default: at rest"},
    {.name = "held", .type = FLESH_KEY_CHOICE, AT(held), .choices = holds, .default_value = "nothing",
     .doc = "at rest for all time; face: x = 0, feet: the first twentieth along x"},
    {.name = "random", .type = FLESH_KEY_BOOLEAN, AT(random), .default_value = "false", .doc = "true: run once for each seed"},
    {.name = "static", .type = FLESH_KEY_BOOLEAN, AT(is_static), .default_value = "false",
     .doc = "true: an equilibrium, to 1e-8, without step, seconds and release"},
    {.name = "poisson", .type = FLESH_KEY_NUMBER, AT(poisson), .range = FLESH_RANGE_POISSON, .default_value = "",
     .doc = "default: --poisson"},
    {.name = "density", .type = FLESH_KEY_NUMBER, AT(density), .range = FLESH_RANGE_POSITIVE, .unit = "kg/m^3",
     .default_value = "", .doc = "default 1000"},
    {.name = "young", .type = FLESH_KEY_NUMBER, AT(young), .range = FLESH_RANGE_POSITIVE, .unit = "Pa",
     .default_value = "", .doc = "default 1e5"},
    {.name = "young_ratio", .type = FLESH_KEY_NUMBER, AT(young_ratio), .range = FLESH_RANGE_POSITIVE,
     .default_value = "", .doc = "of the second region of checker and halves to the first"},
    {.name = "scale", .type = FLESH_KEY_NUMBER, AT(scale), .range = FLESH_RANGE_POSITIVE, .default_value = "",
     .doc = "length of a body of --meshes over 0.2 m; default 1"},
    {.name = "offset", .type = FLESH_KEY_NUMBER, AT(offset), .unit = "m", .default_value = "0",
     .doc = "of a body of --meshes, along each axis"},
    {.name = "step", .type = FLESH_KEY_NUMBER, AT(step), .range = FLESH_RANGE_POSITIVE, .unit = "s",
     .default_value = "", .doc = "default: --steps"},
    {.name = "seconds", .type = FLESH_KEY_NUMBER, AT(seconds), .range = FLESH_RANGE_POSITIVE, .unit = "s",
     .default_value = "", .doc = "length of the motion, at least 20 steps"},
    {.name = "release", .type = FLESH_KEY_OBJECT, .children = release_table, .default_value = "", .doc = "default: none"},
    {.name = "expects", .type = FLESH_KEY_CHOICE, AT(expects), .choices = ends, .default_value = "recovery",
     .doc = "equilibrium: staying where it is counts as well; recovery-to-0.495: up to this Poisson's ratio"},
    {.name = "effects", .type = FLESH_KEY_TREE, AT(effect_list), .default_value = "",
     .doc = "as in a scene, beside elasticity and inertia; paths are absolute"},
    {.name = NULL},
};

typedef struct file {
  char *title;
  flesh_objects cases;
} file;

const flesh_key flesh_hardcases_keys[] = {
    {.name = "title", .type = FLESH_KEY_TEXT, .offset = offsetof(file, title), .default_value = "",
     .doc = "what the cases are for"},
    {.name = "cases", .type = FLESH_KEY_OBJECTS, .offset = offsetof(file, cases), .children = case_table,
     .child_size = sizeof(flesh_hardcases_case), .doc = "in the order in which they are run"},
    {.name = NULL},
};

/* Checks a name that becomes part of folders' names, a field of tables and a word of the command line. */
static int check_word(const flesh_node *node, const char *path, const char *key)
{
  static const char letters[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_.-+";
  const flesh_node *word = flesh_node_find(node, key);
  char shown[FLESH_SHOW_SIZE];
  if (!strchr("_.-+", *word->text) && strspn(word->text, letters) == strlen(word->text) &&
      strlen(word->text) <= WORD_LIMIT)
    return FLESH_OK;
  return flesh_node_fail(word, "%s.%s is %s; it must be at most %d letters, digits and _.-+, of which the latter do not "
                         "come first", path, key, flesh_node_show(word, shown), WORD_LIMIT);
}

/* Checks a doc, which becomes a comment in scenes. */
static int check_doc(const flesh_node *doc, const char *path)
{
  const unsigned char *text = (const unsigned char *)doc->text;
  unsigned code = 0;
  for (size_t left = strlen(doc->text), size; left; text += size, left -= size) {
    size = flesh_letter_at(text, left, &code);
    if (code < 32 || (code >= 127 && code < 160) || !size)
      return flesh_node_fail(doc, "%s.doc has a control character; it must be a line of text", path);
  }
  return FLESH_OK;
}

static int check_start(const flesh_hardcases_case *c, const flesh_node *node, const char *path)
{
#define AMOUNT(id, name, amount) FLESH_HARDCASES_##amount,
  static const flesh_hardcases_amount amounts[] = {FLESH_HARDCASES_START_LIST(AMOUNT)};
  const flesh_node *start = flesh_node_find(node, "start");
  if (isnan(c->amount) && amounts[c->start] == FLESH_HARDCASES_MUST)
    return flesh_node_fail(start, "%s.start.amount is missing; %s must have one, a number", path, starts[c->start]);
  if (!isnan(c->amount) && amounts[c->start] == FLESH_HARDCASES_NO)
    return flesh_node_fail(flesh_node_find(start, "amount"), "%s.start.amount is %s; %s has none", path,
                           flesh_node_find(start, "amount")->text, starts[c->start]);
  return FLESH_OK;
}

/* Checks the keys of a case, alone and together. */
static int check_case(const flesh_hardcases_case *c, const flesh_node *node, const char *path)
{
  int status = check_word(node, path, "name");
  if (!status) status = check_word(node, path, "group");
  if (!status) status = check_doc(flesh_node_find(node, "doc"), path);
  if (!status) status = check_start(c, node, path);
  if (status) return status;
  if (c->is_static && !(isnan(c->step) && isnan(c->seconds) && isnan(c->release)))
    return flesh_node_fail(node, "%s has a step, seconds or a release; a static case must have none", path);
  if (!c->is_static && isnan(c->seconds))
    return flesh_node_fail(node, "%s.seconds is missing; it must be a number > 0 [s], or the case static", path);
  if (!isnan(c->young_ratio) && c->mesh != FLESH_HARDCASES_CHECKER && c->mesh != FLESH_HARDCASES_HALVES)
    return flesh_node_fail(flesh_node_find(node, "young_ratio"), "%s.young_ratio needs two regions; mesh must be checker or "
                                                                 "halves", path);
  return FLESH_OK;
}

/* Finds a file that is named relative to the battery's folder; scenes in their own folders could not open it. */
static void find_relative(void *data, const char *path)
{
  if (*path != '/') *(const char **)data = path;
}

/* Adds the effect as an item of a scene's list, wrapped at the limit between keys. */
static void write_effect(const flesh_node *effect, flesh_text *text)
{
  const size_t first = text->size;
  size_t line = first;
  flesh_text_print(text, "  - %s: {", effect->key);
  for (const flesh_node *child = effect->first; child; child = child->next) {
    flesh_text key = {0};
    flesh_text_print(&key, "%s: ", child->key);
    flesh_node_write_flow(child, 0, &key);
    const int fits = text->size - line + key.size + 3 <= LINE_LIMIT;
    if (child != effect->first) flesh_text_print(text, fits ? ", " : ",\n      ");
    if (child != effect->first && !fits) line = text->size - 6;
    flesh_text_append(text, key.data, key.size);
    text->failed |= key.failed;
    free(key.data);
  }
  flesh_text_print(text, "}\n");
}

/* Reads the effects as a scene does, and keeps them as text for the list in scenes. */
static int take_effects(flesh_arena *arena, flesh_hardcases_case *c, flesh_node *list, const char *path)
{
  const flesh_key_reader reader = {arena, NULL};
  flesh_objects entries;
  flesh_text text = {0};
  const char *relative = NULL, *whole = flesh_key_path(arena, path, "effects");
  if (!whole) return flesh_no_memory();
  int status = flesh_effect_list_normalise(arena, list);
  if (!status) status = flesh_effect_key_list.read(&reader, list, whole, &entries);
  if (status) return status;
  flesh_effect_key_list.visit_paths(&entries, find_relative, &relative);
  if (relative)
    return flesh_node_fail(list, "%s names the file %s; it must be an absolute path", whole, relative);
  for (const flesh_node *child = list->first; child; child = child->next) write_effect(child->first, &text);
  c->effects = text.failed ? NULL : flesh_arena_text(arena, text.data ? text.data : "", text.size);
  free(text.data);
  return c->effects ? FLESH_OK : flesh_no_memory();
}

/* Computes the FNV-1a hash (Fowler, Noll & Vo) of the case, written as a line. */
static int take_fingerprint(flesh_hardcases_case *c, const flesh_node *node)
{
  flesh_text text = {0};
  flesh_node_write_flow(node, 0, &text);
  c->fingerprint = 0xcbf29ce484222325u;
  for (size_t k = 0; k < text.size; k++) c->fingerprint = (c->fingerprint ^ (unsigned char)text.data[k]) * 0x100000001b3u;
  free(text.data);
  return text.failed ? flesh_no_memory() : FLESH_OK;
}

static int take_cases(flesh_hardcases_battery *battery, const file *f, const flesh_node *root)
{
  const flesh_node *list = flesh_node_find(root, "cases"), *node = list->first;
  flesh_hardcases_case *c = battery->cases = f->cases.values;
  char path[32];
  if (f->cases.count < 1 || f->cases.count > CASE_LIMIT)
    return flesh_node_fail(list, "cases are %d; they must be 1 to %d", f->cases.count, CASE_LIMIT);
  for (int k = 0; k < f->cases.count; k++, node = node->next, c++) {
    snprintf(path, sizeof path, "cases[%d]", k);
    c->effects = "";
    int status = check_case(c, node, path);
    if (!status && c->effect_list) status = take_effects(&battery->arena, c, flesh_node_find(node, "effects"), path);
    if (!status) status = take_fingerprint(c, node);
    if (status) return status;
    for (int other = 0; other < k; other++)
      if (!strcmp(battery->cases[other].name, c->name))
        return flesh_node_fail(flesh_node_find(node, "name"), "%s.name is %s, which is the name of cases[%d]; each must "
                               "have its own", path, c->name, other);
    if (isnan(c->amount)) c->amount = 0;
    if (c->is_static) c->step = 1; /* makes it run only with the first of --steps */
    battery->count++;
  }
  return FLESH_OK;
}

int flesh_hardcases_open_battery(const char *path, const char *name, flesh_hardcases_battery *battery)
{
  const char *own = flesh_own_text(name);
  flesh_node *root = NULL;
  char *loaded = NULL;
  file f;
  *battery = (flesh_hardcases_battery){0};
  flesh_keyed_text text = {.text = own, .size = strlen(own), .what = "the battery"};
  int status = path ? flesh_file_load(path, &loaded, &text.size) : FLESH_OK;
  if (loaded) text.text = loaded;
  text.path = path ? path : flesh_arena_print(&battery->arena, "data/hardcases/%s.yaml", name);
  if (!status && !text.path) status = flesh_no_memory();
  if (!status) status = flesh_keyed_text_read(&battery->arena, &text, flesh_hardcases_keys, &root, &f);
  if (!status) status = take_cases(battery, &f, root);
  for (int k = 0; k < battery->count && !path; k++) battery->cases[k].fingerprint = 0;
  free(loaded);
  return status;
}

void flesh_hardcases_close_battery(flesh_hardcases_battery *battery)
{
  flesh_arena_free(&battery->arena);
  *battery = (flesh_hardcases_battery){0};
}
