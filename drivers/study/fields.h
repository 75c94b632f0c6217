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

/* How a case ended with this flesh_status, in the column `status`; `otherwise`: where it is none of those that all tell. */
const char *flesh_fields_status(int status, const char *otherwise);
/* New record of a case that has ended, with these figures, which it takes. `message` may be empty. */
json_t *flesh_fields_record(const char *status, int exit_code, const char *message, json_t *figures);
/* Takes the record of a case into figures of these fields and into `message`. *crashed_by is 0 or, where its process
 * reported nothing, the signal that ended it, -1 for another end; the figures are then as they were. FLESH_ERR_FILE: the
 * record is not whole; `study` names the database. */
enum { FLESH_STUDY_MESSAGE = 400 };
int flesh_fields_take(const flesh_study_field *fields, const char *study, const json_t *record, void *figures,
                      char message[FLESH_STUDY_MESSAGE], int *crashed_by);

#endif
