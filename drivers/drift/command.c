/* command.c: `flesh drift SCENE...`: how well the energies keep the volume, and which survive. */
#include "commands.h"

#include <stdlib.h>

#include "base/error.h"
#include "drift/drift.h"
#include "study/lead.h"
#include "cli/interrupt.h"
#include "cli/inputs.h"
#include "cli/lists.h"
#include "run/ranks.h"
#include "material/form.h"
#include "study/embedded.h"

/* Energies with the constants they can have. */
static int read_energies(const char *text, flesh_drift_plan *plan)
{
  flesh_energy energies[FLESH_ENERGY_COUNT];
  int count, status = flesh_list_energies(text, FLESH_ENERGY_COUNT, energies, NULL, &count);
  for (int k = 0; k < count && !status; k++) {
    plan->variants[plan->variant_count++] = (flesh_drift_variant){energies[k], flesh_form_default_constants(energies[k])};
    if (flesh_form_takes(energies[k], FLESH_CONSTANTS_AS_E))
      plan->variants[plan->variant_count++] = (flesh_drift_variant){energies[k], FLESH_CONSTANTS_AS_E};
  }
  return status;
}

static int read_solvers(const char *text, flesh_drift_plan *plan)
{
  const char *const names[] = {flesh_drift_solver_name(FLESH_DRIFT_GUARDED), flesh_drift_solver_name(FLESH_DRIFT_PLAIN),
                               NULL};
  int chosen[FLESH_DRIFT_SOLVERS];
  const int status = flesh_list_words("solvers", text, names, chosen, &plan->solver_count);
  for (int k = 0; k < plan->solver_count; k++) plan->solvers[k] = (flesh_drift_solver)chosen[k];
  return status;
}

/* Cases in the order of the table. */
static int make_cases(flesh_drift_plan *plan)
{
  plan->case_count = plan->scene_count * plan->poisson_count * plan->variant_count * plan->solver_count;
  plan->cases = calloc((size_t)plan->case_count, sizeof *plan->cases);
  if (!plan->cases) return flesh_no_memory();
  flesh_drift_case *c = plan->cases;
  for (int s = 0; s < plan->scene_count; s++)
    for (int p = 0; p < plan->poisson_count; p++)
      for (int v = 0; v < plan->variant_count; v++)
        for (int g = 0; g < plan->solver_count; g++)
          *c++ = (flesh_drift_case){.scene = s, .variant = v, .poisson = p, .solver = plan->solvers[g]};
  return FLESH_OK;
}

/* Every scene must be fine before hours are spent; the constants are judged by the cases. */
static int check_scenes(flesh_drift_plan *plan, flesh_inputs *inputs)
{
  for (int s = 0; s < plan->scene_count; s++) {
    flesh_scene *scene = NULL;
    const char *path = plan->scenes[s].path;
    const int again = s && path == plan->scenes[s - 1].path;
    int status = flesh_drift_read(plan, s, &scene);
    if (!status && !flesh_scene_body(scene)->materials)
      status = flesh_fail(FLESH_ERR_ARGUMENT, "%s: the comparison needs a scene with body.material", path);
    if (!status && flesh_scene_material_count(scene) > 1 && !again && flesh_ranks_first(plan->options.ranks))
      printf("%s: body.material alone is varied; the materials of its regions stay\n", path);
    if (!status) status = flesh_study_fingerprint(scene, path, plan->scenes[s].fingerprint);
    if (!status && !again) flesh_inputs_add_scene(inputs, path, scene);
    flesh_scene_destroy(&scene);
    if (status) return status;
  }
  return FLESH_OK;
}

/* On the first rank. */
static int compare(void *data)
{
  flesh_drift_plan *plan = data;
  printf("runs: %d; scenes: %d, energies: %d, Poisson's ratios: %d, solvers: %d; %d at a time\n", plan->case_count,
         plan->scene_count, plan->variant_count, plan->poisson_count, plan->solver_count,
         flesh_pool_places(plan->options.ranks, plan->options.jobs, plan->case_count));
  fflush(stdout);
  const flesh_study study = flesh_drift_study(plan);
  return flesh_study_do(&study, &plan->options);
}

/* Scenes that stand, and cases; on every rank. */
static int prepare(flesh_drift_plan *plan)
{
  static const char *const names[] = {"drift.csv", "verdict.txt", NULL};
  flesh_inputs inputs = {0};
  int status = check_scenes(plan, &inputs);
  if (!status) status = make_cases(plan);
  if (!status) status = flesh_inputs_spare_in(&inputs, plan->options.out, names, NULL);
  flesh_inputs_close(&inputs);
  return status;
}

int flesh_command_drift(int argc, char **argv)
{
  const char *energies = "B,D,E,S", *poissons = "0.3,0.4,0.45,0.49", *solvers = "guarded,plain";
  const char *elements = "", *refine = "";
  flesh_drift_plan plan = {.options = {.out = "out/drift"}};
  const flesh_option rows[] = {
      {"energies", "LIST", FLESH_OPTION_TEXT, &energies, "forms to compare (default B,D,E,S)"},
      {"poisson", "LIST", FLESH_OPTION_TEXT, &poissons, "Poisson's ratios (default 0.3,0.4,0.45,0.49)"},
      {"solvers", "LIST", FLESH_OPTION_TEXT, &solvers, "guarded, plain or both (default guarded,plain)"},
      {"elements", "LIST", FLESH_OPTION_TEXT, &elements,
       "of tet4, tet10, tet10-mean, in place of the scene's body.element"},
      {"refine", "LIST", FLESH_OPTION_TEXT, &refine,
       "times that each tet is cut into eight, such as 0,1, in place of the scene's body.refine"},
      FLESH_STUDY_OPTION_ROWS(&plan.options, "drift", "also with further scenes, energies and ratios"),
      FLESH_STUDY_OPTION_JOBS(&plan.options),
      {"max-seconds", "S", FLESH_OPTION_POSITIVE, &plan.max_seconds, "budget of each run"},
      FLESH_STUDY_OPTION_SET(&plan.options, "a value of all scenes"),
      {0}};
  const flesh_usage usage = {"drift", "SCENE...", "Compares how well the energies keep the volume.",
                             flesh_own_text("drift_help"), 1, 64, rows, NULL, FLESH_EXITS_OF_INTERRUPTS};
  int count, code = flesh_study_open(&plan.options, &usage, argc, argv, &count);
  if (code != FLESH_OPTIONS_GO_ON) {
    flesh_study_close(&plan.options);
    return code;
  }
  int status = flesh_drift_make_scenes(count, argv + 1, elements, refine, &plan);
  if (!status) status = read_energies(energies, &plan);
  if (!status)
    status = flesh_list_numbers("poisson", poissons, FLESH_LIST_POISSON, FLESH_DRIFT_LIST, plan.poissons,
                                &plan.poisson_count);
  if (!status) status = read_solvers(solvers, &plan);
  flesh_interrupt_watch();
  if (!status) status = prepare(&plan);
  const flesh_study study = flesh_drift_study(&plan);
  code = flesh_study_lead(&study, &plan.options, status, compare, &plan);
  flesh_study_close(&plan.options);
  free(plan.scenes);
  free(plan.cases);
  return code;
}
