/* fields.c: converts numbers of a struct to JSON and back; makes and reads the records of cases. */
#include "study/study.h"

#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/error.h"
#include "cli/json_memory.h"
#include "cli/options.h"
#include "run/provenance.h"

/* Returns the value as JSON, which has no infinities. */
static json_t *number_json(double value)
{
  if (isnan(value)) return json_null();
  return isfinite(value) ? json_real(value) : json_string(value > 0 ? "inf" : "-inf");
}

static double number_of(const json_t *value)
{
  if (json_is_number(value)) return json_number_value(value);
  return json_is_string(value) ? strtod(json_string_value(value), NULL) : NAN;
}

json_t *flesh_fields_json(const flesh_study_field *fields, const void *from)
{
  json_t *object = json_object();
  for (; fields->name; fields++) {
    const char *at = (const char *)from + fields->offset;
    json_t *value = fields->kind == FLESH_FIELD_DOUBLE ? number_json(*(const double *)(const void *)at)
                    : fields->kind == FLESH_FIELD_LONG ? json_integer(*(const long *)(const void *)at)
                                                       : json_integer(*(const int *)(const void *)at);
    json_object_set_new(object, fields->name, value);
  }
  return object;
}

int flesh_fields_read(const flesh_study_field *fields, const json_t *object, void *to)
{
  for (; fields->name; fields++) {
    char *at = (char *)to + fields->offset;
    const json_t *value = json_object_get(object, fields->name);
    if (!value) return -1;
    if (fields->kind == FLESH_FIELD_DOUBLE) *(double *)(void *)at = number_of(value);
    else if (fields->kind == FLESH_FIELD_LONG) *(long *)(void *)at = (long)json_integer_value(value);
    else *(int *)(void *)at = (int)json_integer_value(value);
  }
  return 0;
}

json_t *flesh_fields_names(const flesh_study_field *fields)
{
  json_t *names = json_array();
  for (; fields->name; fields++) json_array_append_new(names, json_string(fields->name));
  return names;
}

const char *flesh_fields_status(int status, const char *otherwise)
{
  switch (status) {
  case FLESH_OK: return "complete";
  case FLESH_NONFINITE:
  case FLESH_ERR_NONFINITE: return "non-finite";
  case FLESH_ERR_BUDGET: return "out of budget";
  case FLESH_ERR_INTERRUPTED: return "interrupted";
  case FLESH_ERR_ARGUMENT: return "refused";
  default: return otherwise;
  }
}

json_t *flesh_fields_record(const char *status, int exit_code, const char *message, json_t *figures)
{
  return json_pack("{ss si so* so*}", "status", status, "exit_code", exit_code, "message", flesh_json_text(message), "result",
                   figures ? json_pack("{so}", "figures", figures) : json_null());
}

json_t *flesh_study_run_scene(const flesh_scene *scene, const flesh_runner_options *options, flesh_outcome *outcome)
{
  flesh_figures figures = {0};
  *outcome = (flesh_outcome){0};
  flesh_runner_run(scene, options, &figures, outcome);
  json_t *result = flesh_outcome_json(outcome);
  json_object_set_new(result, "figures", flesh_figures_json(&figures, flesh_scene_system(scene), scene));
  json_object_set_new(result, "materials", flesh_materials_json(scene));
  json_object_set_new(result, "inputs", flesh_provenance_scene(scene, options->scene_path));
  json_t *record = json_pack("{sssisO}", "status", flesh_outcome_word(outcome), "exit_code", outcome->exit_code, "message",
                             json_object_get(result, "message"));
  json_object_set_new(record, "result", result);
  flesh_figures_close(&figures);
  return record;
}

int flesh_fields_take(const flesh_study_field *fields, const char *study, const json_t *record, void *figures,
                      char message[FLESH_STUDY_MESSAGE], int *crashed_by)
{
  const json_t *found = json_object_get(json_object_get(record, "result"), "figures");
  const char *words = json_string_value(json_object_get(record, "message"));
  const int code = (int)json_integer_value(json_object_get(record, "exit_code"));
  if (json_is_object(found) && flesh_fields_read(fields, found, figures))
    return flesh_fail(FLESH_ERR_FILE, "the record of a case in %s is incomplete", study);
  snprintf(message, FLESH_STUDY_MESSAGE, "%.*s", FLESH_STUDY_MESSAGE - 1, words ? words : "");
  *crashed_by = json_is_object(found)            ? 0
                : code > 128                     ? code - 128
                : code == flesh_exit_code(FLESH_ERR_BUDGET) ? SIGKILL /* it was killed because it hung */
                                                            : -1;
  return FLESH_OK;
}
