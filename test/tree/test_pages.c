// TEST quick
/* test_pages.c: the pages and the schema name every existing effect, form and method. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "flesh/integrator.h"
#include "flesh/scene.h"
#include "material/form.h"
#include "scene/effect_registry.h"
#include "test.h"

/* Returns the whole file, to be freed; stops the program if it cannot be read. */
static char *contents(const char *path)
{
  FILE *stream = fopen(path, "rb");
  if (!stream || fseek(stream, 0, SEEK_END)) abort();
  long size = ftell(stream);
  char *text = calloc((size_t)size + 1, 1);
  rewind(stream);
  if (!text || fread(text, 1, (size_t)size, stream) != (size_t)size) abort();
  fclose(stream);
  return text;
}

static void is_named(const char *page, const char *text, const char *wanted)
{
  if (!strstr(text, wanted)) printf("# %s does not have '%s'\n", page, wanted);
  CHECK(strstr(text, wanted));
}

static char *schema(flesh_schema_format format)
{
  char *text = NULL;
  CHECK_OK(flesh_scene_schema(format, &text));
  return text;
}

static void forms_are_named(void)
{
  char *readme = contents("../README.md"), *keys = schema(FLESH_SCHEMA_MARKDOWN), *json = schema(FLESH_SCHEMA_JSON);
  for (int e = 0; e < FLESH_ENERGY_COUNT; e++) {
    const flesh_form *form = &flesh_forms[e];
    char wanted[96];
    snprintf(wanted, sizeof wanted, "\n| %s ", form->name); /* a row of the table of energies */
    is_named("README.md", readme, wanted);
    is_named("README.md", readme, form->full_name);
    snprintf(wanted, sizeof wanted, "%s or %s", form->name, form->full_name);
    is_named("the schema", keys, wanted);
    snprintf(wanted, sizeof wanted, "\"%s\"", form->full_name);
    is_named("the JSON schema", json, wanted);
  }
  free(readme);
  free(keys);
  free(json);
}

static void methods_are_named(void)
{
  char *readme = contents("../README.md"), *keys = schema(FLESH_SCHEMA_MARKDOWN);
  const char *name;
  for (int m = 0; (name = flesh_method_name((flesh_method)m)); m++) {
    char wanted[64];
    snprintf(wanted, sizeof wanted, "`%s`", name);
    is_named("README.md", readme, wanted);
    is_named("the schema", keys, name);
  }
  free(readme);
  free(keys);
}

static void effects_are_named(void)
{
  char *page = contents("../drivers/effects.md"), *keys = schema(FLESH_SCHEMA_MARKDOWN);
  int count;
  const flesh_effect_row *const *rows = flesh_effect_registry(&count);
  for (int e = 0; e < count; e++) {
    char wanted[64];
    snprintf(wanted, sizeof wanted, "`%s`", rows[e]->name);
    is_named("drivers/effects.md", page, wanted);
    is_named("the schema", keys, rows[e]->name);
  }
  free(page);
  free(keys);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(forms_are_named), TEST(methods_are_named), TEST(effects_are_named));
}
