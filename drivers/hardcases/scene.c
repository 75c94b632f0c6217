/* scene.c: writes a run of the battery as files for `flesh run`, or as data for other solvers (format:
 * drivers/hardcases.md); names solvers, outcomes, settings and runs. */
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/confine.h"
#include "base/error.h"
#include "base/file.h"
#include "cli/json_memory.h"
#include "hardcases/hardcases.h"
#include "material/form.h"
#include "newton/mechanisms.h"
#include "run/result.h"
#include "run/start.h"

static const double young = 1e5; /* Pa: jelly to rubber */

#define NAME(id, name, ...) name,

const char *flesh_hardcases_solver_name(flesh_hardcases_solver solver)
{
  static const char *const names[] = {FLESH_HARDCASES_SOLVER_LIST(NAME)};
#define WITHOUT(id, name, doc) "without-" name,
  static const char *const without[] = {FLESH_MECHANISM_ROWS(WITHOUT) NULL};
  if (solver < FLESH_HARDCASES_WITHOUT) return names[solver];
  return flesh_hardcases_left_out(solver) ? without[solver - FLESH_HARDCASES_WITHOUT] : NULL;
}

flesh_technique flesh_hardcases_left_out(flesh_hardcases_solver solver)
{
  const unsigned bit = solver < FLESH_HARDCASES_WITHOUT ? 0 : 1u << (solver - FLESH_HARDCASES_WITHOUT);
  return (flesh_technique)(bit & FLESH_TECHNIQUES_ALL);
}

void flesh_hardcases_setting_title(const flesh_hardcases_setting *s, char title[112])
{
  char constants[16] = "", step[32] = "", element[24] = "", body[40] = "";
  if (s->body) snprintf(body, sizeof body, "%.38s ", s->body->name);
  if (s->constants != FLESH_CONSTANTS_MATCHED)
    snprintf(constants, sizeof constants, " %s", flesh_constants_name(s->constants));
  if (fabs(s->step * 60 - 1) > 1e-9) snprintf(step, sizeof step, " h=%g", s->step);
  if (s->element != FLESH_ELEMENT_TET4) snprintf(element, sizeof element, " %s", flesh_element_name(s->element));
  snprintf(title, 112, "%s%s%s %g%s%s %s", body, flesh_energy_name(s->energy), constants, s->poisson, step, element,
           flesh_hardcases_solver_name(s->solver));
}

const char *flesh_hardcases_run_folder(const flesh_hardcases_run *run)
{
  flesh_hardcases_setting own = *run->setting; /* with what the case sets itself, of which the step is not named */
  char seed[24] = "", setting[112];
  const char *body = own.body ? own.body->name : "";
  own.body = NULL;
  own.poisson = flesh_hardcases_poisson(run);
  if (run->hardcase->step > 0) own.step = 1. / 60;
  flesh_hardcases_setting_title(&own, setting);
  for (char *c = setting; *c;)
    if (*c == '=') memmove(c, c + 1, strlen(c));
    else if (*c++ == ' ') c[-1] = '_';
  if (run->hardcase->random) snprintf(seed, sizeof seed, "_seed%d", run->seed);
  return flesh_path("cases/%s%s%s%s_%s", body, *body ? "_" : "", run->hardcase->name, seed, setting);
}

static double step_of(const flesh_hardcases_run *run)
{
  return run->hardcase->step > 0 ? run->hardcase->step : run->setting->step;
}

/* Returns whether the case gets a release because its steps are so short that coming to rest would take thousands of
 * them. */
static int has_long_release(const flesh_hardcases_run *run)
{
  return !run->hardcase->is_static && !(run->hardcase->release > 0) &&
         step_of(run) < 0.99 / 60;
}

static double hard_seconds(const flesh_hardcases_run *run)
{
  double step = step_of(run);
  if (run->hardcase->is_static) return step;
  return has_long_release(run) ? 100 * step : step * fmax(20, round(run->hardcase->seconds / step));
}

static const char *seconds_text(double value, char text[FLESH_NUMBER_SIZE])
{
  if (!(value < 1 && fabs(1 / value - round(1 / value)) < 1e-9)) return flesh_number_text(value, text);
  snprintf(text, FLESH_NUMBER_SIZE, "1/%.0f", 1 / value);
  return text;
}

/* Returns the value with six digits if they are exact, else with all. */
static const char *value_text(double value, char text[FLESH_NUMBER_SIZE])
{
  snprintf(text, FLESH_NUMBER_SIZE, "%g", value);
  return strtod(text, NULL) == value ? text : flesh_number_text(value, text);
}

