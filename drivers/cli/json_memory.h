/* json_memory.h: notes where jansson lacks memory, as it then leaves out keys without an error; makes JSON of texts that may
 * not be UTF-8 and of numbers that may not be finite; reads and writes files of JSON. */
#ifndef FLESH_CLI_JSON_MEMORY_H
#define FLESH_CLI_JSON_MEMORY_H

#include <jansson.h>

/* Before any other call of jansson. */
void flesh_json_watch(void);
/* Memory ran out for what should have become JSON. */
void flesh_json_note_lack(void);
/* Whether memory has run out since: what was made of JSON may not be whole. */
int flesh_json_lacks(void);

/* A text from outside, or `size` bytes, as a new string: what is no UTF-8 becomes '?', a zero byte a blank. NULL without
 * memory, which is noted. */
json_t *flesh_json_text(const char *text);
json_t *flesh_json_bytes(const char *bytes, size_t size);

/* A number, or a new array of `count`; null when it is not finite. */
json_t *flesh_json_number(double value);
json_t *flesh_json_numbers(int count, const double *values);

/* Reads the file into a new *value. FLESH_ERR_FILE where there is none, or no JSON in it. */
int flesh_json_read(const char *path, json_t **value);
/* Writes `value` (taken, also on failure) to `path`, whole or not at all. */
int flesh_json_write(const char *path, json_t *value);

#endif
