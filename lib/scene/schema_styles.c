/* schema_styles.c: writes the keys as Markdown tables, as the manual page flesh-scene(5), and as paths, one per
 * line. */
#include "flesh/version.h"
#include "scene/roff.h"
#include "scene/schema.h"

static const char introduction[] = "A number may be written as a fraction a/b (1/60; in JSON "
                                   "\"1/60\"). Units are SI. Paths are relative to the\n"
                                   "scene's file; in `--set` to the working directory. `--set "
                                   "path=value` changes a key: `body.material.young=1e5`,\n"
                                   "`body.regions[0].density=900` (items count from 0, one past "
                                   "the end appends), `effects.gravity.acceleration[2]=0`\n"
                                   "(the first effect of that name, appended when there is none), "
                                   "`effects.pin[1].until=2` (the second pin),\n"
                                   "`effects[3].pin.until=2` (the fourth effect). The value is "
                                   "YAML; `null` removes the key, item or effect.\n"
                                   "Several overrides apply in order.\n";

static void markdown_introduction(flesh_text *text) { flesh_text_print(text, "# Keys of a scene\n\n%s", introduction); }

static void markdown_section(flesh_text *text, const char *path, const char *doc, int has_keys)
{
  flesh_text_print(text, "\n## %s\n", path);
  if (doc) flesh_text_print(text, "\n%s\n", doc);
  if (has_keys == 0) flesh_text_print(text, "\nIt has no keys.\n");
  else if (has_keys > 0) flesh_text_print(text, "\n| key | value | default | meaning |\n|---|---|---|---|\n");
}

static void markdown_row(flesh_text *text, const flesh_schema_row *row)
{
  flesh_text_print(text, "| `%s` | %s", row->key->name, row->expected);
  if (!row->default_value) flesh_text_print(text, " | required | ");
  else if (!*row->default_value) flesh_text_print(text, " | | ");
  else flesh_text_print(text, " | `%s` | ", row->default_value);
  flesh_text_print(text, "%s |\n", row->key->doc ? row->key->doc : "");
}

static void markdown_example(flesh_text *text, const char *name, const char *sample)
{
  flesh_text_print(text, "\nExample: `- %s: %s`\n", name, sample);
}

const flesh_schema_style flesh_schema_markdown = {0, markdown_introduction, markdown_section, markdown_row,
                                                  markdown_example};

static void man_introduction(flesh_text *text)
{
  flesh_text_print(text, ".TH FLESH\\-SCENE 5 \"\" \"flesh %s\" \"File formats\"\n.SH NAME\n"
                         "flesh\\-scene \\- keys of a scene\n.SH DESCRIPTION\n", FLESH_VERSION_STRING);
  flesh_roff_print(text, introduction);
}

static void man_section(flesh_text *text, const char *path, const char *doc, int has_keys)
{
  flesh_text_print(text, ".SH \"");
  flesh_roff_print(text, path);
  flesh_text_print(text, "\"\n");
  if (doc && *doc) flesh_roff_print(text, doc), flesh_text_print(text, "\n");
  if (has_keys == 0) flesh_text_print(text, ".PP\nIt has no keys.\n");
}

static void man_row(flesh_text *text, const flesh_schema_row *row)
{
  flesh_text_print(text, ".TP\n\\fB");
  flesh_roff_print(text, row->key->name);
  flesh_text_print(text, "\\fR: ");
  flesh_roff_print(text, row->expected);
  flesh_text_print(text, "\n");
  if (row->key->doc) flesh_roff_print(text, row->key->doc);
  flesh_text_print(text, row->key->doc ? ".\n" : "");
  if (!row->default_value) flesh_text_print(text, "Required.\n");
  if (!row->default_value || !*row->default_value) return;
  flesh_text_print(text, "Default: ");
  flesh_roff_print(text, row->default_value);
  flesh_text_print(text, "\n");
}

static void man_example(flesh_text *text, const char *name, const char *sample)
{
  flesh_text_print(text, ".PP\nExample:\n.PP\n.nf\n");
  flesh_roff_print(text, "- ");
  flesh_roff_print(text, name);
  flesh_text_print(text, ": ");
  flesh_roff_print(text, sample);
  flesh_text_print(text, "\n.fi\n");
}

const flesh_schema_style flesh_schema_man = {0, man_introduction, man_section, man_row, man_example};

static void no_introduction(flesh_text *text) { (void)text; }

static void no_section(flesh_text *text, const char *path, const char *doc, int has_keys)
{
  (void)text, (void)path, (void)doc, (void)has_keys;
}

/* Prints a key's path with index 0 for each list. A mapping's own path is skipped, as its keys follow. */
static void path_row(flesh_text *text, const flesh_schema_row *row)
{
  if (row->key->children || row->key->type == FLESH_KEY_EFFECTS) return;
  for (const char *at = row->path; *at; at++) {
    flesh_text_append(text, at, 1);
    if (*at == '[') flesh_text_print(text, "0");
  }
  flesh_text_print(text, "%s%s\n", *row->path ? "." : "", row->key->name);
}

static void no_example(flesh_text *text, const char *name, const char *sample) { (void)text, (void)name, (void)sample; }

const flesh_schema_style flesh_schema_paths = {1, no_introduction, no_section, path_row, no_example};
