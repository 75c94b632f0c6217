/* write.c: writes the page with its payload: JSON and numbers, deflated (RFC 1950) and in base 64 (RFC 4648). */
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "base/error.h"
#include "base/file.h"
#include "report/report.h"
#include "cli/json_memory.h"

int flesh_report_no_memory(void) { return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a report"); }

int flesh_report_bytes_open(flesh_report_bytes *bytes)
{
  bytes->stream = open_memstream(&bytes->data, &bytes->size);
  return bytes->stream ? FLESH_OK : flesh_report_no_memory();
}

int flesh_report_bytes_flush(flesh_report_bytes *bytes)
{
  const int lost = fflush(bytes->stream) || ferror(bytes->stream);
  return lost ? flesh_report_no_memory() : FLESH_OK;
}

void flesh_report_bytes_close(flesh_report_bytes *bytes)
{
  if (bytes->stream) fclose(bytes->stream);
  free(bytes->data);
  *bytes = (flesh_report_bytes){0};
}

/* Prints text escaped for HTML. */
static void print_escaped(FILE *stream, const char *text)
{
  for (; *text; text++)
    if (*text == '&') fputs("&amp;", stream);
    else if (*text == '<') fputs("&lt;", stream);
    else if (*text == '>') fputs("&gt;", stream);
    else putc(*text, stream);
}

static void print_base64(FILE *stream, const char *bytes, size_t size)
{
  static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const unsigned char *data = (const unsigned char *)bytes;
  for (size_t k = 0; k < size; k += 3) {
    const size_t left = size - k;
    const unsigned bits = (unsigned)data[k] << 16 | (left > 1 ? (unsigned)data[k + 1] << 8 : 0) |
                          (left > 2 ? (unsigned)data[k + 2] : 0);
    putc(letters[bits >> 18], stream);
    putc(letters[bits >> 12 & 63], stream);
    putc(left > 1 ? letters[bits >> 6 & 63] : '=', stream);
    putc(left > 2 ? letters[bits & 63] : '=', stream);
  }
}

/* Prints the first sentence of each part's verdict, which can be read without scripts. */
static void print_lead(FILE *stream, const json_t *parts)
{
  const json_t *part;
  size_t k;
  fputs("<div id=\"lead\">", stream);
  json_array_foreach(parts, k, part) {
    const char *said = json_string_value(json_array_get(json_object_get(part, "verdict"), 0));
    if (!said || strchr(said, '\n')) continue;
    fputs("<p>", stream);
    if (json_array_size(parts) > 1) {
      print_escaped(stream, json_string_value(json_object_get(part, "title")));
      fputs(": ", stream);
    }
    print_escaped(stream, said);
    fputs("</p>", stream);
  }
  fputs("</div>\n", stream);
}

/* Prints the picture as an element, or nothing if there is none. */
static void print_still(FILE *stream, const flesh_report_bytes *still)
{
  if (!still->size) return;
  fputs("<img id=\"still\" alt=\"The bodies as they are first seen\" src=\"data:image/png;base64,", stream);
  print_base64(stream, still->data, still->size);
  fputs("\">\n", stream);
}

/* Deflates into *packed (new) the length of the JSON as twelve digits, the JSON, and the numbers. */
static int pack(const flesh_report *report, json_t *head, char **packed, size_t *size)
{
  json_t *all = json_pack("{sOsOsO}", "head", head, "parts", report->parts, "view", report->view);
  char *text = all ? json_dumps(all, JSON_COMPACT | JSON_REAL_PRECISION(9)) : NULL;
  flesh_report_bytes plain = {0};
  int status = text && !flesh_json_lacks() ? flesh_report_bytes_open(&plain) : FLESH_ERR_MEMORY;
  *packed = NULL;
  if (!status) {
    fprintf(plain.stream, "%012zu%s", strlen(text), text);
    fwrite(report->numbers.data, 1, report->numbers.size, plain.stream);
    status = flesh_report_bytes_flush(&plain);
  }
  uLongf room = compressBound((uLong)plain.size);
  if (!status) *packed = malloc(room);
  if (!*packed || compress2((Bytef *)*packed, &room, (Bytef *)plain.data, (uLong)plain.size, Z_BEST_COMPRESSION) != Z_OK)
    status = flesh_report_no_memory();
  *size = room;
  flesh_report_bytes_close(&plain);
  free(text);
  json_decref(all);
  return status;
}

/* Prints the page up to the mark; returns the rest behind it. */
static const char *print_up_to(FILE *stream, const char *mark, const char *page)
{
  const char *at = strstr(page, mark);
  fwrite(page, 1, (size_t)(at - page), stream);
  return at + strlen(mark);
}

int flesh_report_write(const flesh_report *report, const char *title, json_t *head,
                       const char *path, size_t *size, size_t *packed)
{
  char *payload = NULL;
  flesh_file file;
  int status = pack(report, head, &payload, packed);
  if (!status) status = flesh_file_open(path, &file);
  if (!status) {
    const char *rest = print_up_to(file.stream, "@TITLE@", flesh_report_page);
    print_escaped(file.stream, title);
    rest = print_up_to(file.stream, "@LEAD@", rest);
    print_lead(file.stream, report->parts);
    rest = print_up_to(file.stream, "@STILL@", rest);
    print_still(file.stream, &report->still);
    rest = print_up_to(file.stream, "@PAYLOAD@", rest);
    print_base64(file.stream, payload, *packed);
    fputs(rest, file.stream);
    *size = (size_t)ftell(file.stream);
    status = flesh_file_commit(&file);
  }
  free(payload);
  return status;
}
