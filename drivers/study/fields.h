/* fields.h: numbers of a struct by name: how figures go into the record of a case, and come back from it. */
#ifndef FLESH_STUDY_FIELDS_H
#define FLESH_STUDY_FIELDS_H

#include <jansson.h>
#include <stddef.h>

typedef struct flesh_study_field {
  const char *name;
  enum { FLESH_FIELD_INT, FLESH_FIELD_LONG, FLESH_FIELD_DOUBLE } kind;
  size_t offset;
} flesh_study_field;

/* New object; NaN becomes null. A NULL name ends the fields. */
json_t *flesh_fields_json(const flesh_study_field *fields, const void *from);
/* Fills the struct; -1, and the rest is left, where the object has not one of them. */
int flesh_fields_read(const flesh_study_field *fields, const json_t *object, void *to);
/* New array of their names. */
json_t *flesh_fields_names(const flesh_study_field *fields);

/* New record of a case that has ended, with these figures, which it takes. `message` may be empty. */
json_t *flesh_fields_record(const char *status, int exit_code, const char *message, json_t *figures);

#endif
