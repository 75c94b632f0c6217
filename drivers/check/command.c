/* command.c: `flesh check SCENE`: validates, reports, differentiates; dumps the elastic
 * energy for others. */
#include "commands.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "cli/inputs.h"
#include "base/file.h"
#include "cli/options.h"
#include "scene/scene.h"
#include "study/table.h"
#include "cli/overrides.h"
#include "cli/output.h"
#include "run/result.h"
#include "system/derivative_check.h"
#include "study/embedded.h"

static const double tolerance = 1e-7;

/* The scene's skin, if it has one, is bound to see that it can be. */
static int report_skin(const flesh_scene *scene)
{
  const char *path = flesh_scene_outputs(scene)->skin.surface;
  flesh_surface *surface = NULL;
  flesh_skin *skin = NULL;
  flesh_skin_info info;
  if (!path) return FLESH_OK;
  int status = flesh_surface_read(path, &surface);
  if (!status) status = flesh_skin_bind(flesh_scene_mesh(scene), surface, &skin);
  if (!status) {
    flesh_skin_inspect(skin, &info);
    flesh_skin_print(stdout, path, &info);
  }
  flesh_skin_destroy(&skin);
  flesh_surface_destroy(&surface);
  return status;
}

static void report_mesh(const flesh_scene *scene)
{
  flesh_mesh_info info;
  flesh_mesh_inspect(flesh_scene_mesh(scene), &info);
  printf("mesh: %s\n", flesh_scene_mesh_path(scene));
  printf("  %d nodes (%d unused), %d tet%s (%d flipped), %d surface triangles, %d region%s\n",
         info.nodes, info.unused_nodes, info.tets, info.tets == 1 ? "" : "s", info.flipped,
         info.triangles, info.regions, info.regions == 1 ? "" : "s");
  printf("  volume %.8g m^3, box (%g, %g, %g) to (%g, %g, %g) m\n", info.volume, info.low[0],
         info.low[1], info.low[2], info.high[0], info.high[1], info.high[2]);
  printf("  edges %.4g to %.4g m, radius ratio at least %.3g (tet %d), %.3g on average\n",
         info.edge_min, info.edge_max, info.radius_ratio_min, info.worst_tet,
         info.radius_ratio_mean);
}

static int report_system(const flesh_scene *scene, double t)
{
  const flesh_system *system = flesh_scene_system(scene);
  int unknowns = flesh_system_unknowns(system);
  flesh_block_matrix *K = NULL;
  int status = flesh_system_matrix_create(system, &K);
  uint8_t *fixed = malloc((size_t)unknowns + 1);
  if (!status && !fixed) status = flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  if (!status) {
    printf("effects:");
    for (int e = 0; e < flesh_system_effect_count(system); e++)
      printf("%s %s", e ? "," : "", flesh_system_effect(system, e)->operations->name);
    int held = flesh_system_fixed(system, t, fixed), blocks = K->row_start[K->rows];
    printf("\nunknowns: %d, of which %d are held at the start; Jacobian of %d blocks 3x3 (upper "
           "triangle)\n",
           unknowns, held, blocks);
    flesh_time_print(stdout, scene);
  }
  free(fixed);
  flesh_block_matrix_destroy(&K);
  return status;
}

/* Random and small beside the mesh's edges, halved until no tet is near inversion that was not
 * before, and no node within an obstacle. */
static void disturb(const flesh_system *system, unsigned long long seed, const flesh_state *state,
                    double *moved)
{
  const flesh_mesh *mesh = flesh_system_mesh(system);
  const double *x = state->x;
  flesh_mesh_info info;
  flesh_mesh_inspect(mesh, &info);
  double before = flesh_mesh_jacobian_bounds(mesh, x, NULL, NULL, NULL);
  for (double size = 0.1 * info.edge_min; size > 1e-6 * info.edge_min; size /= 2) {
    unsigned long long random = seed;
    for (int d = 0; d < 3 * info.nodes; d++) {
      random = random * 6364136223846793005ULL + 1442695040888963407ULL;
      moved[d] = x[d] + size * ((double)(random >> 11) * 0x1p-52 - 1);
    }
    if (flesh_system_check(system, state->t, moved)) continue;
    if (before <= 0 || flesh_mesh_jacobian_bounds(mesh, moved, NULL, NULL, NULL) > 0.5 * before) return;
  }
}

