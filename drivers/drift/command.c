/* command.c: `flesh drift SCENE...`: how well the energies keep the volume, and which survive. */
#include "drift/command.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "drift/drift.h"
#include "flesh/scene.h"
#include "cli/interrupt.h"
#include "base/file.h"
#include "cli/inputs.h"
#include "cli/overrides.h"
#include "run/point_load.h"
#include "picture/plot.h"
#include "cli/output.h"
#include "run/ranks.h"
#include "material/form.h"

static const char details[] =
    "Runs every scene with every energy and Poisson's ratio, keeping the scene's Young's modulus (of the small\n"
    "strain, so that both mean the same for all: matched constants). Forms without a match run with raw ones,\n"
    "D also with those of E (as_e). Each runs twice: guarded, with the scene's own solver, and plain, with ten\n"
    "full Newton steps at most (clamped Hessian) and no line search, as in programs that accept every step.\n\n"
    "Writes into DIR: drift.csv (a row per run; runs that fail are rows too), verdict.txt, volume_*.png (volume\n"
    "against time), worst_*.png (the frame of largest change of volume of each energy, coloured by J), shapes_*.png\n"
    "(all energies side by side: before the scene's last event, such as a release, and at the end), and runs/\n"
    "(each with history.csv, result.json and the states pictured).\n"
    "To see the error of the mesh, compare two resolutions and two elements: give the scene on two meshes,\n"
    "or --refine 0,1, and --elements tet4,tet10-mean. The verdict then speaks of the finest (the most accurate\n"
    "element on the mesh with the most nodes) and claims what the next finest confirms; of the other runs it says\n"
    "by how much they are off. drift.csv has element, nodes, finest (1 where the verdict speaks of the row),\n"
    "mesh_part (max_volume_drift less that of the finest) and mesh_unsure (how far the finest may be off:\n"
    "what the two finest differ by, and more where their meshes differ by less than twice in size).\n";

enum { VARIANT_LIMIT = 16, POISSON_LIMIT = 16 };

/* "B,D,E,S" as energies with the constants they can have. */
static int read_energies(const char *text, flesh_drift_variant *variants, int *count)
{
  char name[16];
  for (*count = 0; *text;) {
    size_t length = strcspn(text, ",");
    snprintf(name, sizeof name, "%.*s", (int)(length < 15 ? length : 15), text);
    flesh_energy energy;
    int status = flesh_energy_from_name(name, &energy);
    if (status) return flesh_fail_within(status, "--energies: ");
    for (int v = 0; v < *count; v++)
      if (variants[v].energy == energy)
        return flesh_fail(FLESH_ERR_ARGUMENT, "--energies names %s twice; once is enough", name);
    if (*count + 2 > VARIANT_LIMIT)
      return flesh_fail(FLESH_ERR_ARGUMENT, "--energies names more than %d forms", VARIANT_LIMIT / 2);
    variants[(*count)++] = (flesh_drift_variant){energy, flesh_form_default_constants(energy)};
    if (flesh_form_takes(energy, FLESH_CONSTANTS_AS_E)) variants[(*count)++] = (flesh_drift_variant){energy, FLESH_CONSTANTS_AS_E};
    text += length + (text[length] == ',');
  }
  return *count ? FLESH_OK : flesh_fail(FLESH_ERR_ARGUMENT, "--energies is empty; it must be a list such as B,D,E,S");
}

static int read_poissons(const char *text, double *poissons, int *count)
{
  char number[32];
  for (*count = 0; *text;) {
    size_t length = strcspn(text, ",");
    snprintf(number, sizeof number, "%.*s", (int)(length < 31 ? length : 31), text);
    double value;
    if (flesh_option_number(number, &value) || !(value > -1 && value <= 0.5))
      return flesh_fail(FLESH_ERR_ARGUMENT, "--poisson has '%s'; every value must be in (-1, 0.5]", number);
    if (*count == POISSON_LIMIT)
      return flesh_fail(FLESH_ERR_ARGUMENT, "--poisson has more than %d values", POISSON_LIMIT);
    for (int p = 0; p < *count; p++)
      if (poissons[p] == value)
        return flesh_fail(FLESH_ERR_ARGUMENT, "--poisson has %g twice; once is enough", value);
    poissons[(*count)++] = value;
    text += length + (text[length] == ',');
  }
  return *count ? FLESH_OK
                : flesh_fail(FLESH_ERR_ARGUMENT, "--poisson is empty; it must be a list such as 0.3,0.45");
}

