/* export.c: static cases as data that other solvers read (drivers/hardcases.md has the format). */
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "cli/json_memory.h"
#include "hardcases/hardcases.h"
#include "run/result.h"

enum { VERSION = 1 };

/* Residuals below this share of the shear modulus times an edge's area are in balance; an energy below this share of the
 * shear modulus times the volume is that of rest. */
static const double in_balance = 1e-6, at_rest = 1e-6;

/* The material of each tet as its place in the list of materials; null: all have the first. */
static json_t *tet_material_json(const flesh_body *body)
{
  if (!body->tet_material) return json_null();
  json_t *places = json_array();
  for (int t = 0; t < flesh_mesh_tet_count(body->mesh); t++)
    json_array_append_new(places, json_integer(body->tet_material[t]));
  return places;
}

/* The constrained nodes with their positions, as rows [node, x, y, z]. */
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

/* The end that counts as well: `--help` of the command has the same criterion for flesh's own runs. */
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
      flesh_json_text(run->row->doc), "materials", flesh_materials_json(scene), "tet_material",
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

/* Whether the run is an equilibrium that comes back to the rest shape by itself, of an element that others have. */
static int is_for_others(const flesh_hardcases_run *run)
{
  flesh_material material;
  double mu, stress;
  return run->row->flags & FLESH_HARDCASES_STATIC && !*run->row->effects &&
         run->setting->element != FLESH_ELEMENT_TET10_MEAN &&
         !flesh_material_from_young(run->setting->energy, run->setting->constants, 1, flesh_hardcases_poisson(run),
                                    &material) &&
         !flesh_material_small_strain(&material, &mu, NULL, &stress) && fabs(stress) < 1e-9 * mu;
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
