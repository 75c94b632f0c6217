/* scan.c: loads a file and scans the numbers of its text. */
#include "base/scan.h"

#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/confine.h"
#include "base/error.h"

int flesh_regular_open(const char *path, FILE **stream)
{
  struct stat what = {0};
  *stream = NULL;
  /* O_NONBLOCK: opening a pipe would otherwise wait for its writer. */
  const int descriptor = flesh_path_open(path, O_RDONLY | O_NONBLOCK | O_NOCTTY, 0);
  if (descriptor < 0)
    return flesh_fail(FLESH_ERR_FILE, "%s: cannot be opened: %s", path, flesh_path_reason(path, errno));
  if (!fstat(descriptor, &what) && S_ISREG(what.st_mode)) {
    *stream = fdopen(descriptor, "rb");
    if (*stream) return FLESH_OK;
    close(descriptor);
    return flesh_no_memory_for(path);
  }
  close(descriptor);
  return flesh_fail_kind(path, what.st_mode);
}

int flesh_regular_check(const char *path)
{
  FILE *stream;
  const int status = flesh_regular_open(path, &stream);
  if (stream) fclose(stream);
  return status;
}

int flesh_file_load(const char *path, char **data, size_t *size)
{
  struct stat what;
  FILE *file;
  *data = NULL;
  *size = 0;
  int status = flesh_regular_open(path, &file);
  if (status) return status;
  if (fstat(fileno(file), &what))
    status = flesh_fail(FLESH_ERR_FILE, "%s: cannot be read: %s", path, strerror(errno));
  else if (!(*data = malloc((size_t)what.st_size + 1)))
    status = flesh_fail(FLESH_ERR_MEMORY, "%s: out of memory for its %lld bytes", path,
                        (long long)what.st_size);
  else {
    *size = fread(*data, 1, (size_t)what.st_size, file);
    (*data)[*size] = 0;
    if (ferror(file))
      status = flesh_fail(FLESH_ERR_FILE, "%s: cannot be read: %s", path, strerror(errno));
  }
  fclose(file);
  if (status) {
    free(*data);
    *data = NULL;
  }
  return status;
}

int flesh_scan_open(flesh_scanner *s, const char *path)
{
  size_t size;
  *s = (flesh_scanner){.path = path, .line = 1, .comment = '#'};
  int status = flesh_plain_locale_begin(&s->locale);
  if (!status) status = flesh_file_load(path, &s->data, &size);
  if (status) return status;
  s->begin = s->at = s->data;
  s->end = s->data + size;
  if (size >= 3 && !memcmp(s->data, "\xef\xbb\xbf", 3)) s->at += 3; /* byte order mark of UTF-8 */
  return FLESH_OK;
}

void flesh_scan_close(flesh_scanner *s)
{
  if (s->locale.plain) flesh_plain_locale_end(&s->locale);
  free(s->data);
  s->locale.plain = (locale_t)0;
  s->data = NULL;
}

static int is_blank(const flesh_scanner *s, char c)
{
  return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f' || (c == ',' && s->commas);
}

static int begins_comment(const flesh_scanner *s, char c) { return c == s->comment && c; }

/* Returns whether a token ends here: at a blank, a line end, a comment or the end of the text, but not at a 0 byte
 * within it. */
static int is_break(const flesh_scanner *s, const char *at)
{
  return at >= s->end || is_blank(s, *at) || *at == '\n' || begins_comment(s, *at);
}

int flesh_scan_next_in_line(flesh_scanner *s)
{
  while (s->at < s->end && is_blank(s, *s->at)) s->at++;
  if (s->at < s->end && begins_comment(s, *s->at)) {
    const char *stop = memchr(s->at, '\n', (size_t)(s->end - s->at));
    s->at = stop ? stop : s->end;
  }
  return s->at < s->end && *s->at != '\n';
}

int flesh_scan_next(flesh_scanner *s)
{
  while (!flesh_scan_next_in_line(s)) {
    if (s->at >= s->end) return 0;
    s->at++;
    s->line++;
  }
  return 1;
}

void flesh_scan_skip_line(flesh_scanner *s)
{
  const char *stop = memchr(s->at, '\n', (size_t)(s->end - s->at));
  s->at = stop ? stop + 1 : s->end;
  s->line += stop != NULL;
}

int flesh_scan_word(flesh_scanner *s, const char *word)
{
  size_t length = strlen(word);
  if ((size_t)(s->end - s->at) < length || memcmp(s->at, word, length)) return 0;
  if (!is_break(s, s->at + length)) return 0;
  s->at += length;
  return 1;
}

