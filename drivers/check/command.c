/* command.c: `flesh check SCENE`: validates a scene, reports on it and checks derivatives. */
#include "commands.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/error.h"
#include "cli/options.h"
#include "scene/scene.h"
#include "cli/overrides.h"
#include "run/result.h"
#include "run/start.h"
#include "system/derivative_check.h"
#include "study/embedded.h"

static const double tolerance = 1e-7;

/* Binds the scene's skin, if its frames have one, to see whether that is possible, and prints the result. */
static int report_skin(const flesh_scene *scene)
{
  flesh_surface *surface = NULL;
  flesh_skin *skin = NULL;
  flesh_skin_info info;
  const int status = flesh_start_skin(scene, &surface, &skin);
  if (skin) {
    flesh_skin_inspect(skin, &info);
    flesh_skin_print(stdout, flesh_scene_outputs(scene)->skin.surface, &info);
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
  if (!status && !fixed) status = flesh_no_memory();
  if (!status) {
    printf("effects:");
    for (int e = 0; e < flesh_system_effect_count(system); e++)
      printf("%s %s", e ? "," : "", flesh_system_effect(system, e)->operations->name);
    int held = flesh_system_fixed(system, t, fixed), blocks = K->row_start[K->rows];
    printf("\nunknowns: %d, of which %d are held at the start; Jacobian of %d blocks 3x3 (upper triangle)\n",
           unknowns, held, blocks);
    flesh_time_print(stdout, scene);
    if (flesh_scene_warning(scene)) printf("warning: %s\n", flesh_scene_warning(scene));
  }
  free(fixed);
  flesh_block_matrix_destroy(&K);
  return status;
}

/* Moves the nodes at random, by little compared with the mesh's edges; halves the moves until the least J of all tets is
 * above half of what it was (if that was positive), and no node is in an obstacle. */
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
  if (!x) return flesh_no_memory();
  int status = FLESH_OK;
  disturb(system, seed, state, x);
  printf("derivatives (relative errors):\n  %-12s  %10s  %10s  %10s  %10s  %10s  %10s  %10s\n", "",
         "r static", "r dynamic", "K static", "K dynamic", "evaluate", "asymmetry", "negative");
  *failed = 0;
  for (int e = 0; e < flesh_system_effect_count(system); e++) {
    const flesh_effect *effect = flesh_system_effect(system, e);
    flesh_derivative_report report;
    int zero = 0;
    status = flesh_effect_check_derivatives_or_zero(effect, mesh, state->t, x, seed, &report, &zero);
    if (status < 0) break;
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
  return status < 0 ? status : FLESH_OK;
}

static int check(const flesh_scene *scene, int *failed)
{
  report_mesh(scene);
  flesh_materials_print(stdout, scene);
  int status = report_skin(scene);
  if (!status) status = report_system(scene, scene->start.t);
  if (!status) status = flesh_start_try(scene);
  return status ? status : differentiate(scene, &scene->start, failed);
}

int flesh_command_check(int argc, char **argv)
{
  const char *start_state = NULL;
  flesh_overrides overrides = {0};
  const flesh_option rows[] = {
      {"set", "KEY=VALUE", FLESH_OPTION_LIST, &overrides.texts, "a value of the scene"},
      {"start-state", "FILE", FLESH_OPTION_TEXT, &start_state, "check at the state of this file"},
      {0}};
  const flesh_usage usage = {
      "check", "SCENE", "Validates a scene and differentiates its effects.", flesh_own_text("check_help"), 1, 1, rows, NULL, 0};
  int positionals, failed = 0, code = flesh_options_read(&usage, argc, argv, &positionals);
  flesh_scene *scene = NULL;
  if (code == FLESH_OPTIONS_GO_ON) {
    if (start_state) flesh_overrides_add_text(&overrides, "start.state", start_state);
    int status = flesh_overrides_read(&overrides, argv[1], &scene);
    if (!status) status = check(scene, &failed);
    code = status ? flesh_command_fail("check", status) : failed ? 2 : 0;
    if (!status) printf(failed ? "%d of the effects FAILED\n" : "all fine\n", failed);
  }
  flesh_scene_destroy(&scene);
  flesh_overrides_close(&overrides);
  return code;
}
