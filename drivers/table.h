/* table.h: CSV tables and texts in a folder of results. */
#ifndef FLESH_DRIVERS_TABLE_H
#define FLESH_DRIVERS_TABLE_H

#include "io/file.h"

/* Opens folder/name, whole or not at all. */
int flesh_table_open(const char *folder, const char *name, flesh_file *file);

/* A comma and the number so that it reads back bit for bit; nothing behind the comma for NaN. */
void flesh_table_field(FILE *stream, double value);

#endif
