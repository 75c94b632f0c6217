/* table.h: CSV tables and texts in a folder of results. */
#ifndef FLESH_STUDY_TABLE_H
#define FLESH_STUDY_TABLE_H

#include <stdio.h>

#include "base/file.h"

/* Opens folder/name, whole or not at all. */
int flesh_table_open(const char *folder, const char *name, flesh_file *file);

/* Writes the text into folder/name and, once it stands there, to stdout. */
int flesh_table_say(const char *folder, const char *name, const char *text);

/* A comma and the number so that it reads back bit for bit; nothing behind the comma for NaN. */
void flesh_table_field(FILE *stream, double value);

/* Prints the value by a format of printf for one double; what shows as zero has no sign. Returns `text`. */
enum { FLESH_TABLE_TEXT = 48 };
const char *flesh_table_text(char text[FLESH_TABLE_TEXT], const char *format, double value);

#endif