static void print_error(double error)
{
  if (isnan(error)) printf("  %10s", "-");
  else printf("  %10.1e", error);
}

static int differentiate(const flesh_scene *scene, const flesh_state *state, int *failed)
{
  const flesh_system *system = flesh_scene_system(scene);
  const flesh_mesh *mesh = flesh_scene_mesh(scene);
  unsigned long long seed = (unsigned long long)flesh_scene_outputs(scene)->seed;
  double *x = malloc(sizeof(double) * (size_t)flesh_system_unknowns(system));
  if (!x) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  disturb(system, seed, state, x);
  printf("derivatives (relative errors):\n  %-12s  %10s  %10s  %10s  %10s  %10s  %10s  %10s\n", "",
         "r static", "r dynamic", "K static", "K dynamic", "evaluate", "asymmetry", "negative");
  *failed = 0;
  for (int e = 0; e < flesh_system_effect_count(system); e++) {
    const flesh_effect *effect = flesh_system_effect(system, e);
    flesh_derivative_report report;
    int zero = 0, status = flesh_effect_check_derivatives_or_zero(effect, mesh, state->t, x, seed, &report, &zero);
    if (status < 0) {
      free(x);
      return status;
    }
    printf("  %-12s", effect->operations->name);
    if (status) {
      printf("  not differentiated: %s\n", flesh_status_text(status));
      (*failed)++;
      continue;
    }
    for (int s = 0; s < FLESH_CHECK_SHIFTS; s++) print_error(report.potential[s]);
    for (int s = 0; s < FLESH_CHECK_SHIFTS; s++) print_error(report.jacobian[s]);
    print_error(fmax(report.evaluate[0], report.evaluate[1]));
    print_error(report.asymmetry);
    print_error(report.negative);
    int fine = flesh_derivative_report_passes(&report, tolerance);
    printf("  %s\n", !fine ? "FAIL" : zero ? "zero" : "pass");
    *failed += !fine;
  }
  free(x);
  return FLESH_OK;
}

static int write_numbers(const char *folder, const char *name, int rows, int columns,
                         const double *const *parts)
{
  flesh_file file;
  const int status = flesh_table_open(folder, name, &file);
  if (status) return status;
  for (int i = 0; i < rows; i++) {
    for (int c = 0; c < columns; c++)
      fprintf(file.stream, "%s%.17g", c ? " " : "", parts[c / 3][3 * i + c % 3]);
    putc('\n', file.stream);
  }
  return flesh_file_commit(&file);
}

static int write_matrix(const char *folder, const flesh_block_matrix *K)
{
  flesh_file file;
  const int status = flesh_table_open(folder, "hessian.mtx", &file);
  if (status) return status;
  long entries = 9L * K->row_start[K->rows] - 3L * K->rows;
  fprintf(file.stream, "%%%%MatrixMarket matrix coordinate real symmetric\n%d %d %ld\n",
          3 * K->rows, 3 * K->rows, entries);
  for (int i = 0; i < K->rows; i++)
    for (int k = K->row_start[i]; k < K->row_end[i]; k++)
      for (int a = 0; a < 3; a++)
        for (int b = k == K->row_start[i] ? a : 0; b < 3; b++)
          fprintf(file.stream, "%d %d %.17g\n", 3 * K->column[k] + b + 1, 3 * i + a + 1,
                  K->values[9 * (size_t)k + 3 * a + b]);
  return flesh_file_commit(&file);
}

