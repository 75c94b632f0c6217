/* column.c: what the columns of tables are called. */
#include "plot/column.h"

#include <fnmatch.h>
#include <stdio.h>
#include <string.h>

/* The units of history.csv's columns (observer.h), whose header has none. Those of effects go by what is reported:
 * weld_traction, and weld_2_traction of the second weld. */
static const char *history_unit(const char *name)
{
  static const char *const units[][2] = {
      {"t", "s"},   {"h", "s"},     {"residual", "N"}, {"residual_target", "N"}, {"volume", "m^3"},
      {"gap", "m"}, {"force", "N"}, {"released", "J"}, {"traction", "Pa"}};
  if (!strncmp(name, "energy_", 7)) return "J";
  if (!strncmp(name, "contact_", 8) || !strncmp(name, "weld_", 5)) name = strrchr(name, '_') + 1;
  for (size_t k = 0; k < sizeof units / sizeof *units; k++)
    if (!strcmp(name, units[k][0])) return units[k][1];
  return "";
}

void flesh_csv_label(const flesh_csv *csv, int column, char name[FLESH_CSV_NAME], char unit[FLESH_CSV_NAME])
{
  const char *header = csv->names[column], *bracket = strrchr(header, '['), *slash = strrchr(csv->path, '/');
  size_t length = strlen(header);
  *unit = 0;
  if (bracket && bracket > header && header[length - 1] == ']') {
    snprintf(unit, FLESH_CSV_NAME, "%.*s", (int)(header + length - 1 - bracket - 1), bracket + 1);
    length = (size_t)(bracket - header);
    while (length && header[length - 1] == ' ') length--;
  }
  snprintf(name, FLESH_CSV_NAME, "%.*s", (int)length, header);
  if (!*unit && !strcmp(slash ? slash + 1 : csv->path, "history.csv"))
    snprintf(unit, FLESH_CSV_NAME, "%s", history_unit(name));
  if (!strcmp(unit, "1")) *unit = 0;
}

int flesh_csv_matches(const flesh_csv *csv, int column, const char *word)
{
  char name[FLESH_CSV_NAME], unit[FLESH_CSV_NAME], longer[FLESH_CSV_NAME + 16];
  flesh_csv_label(csv, column, name, unit);
  if (!strcmp(word, csv->names[column])) return 1;
  if (!strncmp(word, "probe.", 6) && strcmp(word, "probe.")) word += 6;
  if (!strcmp(word, csv->names[column]) || !fnmatch(word, name, 0)) return 1;
  const char *dot = strrchr(word, '.');
  if (!dot || !dot[1] || dot[2] || !strchr("xyz", dot[1])) return 0;
  snprintf(longer, sizeof longer, "%.*s.position_%c", (int)(dot - word < FLESH_CSV_NAME ? dot - word : 0), word, dot[1]);
  return !strcmp(longer, name);
}