static int read_solvers(const char *text, flesh_drift_solver *solvers, int *count)
{
  static const flesh_drift_solver both[] = {FLESH_DRIFT_GUARDED, FLESH_DRIFT_PLAIN};
  *count = 0;
  if (!strcmp(text, "guarded") || !strcmp(text, "guarded,plain")) solvers[(*count)++] = both[0];
  if (!strcmp(text, "plain") || !strcmp(text, "guarded,plain")) solvers[(*count)++] = both[1];
  return *count ? FLESH_OK
                : flesh_fail(FLESH_ERR_ARGUMENT,
                             "--solvers is '%s'; it must be guarded, plain or guarded,plain", text);
}

/* Cases in the order of the table; figures that say "not run". */
static int make_cases(flesh_drift_plan *plan)
{
  plan->case_count = plan->scene_count * plan->poisson_count * plan->variant_count * plan->solver_count;
  plan->cases = calloc((size_t)plan->case_count, sizeof *plan->cases);
  if (!plan->cases) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  flesh_drift_case *c = plan->cases;
  for (int s = 0; s < plan->scene_count; s++)
    for (int p = 0; p < plan->poisson_count; p++)
      for (int v = 0; v < plan->variant_count; v++)
        for (int g = 0; g < plan->solver_count; g++, c++) {
          *c = (flesh_drift_case){.scene = s, .variant = v, .poisson = p, .solver = plan->solvers[g]};
          c->figures = (struct flesh_drift_figures){
              .status = FLESH_ERR_INTERRUPTED, .exit_code = 130, .first_inverted_step = -1,
              .max_volume_drift = NAN, .final_volume_drift = NAN, .rest_volume_ratio = NAN,
              .rest_volume_ratio_theory = NAN, .J_min = NAN, .J_bound = NAN, .newton_per_step = NAN,
              .linear_per_newton = NAN, .wall_s = NAN, .failed_at = NAN, .distance_from_rest = NAN};
        }
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
    if (!status) plan->scenes[s].point_load = flesh_point_load(scene) != NULL;
    flesh_scene_destroy(&scene);
    if (status) return status;
  }
  return FLESH_OK;
}

/* A run that could not write its files says nothing of its energy. */
static int check_written(const flesh_drift_plan *plan)
{
  int count = 0, first = -1;
  for (int k = 0; k < plan->case_count; k++) {
    if (plan->cases[k].figures.exit_code != flesh_exit_code(FLESH_ERR_FILE)) continue;
    if (!count++) first = k;
  }
  return count ? flesh_fail(FLESH_ERR_FILE, "%d of %d runs could not write or read their files; the first: %s", count,
                            plan->case_count, plan->cases[first].figures.message)
               : FLESH_OK;
}

static int run_and_draw(flesh_drift_plan *plan)
{
  printf("%d runs: %d scene%s, %d energies, %d Poisson's ratios, %d solvers; %d at a time\n", plan->case_count,
         plan->scene_count, plan->scene_count == 1 ? "" : "s", plan->variant_count, plan->poisson_count,
         plan->solver_count, flesh_pool_places(plan->options.ranks, plan->options.jobs, plan->case_count));
  fflush(stdout);
  int ran = flesh_drift_run(plan);
  char words[1024];
  snprintf(words, sizeof words, "%s", flesh_error_text());
  int status = flesh_drift_write_table(plan);
  if (!status && !ran) status = check_written(plan);
  if (!status) status = flesh_drift_write_verdict(plan);
  if (ran) return flesh_fail(ran, "%s", words);
  const int undrawn = status ? status : flesh_drift_draw(plan);
  if (!status) status = flesh_plot_accept("drift", undrawn);
  if (status) return status;
  printf("\nresults: %s/drift.csv, %s/verdict.txt, %s %s/*.png\n", plan->out, plan->out,
         undrawn ? "what could be drawn of the pictures" : "pictures", plan->out);
  return FLESH_OK;
}

/* Scenes that stand, and cases; on every rank. */
static int prepare(flesh_drift_plan *plan)
{
  static const char *const names[] = {"drift.csv", "verdict.txt", NULL};
  flesh_inputs inputs = {0};
  int status = check_scenes(plan, &inputs);
  if (!status) status = make_cases(plan);
  if (!status) status = flesh_inputs_spare_in(&inputs, plan->out, names, NULL);
  flesh_inputs_close(&inputs);
  return status;
}