/* The elasticity alone, at the start state, not projected. */
static int dump(const flesh_scene *scene, const flesh_state *state, const char *folder)
{
  const flesh_mesh *mesh = flesh_scene_mesh(scene);
  size_t unknowns = (size_t)flesh_system_unknowns(flesh_scene_system(scene));
  if (!flesh_scene_body(scene)->materials)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "--dump: the scene has no body.material, so there is nothing "
                      "to dump");
  flesh_system *system = NULL;
  flesh_effect *elasticity = NULL;
  flesh_block_matrix *K = NULL;
  double *r = calloc(2 * unknowns, sizeof *r), energy[3] = {0};
  flesh_folder_claim claim = {.descriptor = -1};
  int status = r ? flesh_output_claim(folder, "check", &claim) : flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  if (!status) status = flesh_system_create(mesh, &system);
  if (!status) status = flesh_effect_elasticity(flesh_scene_body(scene), &elasticity);
  if (!status) status = flesh_system_add_effect(system, &elasticity);
  if (!status) status = flesh_system_finalize(system);
  if (!status) status = flesh_system_matrix_create(system, &K);
  if (!status) {
    const flesh_point point = flesh_point_at(state->t, state->x, r + unknowns, r + unknowns);
    const flesh_shift shift = {.x = 1};
    status = flesh_system_energies(system, &point, energy);
    if (!status) status = flesh_system_residual(system, &point, r);
    if (!status) status = flesh_system_jacobian(system, &point, &shift, K);
    if (status > 0)
      status = flesh_fail(FLESH_ERR_ARGUMENT, "--dump: at the start state %s",
                          flesh_status_text(status));
  }
  const double *energy_part[] = {energy}, *gradient_parts[] = {state->x, r};
  if (!status) status = write_numbers(folder, "energy.txt", 1, 1, energy_part);
  if (!status)
    status = write_numbers(folder, "gradient.txt", flesh_mesh_node_count(mesh), 6, gradient_parts);
  if (!status) status = write_matrix(folder, K);
  if (!status)
    printf("elasticity at the start state: %s/energy.txt, gradient.txt, hessian.mtx\n", folder);
  flesh_block_matrix_destroy(&K);
  flesh_effect_destroy(&elasticity);
  flesh_system_destroy(&system);
  flesh_folder_claim_release(&claim);
  free(r);
  return status;
}

static int spare_inputs(const char *path, const flesh_scene *scene, const char *folder)
{
  static const char *const names[] = {"energy.txt", "gradient.txt", "hessian.mtx", NULL};
  flesh_inputs inputs = {0};
  flesh_inputs_add_scene(&inputs, path, scene);
  int status = flesh_inputs_spare_in(&inputs, folder, names, NULL);
  flesh_inputs_close(&inputs);
  return status;
}

static int check(const flesh_scene *scene, const char *folder, int *failed)
{
  size_t unknowns = (size_t)flesh_system_unknowns(flesh_scene_system(scene));
  flesh_state state = {.t = 0, .x = malloc(sizeof(double) * unknowns), .v = malloc(sizeof(double) * unknowns)};
  int status = state.x && state.v ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  if (!status) {
    flesh_scene_start(scene, &state);
    report_mesh(scene);
    flesh_materials_print(stdout, scene);
    status = report_skin(scene);
    if (!status) status = report_system(scene, state.t);
  }
  if (!status) status = differentiate(scene, &state, failed);
  if (!status && folder) status = dump(scene, &state, folder);
  free(state.x);
  free(state.v);
  return status;
}

int flesh_command_check(int argc, char **argv)
{
  const char *start_state = NULL, *folder = NULL;
  flesh_overrides overrides;
  int status = flesh_overrides_open(&overrides, argc);
  if (status) return flesh_command_fail("check", status);
  const flesh_option rows[] = {
      {"set", "KEY=VALUE", FLESH_OPTION_LIST, &overrides.texts, "a value of the scene"},
      {"start-state", "FILE", FLESH_OPTION_TEXT, &start_state, "check at the state of this file"},
      {"dump", "DIR", FLESH_OPTION_TEXT, &folder,
       "write energy, gradient and Hessian of the elasticity"},
      {0}};
  const flesh_usage usage = {
      "check", "SCENE", "Validates a scene and differentiates its effects.", flesh_own_text("check_help"), 1, 1, rows, NULL, 0};
  int positionals, failed = 0, code = flesh_options_read(&usage, argc, argv, &positionals);
  flesh_scene *scene = NULL;
  if (code == FLESH_OPTIONS_GO_ON) {
    if (start_state) status = flesh_overrides_add_text(&overrides, "start.state", start_state);
    if (!status)
      status = flesh_scene_read(argv[1], overrides.texts.count, overrides.texts.values, &scene);
    if (!status && folder) status = spare_inputs(argv[1], scene, folder);
    if (!status) status = check(scene, folder, &failed);
    code = status ? flesh_command_fail("check", status) : failed ? 2 : 0;
    if (!status) printf(failed ? "%d of the effects FAILED\n" : "all fine\n", failed);
  }
  flesh_scene_destroy(&scene);
  flesh_overrides_close(&overrides);
  return code;
}