static void write_material(FILE *stream, const flesh_hardcases_run *run, double factor)
{
  char stiffness[FLESH_NUMBER_SIZE], poisson[FLESH_NUMBER_SIZE];
  fprintf(stream, "{energy: %s, constants: %s, young: %s, poisson: %s}", flesh_energy_name(run->setting->energy),
          flesh_constants_name(run->setting->constants),
          value_text((run->hardcase->young > 0 ? run->hardcase->young : young) * factor, stiffness),
          flesh_number_text(flesh_hardcases_poisson(run), poisson));
}

static void write_solver(FILE *stream, const flesh_hardcases_run *run)
{
#define KEYS(id, name, keys) keys,
  static const char *const keys[] = {FLESH_HARDCASES_SOLVER_LIST(KEYS)};
  /* The tolerance of statics is relative to the first residual, which is huge far from rest. */
  const char *tolerance = run->hardcase->is_static ? "newton_tolerance: 1e-8" : "";
  const flesh_technique left_out = flesh_hardcases_left_out(run->setting->solver);
  char without[64];
  snprintf(without, sizeof without, "techniques: [-%s]", left_out ? flesh_technique_name(left_out) : "");
  const char *key = left_out ? without : keys[run->setting->solver];
  if (*key || *tolerance) fprintf(stream, "solver: {%s%s%s}\n", key, *key && *tolerance ? ", " : "", tolerance);
}

static void write_body(FILE *stream, const flesh_hardcases_run *run)
{
  const flesh_hardcases_case *hardcase = run->hardcase;
  char title[112], number[FLESH_NUMBER_SIZE];
  flesh_hardcases_setting_title(run->setting, title);
  fprintf(stream, "# %s: %s (%s)\n", hardcase->name, hardcase->doc, title);
  fputs("body:\n  mesh: body.mesh\n", stream);
  if (run->setting->element != FLESH_ELEMENT_TET4)
    fprintf(stream, "  element: %s\n", flesh_element_name(run->setting->element));
  fprintf(stream, "  density: %s\n  material: ", value_text(hardcase->density > 0 ? hardcase->density : 1000, number));
  write_material(stream, run, 1);
  if (hardcase->young_ratio > 0) {
    fputs("\n  regions:\n    - tags: [1]\n      material: ", stream);
    write_material(stream, run, hardcase->young_ratio);
  }
  fputs("\neffects:\n  - elasticity: {}\n", stream);
  if (!hardcase->is_static) fputs("  - inertia: {}\n", stream);
  if (hardcase->held == FLESH_HARDCASES_FACE)
    fputs("  - pin: {box: [[-1, -1, -1], [1e-9, 1, 1]]}\n", stream);
  if (hardcase->held == FLESH_HARDCASES_FEET)
    fprintf(stream, "  - pin: {box: [[-1e9, -1e9, -1e9], [%s, 1e9, 1e9]]}\n",
            flesh_number_text(hardcase->offset + 0.05 * 0.2 * (hardcase->scale > 0 ? hardcase->scale : 1), number));
}

static int write_text(const flesh_hardcases_run *run, const char *path, int release)
{
  const flesh_hardcases_case *hardcase = run->hardcase;
  flesh_file file;
  int status = flesh_file_open(path, &file);
  if (status) return status;
  FILE *stream = file.stream;
  char step[FLESH_NUMBER_SIZE], end[FLESH_NUMBER_SIZE];
  /* With the plain solver, runs continue whatever energy they gain. */
  const char *limit = run->setting->solver == FLESH_HARDCASES_PLAIN ? ", max_energy_gain: 1e300}\n" : "}\n";
  write_body(stream, run);
  if (!(release && hardcase->release > 0)) fputs(hardcase->effects, stream);
  if (hardcase->is_static) fputs("time: {method: static}\n", stream);
  else
    fprintf(stream, "time: {step: %s, end: %s%s",
            seconds_text(!release ? step_of(run) : hardcase->release_step > 0 ? hardcase->release_step : 1. / 60, step),
            seconds_text(hard_seconds(run) + (!release ? 0 : hardcase->release > 0 ? hardcase->release : hardcase->seconds), end),
            limit);
  fprintf(stream, "start: {state: %s}\n", release ? "out/state.txt" : "start.txt");
  write_solver(stream, run);
  return flesh_file_commit(&file);
}

