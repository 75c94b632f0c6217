/* write.c: the page with its payload: JSON and numbers, deflated (RFC 1950) and in base 64 (RFC
 * 4648). */
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "base/error.h"
#include "base/file.h"
#include "report/report.h"
#include "cli/json_memory.h"

/* Text in HTML. */
static size_t print_escaped(FILE *stream, const char *text)
{
  size_t printed = 0;
  for (; *text; text++) {
    const char *as = *text == '&' ? "&amp;" : *text == '<' ? "&lt;" : *text == '>' ? "&gt;" : NULL;
    if (as) fputs(as, stream);
    else putc(*text, stream);
    printed += as ? strlen(as) : 1;
  }
  return printed;
}

static size_t print_base64(FILE *stream, const unsigned char *data, size_t size)
{
  static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (size_t k = 0; k < size; k += 3) {
    const size_t left = size - k;
    const unsigned bits = (unsigned)data[k] << 16 | (left > 1 ? (unsigned)data[k + 1] << 8 : 0) |
                          (left > 2 ? (unsigned)data[k + 2] : 0);
    putc(letters[bits >> 18], stream);
    putc(letters[bits >> 12 & 63], stream);
    putc(left > 1 ? letters[bits >> 6 & 63] : '=', stream);
    putc(left > 2 ? letters[bits & 63] : '=', stream);
  }
  return (size + 2) / 3 * 4;
}

/* The first sentence of each part's verdict, which is read without scripts, too. */
static size_t print_lead(FILE *stream, const json_t *parts)
{
  size_t printed = (size_t)fprintf(stream, "<div id=\"lead\">"), k;
  const json_t *part;
  json_array_foreach(parts, k, part) {
    const char *said = json_string_value(json_array_get(json_object_get(part, "verdict"), 0));
    if (!said || strchr(said, '\n')) continue;
    printed += (size_t)fprintf(stream, "<p>");
    if (json_array_size(parts) > 1) {
      printed += print_escaped(stream, json_string_value(json_object_get(part, "title")));
      printed += (size_t)fprintf(stream, ": ");
    }
    printed += print_escaped(stream, said);
    printed += (size_t)fprintf(stream, "</p>");
  }
  return printed + (size_t)fprintf(stream, "</div>\n");
}

static size_t print_between(FILE *stream, const char *begin, const char *end)
{
  return fwrite(begin, 1, (size_t)(end - begin), stream);
}

/* An element, or nothing where there is no picture. */
static size_t print_still(FILE *stream, const flesh_report_bytes *still)
{
  static const char begin[] = "<img id=\"still\" alt=\"The bodies as they are first seen\" src=\"data:image/png;base64,",
                    end[] = "\">\n";
  if (!still->size) return 0;
  size_t printed = print_between(stream, begin, begin + strlen(begin));
  printed += print_base64(stream, still->data, still->size);
  return printed + print_between(stream, end, end + strlen(end));
}

/* The length of the JSON as text of twelve digits, the JSON, the numbers; deflated into *packed
 * (new). */
static int pack(const flesh_report *report, json_t *head, unsigned char **packed, size_t *size)
{
  enum { DIGITS = 12, ROOM = 32 };
  json_t *all = json_pack("{sOsOsO}", "head", head, "parts", report->parts, "view", report->view);
  char *text = all ? json_dumps(all, JSON_COMPACT | JSON_REAL_PRECISION(9)) : NULL, length[ROOM];
  flesh_report_bytes bytes = {0};
  json_decref(all);
  *packed = NULL;
  if (text && !flesh_json_lacks()) {
    snprintf(length, sizeof length, "%0*zu", DIGITS, strlen(text));
    flesh_report_bytes_add(&bytes, length, DIGITS);
    flesh_report_bytes_add(&bytes, text, strlen(text));
    flesh_report_bytes_add(&bytes, report->bytes.data, report->bytes.size);
    uLongf room = compressBound((uLong)bytes.size);
    *packed = bytes.failed ? NULL : malloc(room);
    if (*packed &&
        compress2(*packed, &room, bytes.data, (uLong)bytes.size, Z_BEST_COMPRESSION) != Z_OK) {
      free(*packed);
      *packed = NULL;
    }
    *size = room;
  }
  free(text);
  flesh_report_bytes_free(&bytes);
  return *packed ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "out of memory for a report");
}

int flesh_report_write(const flesh_report *report, const char *title, json_t *head,
                       const char *path, size_t *size, size_t *packed)
{
  static const char TITLE[] = "@TITLE@", LEAD[] = "@LEAD@", STILL[] = "@STILL@", PAYLOAD[] = "@PAYLOAD@";
  const char *at_title = strstr(flesh_report_page, TITLE), *at_lead = strstr(at_title, LEAD),
             *at_still = strstr(at_lead, STILL), *at_payload = strstr(at_still, PAYLOAD);
  unsigned char *payload;
  flesh_file file;
  int status = pack(report, head, &payload, packed);
  if (!status) status = flesh_file_open(path, &file);
  if (!status) {
    *size = print_between(file.stream, flesh_report_page, at_title);
    *size += print_escaped(file.stream, title);
    *size += print_between(file.stream, at_title + strlen(TITLE), at_lead);
    *size += print_lead(file.stream, report->parts);
    *size += print_between(file.stream, at_lead + strlen(LEAD), at_still);
    *size += print_still(file.stream, &report->still);
    *size += print_between(file.stream, at_still + strlen(STILL), at_payload);
    *size += print_base64(file.stream, payload, *packed);
    *size += print_between(file.stream, at_payload + strlen(PAYLOAD), strchr(at_payload, 0));
    status = flesh_file_commit(&file);
  }
  free(payload);
  return status;
}
