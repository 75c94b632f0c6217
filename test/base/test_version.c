// TEST quick
/* test_version.c: headers, library and meson.build have the same version. */
#include "flesh/flesh.h"
#include "test.h"

static void the_parts_make_the_text(void)
{
  char text[64];
  snprintf(text, sizeof text, "%d.%d.%d", FLESH_VERSION_MAJOR, FLESH_VERSION_MINOR, FLESH_VERSION_PATCH);
  CHECK(!strcmp(text, FLESH_VERSION_STRING));
}

static void the_library_tells_that_of_its_headers(void) { CHECK(!strcmp(flesh_version(), FLESH_VERSION_STRING)); }

static void it_is_the_projects(void)
{
  char line[256], text[64] = "";
  FILE *file = fopen("../meson.build", "r");
  CHECK(file);
  while (file && !*text && fgets(line, sizeof line, file)) sscanf(line, " version: '%63[^']'", text);
  if (file) fclose(file);
  printf("# meson.build has %s, version.h %s\n", text, FLESH_VERSION_STRING);
  CHECK(!strcmp(text, FLESH_VERSION_STRING));
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(the_parts_make_the_text), TEST(the_library_tells_that_of_its_headers),
                   TEST(it_is_the_projects));
}