/* Makes a block of the battery's size, or reads the file's tets with four nodes each and moves and scales them to begin
 * at 0 and to be 0.2 m long along x; then scales and moves as the case asks. */
static int make_body(const flesh_hardcases_body *body, const flesh_hardcases_case *hardcase, flesh_mesh **mesh)
{
  const double length = 0.2 * (hardcase->scale > 0 ? hardcase->scale : 1);
  flesh_mesh *read = NULL, *lowered = NULL;
  flesh_mesh_info info;
  if (!body->file)
    return flesh_mesh_box(body->cells, (double[3]){length, length / 2, length / 2},
                          (double[3]){hardcase->offset, hardcase->offset, hardcase->offset}, mesh);
  int status = flesh_mesh_read(body->file, &read);
  if (!status && flesh_mesh_order(read) == 2) {
    status = flesh_mesh_lower_order(read, &lowered);
    flesh_mesh_destroy(&read);
    read = lowered;
  }
  if (status) return status;
  flesh_mesh_inspect(read, &info);
  double *x = malloc(sizeof *x * 3 * (size_t)info.nodes);
  if (!x) status = flesh_no_memory();
  for (int d = 0; d < 3 * info.nodes && !status; d++)
    x[d] = hardcase->offset + (flesh_mesh_positions(read)[d] - info.low[d % 3]) * length / (info.high[0] - info.low[0]);
  if (!status) status = flesh_mesh_create(info.nodes, x, info.tets, flesh_mesh_tets(read), NULL, mesh);
  free(x);
  flesh_mesh_destroy(&read);
  return status;
}

int flesh_hardcases_run_mesh(const flesh_hardcases_plan *plan, const flesh_hardcases_run *run, flesh_mesh **mesh)
{
  flesh_mesh *corners = NULL;
  *mesh = NULL;
  int status = run->setting->body ? make_body(run->setting->body, run->hardcase, &corners)
                                  : flesh_hardcases_make_mesh(run->hardcase, plan->quick, &corners);
  if (status || run->setting->element == FLESH_ELEMENT_TET4) {
    *mesh = corners;
    return status;
  }
  status = flesh_mesh_raise_order(corners, mesh);
  flesh_mesh_destroy(&corners);
  return status;
}

static int write_start(const flesh_hardcases_plan *plan, const flesh_hardcases_run *run,
                       const char *folder)
{
  flesh_mesh *mesh = NULL;
  int status = flesh_hardcases_run_mesh(plan, run, &mesh);
  if (status) return status;
  status = flesh_mesh_write(mesh, flesh_path("%s/body.mesh", folder));
  int nodes = flesh_mesh_node_count(mesh);
  flesh_state state = {0};
  if (!status) status = flesh_state_make(nodes, 0, 0, &state);
  if (!status) status = flesh_hardcases_make_start(run->hardcase, mesh, run->seed, step_of(run), &state);
  if (!status) status = flesh_state_write(flesh_path("%s/start.txt", folder), nodes, &state);
  free(state.x);
  flesh_mesh_destroy(&mesh);
  return status;
}

int flesh_hardcases_write_scene(const flesh_hardcases_plan *plan, const flesh_hardcases_run *run,
                                const char *folder)
{
  int status = flesh_folder_make(folder);
  flesh_folder_clear(folder);
  if (!status) status = write_start(plan, run, folder);
  if (!status) status = write_text(run, flesh_path("%s/scene.yaml", folder), 0);
  const char *path = flesh_path("%s/release.yaml", folder);
  flesh_path_unlink(path); /* left by an older battery */
  if (!status && (run->hardcase->release > 0 || has_long_release(run)))
    status = write_text(run, path, 1);
  return status;
}

enum { VERSION = 1 };

/* A residual is in balance below this share of the shear modulus times the mean edge squared, times the root of the number of
 * nodes; an energy is that of rest below this share of the shear modulus times the volume. */
static const double in_balance = 1e-6, at_rest = 1e-6;

/* Returns for each tet the index of its material in the list of materials; null if all have the first. */
static json_t *tet_material_json(const flesh_body *body)
{
  if (!body->tet_material) return json_null();
  json_t *places = json_array();
  for (int t = 0; t < flesh_mesh_tet_count(body->mesh); t++)
    json_array_append_new(places, json_integer(body->tet_material[t]));
  return places;
}