size_t flesh_scan_token(flesh_scanner *s, const char **token)
{
  *token = s->at;
  while (!is_break(s, s->at)) s->at++;
  return (size_t)(s->at - *token);
}

const char *flesh_scan_show(const flesh_scanner *s)
{
  enum { SHOWN = 32 };
  static _Thread_local char text[SHOWN + 8];
  char *out = text;
  const char *at = s->at;
  *out++ = '\'';
  for (; !is_break(s, at) && at - s->at < SHOWN; at++)
    *out++ = *at >= 0x20 && *at < 0x7f ? *at : '?';
  if (!is_break(s, at)) {
    memcpy(out, "...", 3);
    out += 3;
  }
  *out++ = '\'';
  *out = 0;
  return text;
}

int flesh_scan_fail(const flesh_scanner *s, const char *format, ...)
{
  char text[512];
  va_list args;
  va_start(args, format);
  vsnprintf(text, sizeof text, format, args);
  va_end(args);
  return flesh_fail(FLESH_ERR_FILE, "%s:%lld: %s", s->path, (long long)s->line, text);
}

/* Writes the name of the item being read: "node 5". */
static const char *item_text(const flesh_scanner *s, char text[64])
{
  if (s->index < 0) snprintf(text, 64, "%s", s->item);
  else snprintf(text, 64, "%s %lld", s->item, (long long)s->index);
  return text;
}

/* Moves to the row's next token or fails. */
static int next_in_row(flesh_scanner *s)
{
  if (s->free_rows ? flesh_scan_next(s) : flesh_scan_next_in_line(s)) return FLESH_OK;
  char item[64];
  return flesh_scan_fail(s, "%s: the %s ends too early; `%s` is expected", item_text(s, item),
                         s->at >= s->end ? "file" : "row", s->form);
}

int flesh_scan_integer(flesh_scanner *s, int64_t *value)
{
  if (next_in_row(s)) return FLESH_ERR_FILE;
  const char *at = s->at;
  int negative = *at == '-', digits = 0, over = 0;
  if (*at == '-' || *at == '+') at++;
  int64_t sum = 0;
  for (; *at >= '0' && *at <= '9'; at++, digits++) {
    int digit = *at - '0';
    if (sum > (INT64_MAX - digit) / 10) over = 1;
    else sum = 10 * sum + digit;
  }
  char item[64];
  if (!digits || !is_break(s, at))
    return flesh_scan_fail(s, "%s: %s is not an integer; `%s` is expected", item_text(s, item),
                           flesh_scan_show(s), s->form);
  if (over)
    return flesh_scan_fail(s, "%s: %s does not fit into 64 bits", item_text(s, item),
                           flesh_scan_show(s));
  s->at = at;
  *value = negative ? -sum : sum;
  return FLESH_OK;
}

int flesh_scan_real(flesh_scanner *s, double *value)
{
  if (next_in_row(s)) return FLESH_ERR_FILE;
  /* strtod depends on the thread's locale, which flesh_scan_open has set to "C"; a 0 byte ends the text. */
  char *stop, item[64];
  double number = strtod(s->at, &stop);
  if (stop == s->at || !is_break(s, stop))
    return flesh_scan_fail(s, "%s: %s is not a number; `%s` is expected", item_text(s, item),
                           flesh_scan_show(s), s->form);
  if (!isfinite(number))
    return flesh_scan_fail(s, "%s: %s is not finite; coordinates must be finite numbers",
                           item_text(s, item), flesh_scan_show(s));
  s->at = stop;
  *value = number;
  return FLESH_OK;
}

int flesh_scan_row_end(flesh_scanner *s)
{
  if (!flesh_scan_next_in_line(s)) return FLESH_OK;
  char item[64];
  return flesh_scan_fail(s, "%s: %s stands behind the row's end; `%s` is expected",
                         item_text(s, item), flesh_scan_show(s), s->form);
}

int flesh_scan_count(flesh_scanner *s, const char *item, int least, int bytes, int *count)
{
  int64_t value;
  s->item = item;
  s->index = -1;
  if (flesh_scan_integer(s, &value)) return FLESH_ERR_FILE;
  if (value < least || value > INT_MAX / 4)
    return flesh_scan_fail(s, "%s is %lld; it must be %d to %d", item, (long long)value, least,
                           INT_MAX / 4);
  if (value > (s->end - s->at) / bytes + 1)
    return flesh_scan_fail(
        s, "%s is %lld, but only %lld bytes of the file are left, enough for %lld", item,
        (long long)value, (long long)(s->end - s->at), (long long)((s->end - s->at) / bytes));
  *count = (int)value;
  return FLESH_OK;
}