/* On the first rank; the exit code. */
static int compare(void *data)
{
  flesh_drift_plan *plan = data;
  flesh_folder_claim claim = {.descriptor = -1};
  int status = flesh_output_claim(plan->out, "drift", &claim);
  if (!status) status = run_and_draw(plan);
  flesh_folder_claim_release(&claim);
  const int code = status ? flesh_command_fail("drift", status) : 0;
  return status == FLESH_ERR_INTERRUPTED ? flesh_interrupt_exit_code() : code;
}

int flesh_command_drift(int argc, char **argv)
{
  const char *energies = "B,D,E,S", *poissons = "0.3,0.4,0.45,0.49", *solvers = "guarded,plain";
  const char *elements = "", *refine = "";
  flesh_drift_variant variants[VARIANT_LIMIT];
  double ratios[POISSON_LIMIT];
  flesh_drift_solver solver_list[FLESH_DRIFT_SOLVERS];
  flesh_overrides overrides;
  flesh_drift_plan plan = {.options = {.out = "out/drift"}, .variants = variants, .poissons = ratios,
                           .solvers = solver_list};
  int status = flesh_ranks_open(&plan.options.ranks);
  if (!status) status = flesh_overrides_open(&overrides, argc);
  if (status) return flesh_command_fail("drift", status);
  const flesh_option rows[] = {
      {"energies", "LIST", FLESH_OPTION_TEXT, &energies, "forms to compare (default B,D,E,S)"},
      {"poisson", "LIST", FLESH_OPTION_TEXT, &poissons, "Poisson's ratios (default 0.3,0.4,0.45,0.49)"},
      {"solvers", "LIST", FLESH_OPTION_TEXT, &solvers, "guarded, plain or both (default guarded,plain)"},
      {"elements", "LIST", FLESH_OPTION_TEXT, &elements,
       "of tet4, tet10, tet10-mean, in place of the scene's body.element"},
      {"refine", "LIST", FLESH_OPTION_TEXT, &refine,
       "times that each tet is cut into eight, such as 0,1, in place of the scene's body.refine"},
      {"out", "DIR", FLESH_OPTION_TEXT, &plan.options.out, "folder of the results (default out/drift)"},
      {"jobs", "N", FLESH_OPTION_COUNT, &plan.options.jobs,
       "runs at a time, on each rank (default: the processors; on several ranks 1)"},
      {"resume", NULL, FLESH_OPTION_SWITCH, &plan.options.resume,
       "go on with DIR/drift.db, also with further scenes, energies and ratios, or begin"},
      {"shard", "I/N", FLESH_OPTION_TEXT, &plan.options.shard, "only every N-th run from the I-th on, counted from 1"},
      {"max-seconds", "S", FLESH_OPTION_POSITIVE, &plan.max_seconds, "budget of each run"},
      {"set", "KEY=VALUE", FLESH_OPTION_LIST, &overrides.texts, "a value of all scenes"},
      {0}};
  const flesh_usage usage = {"drift", "SCENE...", "Compares how well the energies keep the volume.",
                             details, 1, 64, rows, NULL, FLESH_EXITS_OF_INTERRUPTS};
  int count, code = flesh_ranks_read_options(plan.options.ranks, &usage, argc, argv, &count);
  if (code != FLESH_OPTIONS_GO_ON) {
    flesh_ranks_close(&plan.options.ranks);
    flesh_overrides_close(&overrides);
    return code;
  }
  plan.overrides = &overrides.texts;
  plan.out = plan.options.out;
  int shard, shards;
  status = flesh_study_read_shard(plan.options.shard, &shard, &shards);
  if (!status) status = flesh_drift_make_scenes(count, argv + 1, elements, refine, &plan);
  if (!status) status = read_energies(energies, variants, &plan.variant_count);
  if (!status) status = read_poissons(poissons, ratios, &plan.poisson_count);
  if (!status) status = read_solvers(solvers, solver_list, &plan.solver_count);
  flesh_interrupt_watch();
  if (!status) status = prepare(&plan);
  plan.options.jobs = flesh_pool_jobs(plan.options.ranks, plan.options.jobs);
  const flesh_study study = flesh_drift_study(&plan);
  const flesh_study_work given = {&study, NULL};
  const flesh_pool_cases cases = flesh_study_pool_cases(&given);
  code = flesh_pool_lead(plan.options.ranks, "drift", status, plan.options.jobs, &cases, compare, &plan);
  flesh_ranks_close(&plan.options.ranks);
  free(plan.scenes);
  free(plan.cases);
  flesh_overrides_close(&overrides);
  return code;
}