/* Returns the constrained nodes with their positions, as rows [node, x, y, z]. */
static json_t *fixed_json(const flesh_scene *scene, const uint8_t *fixed)
{
  const flesh_mesh *mesh = flesh_scene_mesh(scene);
  json_t *rows = json_array();
  for (int i = 0; i < flesh_mesh_node_count(mesh); i++) {
    const double *x = flesh_mesh_positions(mesh) + 3 * i;
    if (fixed[3 * i]) json_array_append_new(rows, json_pack("[ifff]", i, x[0], x[1], x[2]));
  }
  return rows;
}

/* Returns the criterion for a recovered end; flesh's own runs are judged by the one in the command's --help, which is
 * the same. */
static json_t *judge_json(const flesh_scene *scene, int held)
{
  const flesh_material *m = flesh_scene_body(scene)->materials;
  flesh_mesh_info info;
  flesh_mesh_inspect(flesh_scene_mesh(scene), &info);
  const double force = in_balance * m->mu * info.edge_mean * info.edge_mean * sqrt(info.nodes);
  return json_pack("{sisfsfso}", "inverted", 0, "residual", force, "energy", at_rest * m->mu * info.volume, "distance",
                   held ? json_real(FLESH_HARDCASES_TOLERANCE * (info.high[0] - info.low[0])) : json_null());
}

static int write_case(const flesh_hardcases_run *run, const flesh_scene *scene, const char *path)
{
  const char *name = strrchr(path, '/') + 1;
  uint8_t *fixed = calloc(3 * (size_t)flesh_mesh_node_count(flesh_scene_mesh(scene)), 1);
  if (!fixed) return flesh_no_memory();
  const int held = flesh_system_fixed(flesh_scene_system(scene), 0, fixed);
  json_t *value = json_pack(
      "{ss si ss ss ss ss so* so* so* so* s[] so*}", "format", "flesh-case", "version", VERSION, "name", name, "mesh",
      "body.mesh", "start", "start.txt", "element", flesh_element_name(run->setting->element), "doc",
      flesh_json_text(run->hardcase->doc), "materials", flesh_materials_json(scene), "tet_material",
      tet_material_json(flesh_scene_body(scene)), "fixed", fixed_json(scene, fixed), "loads", "judge", judge_json(scene, held));
  free(fixed);
  return flesh_json_write(flesh_path("%s/case.json", path), value);
}

static int export_run(const flesh_hardcases_plan *plan, const flesh_hardcases_run *run)
{
  const char *folder = flesh_hardcases_run_folder(run);
  char path[1300];
  flesh_scene *scene = NULL;
  snprintf(path, sizeof path, "%s/%.*s", plan->options.out, (int)(strlen(folder) - strlen("_default")), folder);
  int status = flesh_hardcases_write_scene(plan, run, path);
  if (!status) status = flesh_scene_read(flesh_path("%s/scene.yaml", path), 0, NULL, &scene);
  if (!status) status = write_case(run, scene, path);
  flesh_scene_destroy(&scene);
  return status;
}

/* Returns whether the run is an equilibrium in which the body returns to its rest shape by itself, with an element that
 * other solvers have. */
static int is_for_others(const flesh_hardcases_run *run)
{
  flesh_material material;
  return run->hardcase->is_static && !*run->hardcase->effects &&
         run->setting->element != FLESH_ELEMENT_TET10_MEAN &&
         !flesh_material_from_young(run->setting->energy, run->setting->constants, 1, flesh_hardcases_poisson(run),
                                    &material) &&
         !flesh_material_is_stressed_at_rest(&material);
}

int flesh_hardcases_export(const flesh_hardcases_plan *plan)
{
  int written = 0, status = FLESH_OK;
  for (int s = 0; s < plan->setting_count; s++)
    if (plan->settings[s].solver != FLESH_HARDCASES_DEFAULT)
      return flesh_fail(FLESH_ERR_ARGUMENT, "--export writes cases, which have no solver; leave --solvers and --ablation out");
  for (int k = 0; k < plan->run_count && !status; k++) {
    if (!is_for_others(&plan->runs[k])) continue;
    status = export_run(plan, &plan->runs[k]);
    written++;
  }
  if (!written)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "--export finds no case that is static, has no effects, is stress-free at rest and of tet4 or tet10");
  if (!status)
    printf("%d cases written to %s/cases, %d left out: they move, have effects, are stressed at rest or of tet10-mean\n",
           written, plan->options.out, plan->run_count - written);
  return status;
}
