/* table.c: CSV tables and texts in a folder of results. */
#include "study/table.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"

int flesh_table_open(const char *folder, const char *name, flesh_file *file)
{
  char *path = malloc(strlen(folder) + strlen(name) + 2);
  if (!path) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  sprintf(path, "%s/%s", folder, name);
  int status = flesh_file_open(path, file);
  free(path);
  return status;
}

int flesh_table_say(const char *folder, const char *name, void (*say)(const void *plan, FILE *stream), const void *plan)
{
  char *text = NULL;
  size_t size = 0;
  flesh_file file;
  FILE *words = open_memstream(&text, &size);
  if (words) say(plan, words);
  int status = words && !fclose(words) ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  if (!status) status = flesh_table_open(folder, name, &file);
  if (!status) {
    fwrite(text, 1, size, file.stream);
    status = flesh_file_commit(&file);
    fwrite(text, 1, size, stdout);
  }
  free(text);
  return status;
}

void flesh_table_field(FILE *stream, double value)
{
  putc(',', stream);
  if (!isnan(value)) flesh_number_print(stream, value);
}

const char *flesh_table_text(char text[FLESH_TABLE_TEXT], const char *format, double value)
{
  snprintf(text, FLESH_TABLE_TEXT, format, value);
  char *sign = text + strspn(text, " ");
  if ((*sign == '-' || *sign == '+') && !sign[1 + strspn(sign + 1, "0.")]) memmove(sign, sign + 1, strlen(sign));
  return text;
}
