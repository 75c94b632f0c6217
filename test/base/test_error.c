// TEST quick
/* test_error.c: statuses have names, and each thread has its own error text. */
#include "test.h"

#include <pthread.h>
#include <stdatomic.h>

#include "base/error.h"
#include "flesh/mesh.h"

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

/* A text quoted from a file or the command line may contain anything. */
static void text_is_one_printable_line(void)
{
  flesh_fail(FLESH_ERR_FILE, "%s: the name is '%s'", "\xc3\xbc" "bung.yaml", "a\nb\33[2J\x7f");
  CHECK_TEXT(flesh_error_text(), "\xc3\xbc" "bung.yaml: the name is 'a?b?[2J?'");
  flesh_fail(FLESH_ERR_FILE, "%s", "\xff\xc3[\xe2\x82\xac\xe2\x82 \xc2\x9b \xed\xa0\x80");
  CHECK(!strcmp(flesh_error_text(), "?" "?[\xe2\x82\xac?? ? ???"));
  flesh_fail_within(FLESH_ERR_FILE, "line\r%s: ", "\xe2\x80\xa8");
  CHECK(!strcmp(flesh_error_text(), "line?" "?: ?" "?[\xe2\x82\xac?? ? ???"));
  char longest[3000];
  memset(longest, 'x', sizeof longest);
  longest[sizeof longest - 1] = 0;
  for (int k = 0; k < 2; k++) {
    memcpy(longest + 1022 - k, "\xc3\xbc", 2); /* a letter cut by the end of the text */
    flesh_fail(FLESH_ERR_FILE, "%s", longest);
    CHECK(strlen(flesh_error_text()) == 1023 && flesh_error_text()[1022] != '\xc3');
  }
}

typedef struct heard {
  int count, status;
  char text[256], read[256];
} heard;

static void hear(void *data, int status, const char *text)
{
  heard *h = data;
  h->count++;
  h->status = status;
  snprintf(h->text, sizeof h->text, "%s", text);
  snprintf(h->read, sizeof h->read, "%s", flesh_error_text());
  flesh_fail(FLESH_ERR_MEMORY, "within the handler"); /* neither reported nor kept */
}

static void a_handler_is_told_every_sentence(void)
{
  heard h = {0}, other = {0};
  flesh_set_error_handler(hear, &h);
  CHECK(flesh_fail(FLESH_ERR_FILE, "line %d is odd", 3) == FLESH_ERR_FILE);
  CHECK(h.count == 1 && h.status == FLESH_ERR_FILE && !strcmp(h.text, "line 3 is odd") && !strcmp(h.read, h.text));
  CHECK(!strcmp(flesh_error_text(), "line 3 is odd"));
  flesh_fail_within(FLESH_ERR_FILE, "a.msh: ");
  CHECK(h.count == 2 && !strcmp(h.text, "a.msh: line 3 is odd"));
  CHECK(flesh_mesh_read(NULL, NULL) == FLESH_ERR_ARGUMENT && h.count == 3 && h.status == FLESH_ERR_ARGUMENT);
  flesh_set_error_handler(hear, &other);
  flesh_fail(FLESH_UNDEFINED, "a try");
  CHECK(h.count == 3 && other.count == 1 && other.status == FLESH_UNDEFINED);
  flesh_set_error_handler(NULL, NULL);
  flesh_fail(FLESH_ERR_FILE, "alone");
  CHECK(other.count == 1);
}

enum { FAILURES = 2000 };
static atomic_int told, mixed;

/* Each handler has its own data and must never be called without it. */
static char first_data, second_data;
static void first(void *data, int status, const char *text)
{
  (void)status, (void)text;
  told++;
  mixed += data != &first_data;
}

static void second(void *data, int status, const char *text)
{
  (void)status, (void)text;
  told++;
  mixed += data != &second_data;
}

static void *fail_often(void *wrong)
{
  char text[32];
  for (int k = 0; k < FAILURES; k++) {
    snprintf(text, sizeof text, "%p %d", wrong, k);
    flesh_fail(FLESH_ERR_FILE, "%s", text);
    *(int *)wrong += strcmp(flesh_error_text(), text) != 0;
  }
  return NULL;
}

static void threads_may_fail_while_handlers_change(void)
{
  pthread_t threads[2];
  int wrong[2] = {0};
  flesh_set_error_handler(first, &first_data);
  for (int k = 0; k < 2; k++) CHECK(!pthread_create(&threads[k], NULL, fail_often, &wrong[k]));
  for (int k = 0; k < FAILURES; k++) {
    if (k % 2) flesh_set_error_handler(first, &first_data);
    else flesh_set_error_handler(second, &second_data);
  }
  for (int k = 0; k < 2; k++) pthread_join(threads[k], NULL);
  flesh_set_error_handler(NULL, NULL);
  CHECK(told == 2 * FAILURES && mixed == 0 && !wrong[0] && !wrong[1]);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(names_and_texts), TEST(text_grows_outwards),
                   TEST(text_is_one_printable_line), TEST(a_handler_is_told_every_sentence),
                   TEST_OF_THREADS(threads_may_fail_while_handlers_change));
}
