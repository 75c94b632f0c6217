// TEST quick
/* test_text.c: text in a buffer of fixed size never exceeds it, and ends with a complete letter. */
#include "test.h"

#include "base/text.h"

enum { SIZE = 8, GUARD = 16 };

/* Bytes before and behind the buffer, which must not be touched. */
static struct {
  char before[GUARD], text[SIZE], behind[GUARD];
} room;

static void begin(const char *text)
{
  memset(&room, '#', sizeof room);
  snprintf(room.text, SIZE, "%s", text);
}

static int is_whole(void)
{
  for (int k = 0; k < GUARD; k++)
    if (room.before[k] != '#' || room.behind[k] != '#') return 0;
  return memchr(room.text, 0, SIZE) != NULL;
}

static void what_fits_is_appended(void)
{
  begin("");
  CHECK(flesh_text_add(room.text, SIZE, "%d", 12) && flesh_text_add(room.text, SIZE, ", %s", "345"));
  CHECK(is_whole() && !strcmp(room.text, "12, 345"));
  CHECK(flesh_text_add(room.text, SIZE, "%s", "") && is_whole() && !strcmp(room.text, "12, 345"));
}

static void what_does_not_fit_is_cut(void)
{
  char longest[2000];
  memset(longest, 'x', sizeof longest);
  longest[sizeof longest - 1] = 0;
  begin("ab");
  for (int k = 0; k < 3; k++) {
    CHECK(!flesh_text_add(room.text, SIZE, "%s", longest));
    CHECK(is_whole() && !strcmp(room.text, "abxxxxx"));
  }
  begin("1234567");
  CHECK(!flesh_text_add(room.text, SIZE, "8") && is_whole() && !strcmp(room.text, "1234567"));
}

/* One letter of each length, cut at each of its bytes. */
static void letters_are_never_halved(void)
{
  static const char *const letters[] = {"\xc3\xbc", "\xe2\x82\xac", "\xf0\x9f\x98\x80"};
  for (int l = 0; l < 3; l++) {
    const int size = (int)strlen(letters[l]);
    for (int there = 0; there <= size; there++) {
      char before[SIZE] = "";
      memset(before, 'a', (size_t)(SIZE - 1 - there));
      begin(before);
      CHECK(flesh_text_add(room.text, SIZE, "%s", letters[l]) == (there == size));
      CHECK(is_whole() && strlen(room.text) == (size_t)(there == size ? SIZE - 1 : SIZE - 1 - there));
    }
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(what_fits_is_appended), TEST(what_does_not_fit_is_cut), TEST(letters_are_never_halved));
}
