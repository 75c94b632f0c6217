/* part.c: builds the parts of a report. */
#include "report/part.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "report/csv.h"
#include "cli/json_memory.h"
#include "material/form.h"

json_t *flesh_report_part(flesh_report *report, const char *title, const char *path)
{
  json_t *part =
      json_pack("{sosos[]s[]s[]s[]s[]s[]}", "title", flesh_json_text(title),
                "path", flesh_json_text(path), "verdict", "notes", "tables",
                "plots", "grids", "sources");
  json_array_append_new(report->parts, part);
  return part;
}

static void append(json_t *part, const char *list, const char *format, va_list arguments)
{
  char text[2048];
  vsnprintf(text, sizeof text, format, arguments);
  json_array_append_new(json_object_get(part, list), flesh_json_text(text));
}

void flesh_report_say(json_t *part, const char *format, ...)
{
  va_list arguments;
  va_start(arguments, format);
  append(part, "verdict", format, arguments);
  va_end(arguments);
}

void flesh_report_note(json_t *part, const char *format, ...)
{
  va_list arguments;
  va_start(arguments, format);
  append(part, "notes", format, arguments);
  va_end(arguments);
}

int flesh_report_table(json_t *part, const char *title, json_t *columns, int open)
{
  json_t *tables = json_object_get(part, "tables");
  json_array_append_new(tables,
                        json_pack("{sosbso}", "title", flesh_json_text(title),
                                  "open", open, "columns", columns));
  return (int)json_array_size(tables) - 1;
}

void flesh_report_source(json_t *part, const char *title, json_t *value)
{
  if (!value) return;
  json_array_append_new(
      json_object_get(part, "sources"),
      json_pack("{soso}", "title", flesh_json_text(title), "value", value));
}

static json_t *optional(const char *text) { return text ? flesh_json_text(text) : NULL; }

json_t *flesh_report_add_plot(json_t *part, const flesh_report_plot *p)
{
  json_t *plot =
      json_pack("{sososo s[bb] sbsb sis[] so*so*so*}", "title", flesh_json_text(p->title), "x", flesh_json_text(p->x),
                "y", flesh_json_text(p->y), "log", p->log_x, p->log_y, "lines", p->lines, "choose", p->choose, "table",
                p->table, "series", "group", optional(p->group), "where", optional(p->where), "is", optional(p->is));
  json_array_append_new(json_object_get(part, "plots"), plot);
  return plot;
}

void flesh_report_add_series(json_t *plot, int table, const char *name, const char *colour)
{
  json_array_append_new(json_object_get(plot, "series"),
                        json_pack("{sisoss*}", "table", table, "name",
                                  flesh_json_text(name), "colour", colour));
}

int flesh_report_add_history(json_t *part, json_t *plot, const char *folder, const char *file,
                             const char *name, const char *colour)
{
  enum { MOST_ROWS = 2000 };
  char title[300];
  json_t *columns;
  int step;
  const int status = flesh_report_csv(folder, file, MOST_ROWS, &columns, &step);
  if (status) return status;
  if (!columns) {
    flesh_report_note(part, "%s has no %s that can be read.", name, file);
    return FLESH_OK;
  }
  snprintf(title, sizeof title, "%s: %s", name, file);
  if (step > 1) flesh_report_note(part, "Of %s of %s one row in %d is here.", file, name, step);
  flesh_report_add_series(plot, flesh_report_table(part, title, columns, 0), name, colour);
  return FLESH_OK;
}

const char *flesh_report_energy_colour(const char *letter)
{
  for (int e = 0; e < FLESH_ENERGY_COUNT; e++)
    if (letter && !strcmp(letter, flesh_forms[e].name)) return flesh_forms[e].colour;
  return NULL;
}
