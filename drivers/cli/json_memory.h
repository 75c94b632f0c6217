/* json_memory.h: notes when jansson runs out of memory, as it then leaves out keys without an error; makes JSON from
 * texts that may not be UTF-8 and from numbers that may not be finite; reads and writes JSON files. */
#ifndef FLESH_CLI_JSON_MEMORY_H
#define FLESH_CLI_JSON_MEMORY_H

#include <jansson.h>

/* Starts to watch. To be called before any other function of jansson. */
void flesh_json_watch(void);
/* Notes that memory ran out for something that should have become JSON. */
void flesh_json_note_lack(void);
/* Returns whether memory has run out since: JSON made since then may be incomplete. */
int flesh_json_lacks(void);

/* Returns a text from outside, or `size` bytes, as a new string: bytes that are not UTF-8 become '?', zero bytes
 * spaces. NULL if memory runs out, which is noted. */
json_t *flesh_json_text(const char *text);
json_t *flesh_json_bytes(const char *bytes, size_t size);

/* Return a number, or a new array of `count` numbers; null for those that are not finite. */
json_t *flesh_json_number(double value);
json_t *flesh_json_numbers(int count, const double *values);

/* Reads the file into a new *value. FLESH_ERR_FILE if there is no such file, or no JSON in it. */
int flesh_json_read(const char *path, json_t **value);
/* Writes `value` to `path`, completely or not at all. Takes ownership of `value`, also on failure. */
int flesh_json_write(const char *path, json_t *value);

#endif
