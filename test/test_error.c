/* test_error.c: statuses have names, and the error text is the thread's own. */
#include "test.h"

#include "base/error.h"

static void names_and_texts(void)
{
  CHECK_TEXT(flesh_status_name(FLESH_UNDEFINED), "FLESH_UNDEFINED");
  CHECK_TEXT(flesh_status_text(FLESH_ERR_MEMORY), "memory");
  CHECK_TEXT(flesh_status_name(-1000), "unknown");
}

static void text_grows_outwards(void)
{
  CHECK(flesh_fail(FLESH_ERR_FILE, "line %d is %s", 3, "odd") == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "line 3 is odd");
  flesh_fail_within(FLESH_ERR_FILE, "a.msh: ");
  CHECK(!strcmp(flesh_error_text(), "a.msh: line 3 is odd"));
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(names_and_texts), TEST(text_grows_outwards));
}
