/* keep.c: what is kept of a comparison beside its runs: cases that come up as it goes, and the reference. */
#include <stddef.h>
#include <unistd.h>

#include "accuracy/accuracy.h"
#include "base/confine.h"
#include "base/error.h"
#include "cli/json_memory.h"
#include "run/provenance.h"
#include "study/fields.h"

#define OF_REFERENCE(kind, name, member) {name, FLESH_FIELD_##kind, offsetof(flesh_accuracy_reference, member)}
const flesh_study_field flesh_accuracy_reference_fields[] = {
    OF_REFERENCE(DOUBLE, "apart", apart), OF_REFERENCE(DOUBLE, "change", change), OF_REFERENCE(DOUBLE, "between", between),
    OF_REFERENCE(DOUBLE, "uncertainty_position_rms", uncertainty.position_rms),
    OF_REFERENCE(DOUBLE, "uncertainty_position_max", uncertainty.position_max),
    OF_REFERENCE(DOUBLE, "uncertainty_tip", uncertainty.tip), OF_REFERENCE(DOUBLE, "uncertainty_volume", uncertainty.volume),
    OF_REFERENCE(DOUBLE, "uncertainty_energy", uncertainty.energy), OF_REFERENCE(DOUBLE, "length", scale.length),
    OF_REFERENCE(DOUBLE, "motion", scale.motion), OF_REFERENCE(INT, "tip_node", scale.tip),
    OF_REFERENCE(INT, "tip_axis", scale.tip_axis), OF_REFERENCE(DOUBLE, "tip_motion", scale.tip_motion),
    OF_REFERENCE(DOUBLE, "kinetic_energy", scale.energy), OF_REFERENCE(DOUBLE, "period", scale.period),
    OF_REFERENCE(INT, "times", times), OF_REFERENCE(DOUBLE, "start_t", start), OF_REFERENCE(DOUBLE, "end_t", end), {0}};

/* accuracy.json: the reference for people, reports and the ranks behind the first. */
int flesh_accuracy_keep(const flesh_accuracy_plan *plan, const char *words)
{
  json_t *reference = flesh_fields_json(flesh_accuracy_reference_fields, &plan->reference);
  json_object_set_new(reference, "made_by", flesh_json_text(words));
  return flesh_json_write(flesh_path("%s/accuracy.json", plan->options.out),
                          json_pack("{so* so* so*}", "scene_path", flesh_json_text(plan->scene), "program",
                                    flesh_provenance_program(plan->options.argc, plan->options.argv), "reference", reference));
}

int flesh_accuracy_load(flesh_accuracy_plan *plan)
{
  const char *path = flesh_path("%s/accuracy.json", plan->options.out);
  json_t *root = json_load_file(path, 0, NULL);
  const int lacks = flesh_fields_read(flesh_accuracy_reference_fields, json_object_get(root, "reference"), &plan->reference);
  json_decref(root);
  return lacks ? flesh_fail(FLESH_ERR_FILE, "%s: its reference is incomplete", path) : FLESH_OK;
}

int flesh_accuracy_known(flesh_accuracy_session *s, int number)
{
  flesh_accuracy_row *row = &s->plan->rows[number];
  row->done = 0;
  int status = flesh_study_store_want(&s->store, &s->study, number);
  if (!status) status = flesh_study_store_load(&s->store, &s->study);
  const char *path = flesh_accuracy_states_path(s->plan, number);
  const int lacks = row->done && !row->figures.status && *path && row->needs_states && flesh_path_access(path, R_OK);
  if (status || !lacks) return status;
  row->done = 0;
  return flesh_study_store_redo(&s->store, "1", number);
}

int flesh_accuracy_do(flesh_accuracy_session *s, int number)
{
  flesh_accuracy_row *row = &s->plan->rows[number];
  flesh_study study = s->study;
  const int status = flesh_accuracy_known(s, number);
  if (status || row->done) return status;
  if (row->group == FLESH_ACCURACY_SOURCE) study.max_seconds = 2 * (s->plan->max_seconds + s->plan->reference_seconds) + 2;
  s->store.first = number, s->store.end = number + 1;
  return flesh_study_run(&study, &s->store, &s->plan->options);
}
