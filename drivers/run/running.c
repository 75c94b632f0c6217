/* running.c: facts about a run that is being made. */
#include "run/running.h"

#include "cli/path.h"
#include "time/integrator.h"

const char *flesh_running_path(const flesh_running *r, const char *name) { return flesh_path("%s/%s", r->options->out, name); }

json_t *flesh_running_result(flesh_running *r, json_t *outcome, const flesh_figures *figures)
{
  json_object_set_new(outcome, "figures",
                      flesh_figures_json(figures, flesh_running_system(r), r->scene));
  if (r->integrator)
    json_object_set_new(outcome, "effects", flesh_costs_json(flesh_integrator_costs(r->integrator),
                                                             flesh_running_system(r)));
  json_object_set_new(outcome, "materials", flesh_materials_json(r->scene));
  if (r->resumed) json_object_set(outcome, "resumed", r->resumed);
  json_object_set(outcome, "inputs", r->inputs);
  json_object_set(outcome, "program", r->program);
  if (r->ranks) json_object_set(outcome, "ranks", r->ranks);
  return outcome;
}

int flesh_running_is_split(const flesh_running *r) { return r->options->ranks && flesh_ranks_mesh_is_split(r->scene); }

const flesh_system *flesh_running_system(const flesh_running *r)
{
  return flesh_running_is_split(r) ? flesh_ranks_system(r->options->ranks, r->scene) : flesh_scene_system(r->scene);
}
