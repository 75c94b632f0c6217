/* table.c: CSV tables and texts in a folder of results. */
#include "study/table.h"

#include <math.h>
#include <string.h>

#include "cli/path.h"

int flesh_table_open(const char *folder, const char *name, flesh_file *file)
{
  return flesh_file_open(flesh_path("%s/%s", folder, name), file);
}

int flesh_table_say(const char *folder, const char *name, const char *text)
{
  flesh_file file;
  int status = flesh_table_open(folder, name, &file);
  if (status) return status;
  fputs(text, file.stream);
  status = flesh_file_commit(&file);
  fputs(text, stdout);
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
