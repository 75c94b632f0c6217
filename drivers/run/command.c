/* command.c: `flesh run SCENE`: simulates a scene. */
#include "commands.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/archive.h"
#include "base/confine.h"
#include "base/clock.h"
#include "base/error.h"
#include "base/text.h"
#include "effect/effect.h"
#include "error/error.h"
#include "mesh/mesh.h"
#include "run/describe.h"
#include "cli/interrupt.h"
#include "cli/json_memory.h"
#include "cli/path.h"
#include "run/provenance.h"
#include "cli/overrides.h"
#include "pool/pool.h"
#include "run/runner.h"
#include "run/running.h"
#include "scene/scene.h"
#include "study/csv.h"
#include "study/embedded.h"

/* Returns out/<scene's name without folder and suffix> as new text. */
static char *default_folder(const char *scene)
{
  const char *slash = strrchr(scene, '/'), *base = slash ? slash + 1 : scene;
  const char *dot = strrchr(base, '.');
  return flesh_text_new("out/%.*s", dot && dot != base ? (int)(dot - base) : (int)strlen(base), base);
}

static void report(const flesh_figures *figures, const flesh_outcome *outcome, const char *out)
{
  char text[FLESH_TABLE_TEXT];
  printf("%s", flesh_outcome_word(outcome));
  if (figures->final_inverted)
    printf(", with %d inverted tet%s at the end", figures->final_inverted, figures->final_inverted == 1 ? "" : "s");
  printf(": %d step%s to t = %g s in %.3g s", figures->steps, figures->steps == 1 ? "" : "s", figures->t,
         figures->wall_s);
  if (figures->steps)
    printf(", %.3g Newton per step, %.3g linear per Newton",
           (double)(figures->newton - figures->unfinished_newton) / figures->steps,
           figures->newton ? (double)figures->linear / (double)figures->newton : 0);
  if (figures->unfinished_newton + figures->unfinished_linear > 0)
    printf(", %ld Newton and %ld linear iterations in the step that was not finished", figures->unfinished_newton,
           figures->unfinished_linear);
  if (figures->internal_steps && figures->internal_steps != figures->steps)
    printf("; %ld internal steps, %ld rejected", figures->internal_steps,
           figures->rejected + figures->convergence_failures);
  printf("\nvolume drift: %.3g at most, %s at the end; smallest J %.4g; ", figures->max_volume_drift,
         flesh_table_text(text, "%.3g", figures->final_volume_drift), figures->J_min);
  if (figures->max_inverted)
    printf("up to %d inverted tets, from t = %g s\n", figures->max_inverted,
           figures->first_inverted_t);
  else printf("no inverted tet%s\n",
              figures->J_bound > 0 ? "" : " (the lower bound of J near corners is <= 0: J_bound in history.csv)");
  if (figures->multiplier_updates)
    printf("%ld updates of the pressures of incompressible tets, %.3g per step\n", figures->multiplier_updates,
           (double)figures->multiplier_updates / (figures->steps ? figures->steps : 1));
  if (figures->impact_steps)
    printf("%ld of %ld internal steps would have ended inside an obstacle; backward Euler took them, which damps\n",
           figures->impact_steps, figures->internal_steps);
  if (figures->damped_steps)
    printf("%ld of %ld internal steps led out of a tangle, gained energy or swung; "
           "backward Euler or runge-kutta, which damp, took them\n",
           figures->damped_steps, figures->internal_steps);
  if (figures->at_rounding)
    printf("%ld of %ld solves ended at rounding, above solver.newton_tolerance\n",
           figures->at_rounding, figures->solves);
  const flesh_separation *separation = &figures->separation;
  if (separation->begun && !separation->ignored)
    printf("the initial overlaps (%d place%s) were resolved at t = %.6g s; contact acts there since then\n",
           separation->begun, separation->begun == 1 ? "" : "s", separation->t_apart);
  if (figures->unconverged)
    printf("%ld of %ld solves were accepted without convergence\n", figures->unconverged,
           figures->solves);
  if (figures->untanglings)
    printf("untangled %ld times near equilibrium, %ld nodes in all (solver.techniques: untangle)\n",
           figures->untanglings, figures->untangled_nodes);
  printf("results: %s\n", out);
}

/* Names of the methods, with bars between them. */
#define METHOD_NAME(NAME, name, text, order, doc) "|" text
static const char *const methods = &(FLESH_METHOD_LIST(METHOD_NAME) "|adaptive")[1];
#undef METHOD_NAME

static void describe_springs(const flesh_system *system)
{
  for (int k = 0; k < flesh_system_effect_count(system); k++) {
    double p[3], radius = flesh_effect_spring_radius(flesh_system_effect(system, k), p);
    if (isnan(radius)) continue;
    if (radius > 0) printf("spring: pulls within %.4g m of (%.4g, %.4g, %.4g)\n", radius, p[0], p[1], p[2]);
    else printf("spring: pulls at (%.4g, %.4g, %.4g) alone\n", p[0], p[1], p[2]);
  }
}

/* Prints the scene's mesh, contacts, materials, steps and springs. */
static void describe(const flesh_scene *scene, const flesh_ranks *ranks)
{
  flesh_mesh_info info;
  if (flesh_scene_mesh(scene)->split) info = ranks->whole;
  else flesh_mesh_inspect(flesh_scene_mesh(scene), &info);
  printf("mesh: %s, %d nodes, %d tet%s, %.6g m^3\n", flesh_scene_mesh_path(scene), info.nodes,
         info.tets, info.tets == 1 ? "" : "s", info.volume);
  if (info.flipped)
    printf("  %d tet%s wound inversely and ha%s been flipped\n", info.flipped,
           info.flipped == 1 ? " was" : "s were", info.flipped == 1 ? "s" : "ve");
  if (info.unused_nodes)
    printf("  %d node%s used by no tet and held at rest\n", info.unused_nodes,
           info.unused_nodes == 1 ? " is" : "s are");
  flesh_describe_touching(scene, stdout);
  flesh_materials_print(stdout, scene);
  flesh_time_print(stdout, scene);
  describe_springs(flesh_scene_system(scene));
  flesh_warn_of_locking(scene, stdout);
  const char *preconditioner = flesh_ranks_preconditioner(ranks, scene);
  if (preconditioner) printf("preconditioner: %s\n", preconditioner);
  if (ranks) printf("ranks: %d\n", ranks->count);
  fflush(stdout);
}

/* The options of the command line. */
typedef struct given {
  flesh_ranks *ranks; /* NULL: one process */
  flesh_runner_options options;
  flesh_overrides overrides;
  const char *start_state, *method, *checkpoint, *resume, *to;
  int error; /* error bars are made whatever the scene says */
} given;

static int refuse_bars(const given *g, const flesh_scene *scene)
{
  return g->ranks && (g->error || scene->keys.output.error_bars)
             ? flesh_fail(FLESH_ERR_ARGUMENT, "error bars are not made on ranks; leave --error and output.error_bars out, or "
                                              "run one process")
             : FLESH_OK;
}

/* Reads the scene, with the overrides of the command line. */
static int read_given(given *g, const char *path, flesh_scene **scene)
{
  flesh_overrides *overrides = &g->overrides;
  const flesh_ranks *ranks = g->ranks;
  if (g->start_state) flesh_overrides_add_text(overrides, "start.state", g->start_state);
  if (g->method) flesh_overrides_add_text(overrides, "time.method", g->method);
  if (g->error) flesh_overrides_add(overrides, "output.error_bars", "true");
  const int status = overrides->failed
                         ? flesh_no_memory()
                         : flesh_scene_read_on_rank(path, overrides->texts.count, overrides->texts.values,
                                                    ranks ? ranks->rank : 0, ranks ? ranks->count : 0, scene);
  return status ? status : refuse_bars(g, *scene);
}

/* Refuses an option that stands for a key of the scene if --set gives that key, too; neither wins. */
static int refuse_twice(const given *g, const char *option, const char *value, const char *key)
{
  const size_t length = strlen(key);
  for (int k = 0; value && k < g->overrides.texts.count; k++) {
    const char *text = g->overrides.texts.values[k];
    if (!strncmp(text, key, length) && text[length] == '=')
      return flesh_command_refuse("run", "--%s %s and --set %s both give %s; leave one out", option, value, text, key);
  }
  return FLESH_OPTIONS_GO_ON;
}

/* Checks that the options and arguments fit together. Returns FLESH_OPTIONS_GO_ON or the exit code. */
static int check(void *data, int positionals)
{
  given *g = data;
  const char *folder = g->resume;
  if (g->to && !flesh_adapt_is_spec(g->to))
    return flesh_option_refuse("run", "to", g->to, "TOLERANCE:COLUMN, as 1%:tip.position_z or 0.01:tip.position_z");
  if (g->to && (folder || g->error || g->checkpoint || g->ranks))
    return flesh_command_refuse("run", "--to makes several runs: give no --resume, --error or --checkpoint, and one process");
  if (g->checkpoint && flesh_checkpoint_times_read(g->checkpoint, &g->options.checkpoint))
    return flesh_option_refuse("run", "checkpoint", g->checkpoint, "a number of seconds or steps, as 60s or 100steps");
  if (!folder && !positionals) return flesh_command_refuse("run", "SCENE is missing; give one, or --resume DIR");
  if (!folder) {
    const int code = refuse_twice(g, "method", g->method, "time.method");
    return code == FLESH_OPTIONS_GO_ON ? refuse_twice(g, "start-state", g->start_state, "start.state") : code;
  }
  if (positionals || g->start_state || g->method || g->overrides.texts.count)
    return flesh_command_refuse("run", "--resume takes the scene from %s: give no SCENE, --set, --method or --start-state",
                                folder);
  if (g->options.out || g->options.no_frames)
    return flesh_command_refuse("run", "--resume goes on in %s as the run began: give no --out or --no-frames", folder);
  return FLESH_OPTIONS_GO_ON;
}

/* Returns whether the folder's run is complete, and if so prints it. A run that still has its checkpoint may have been
 * stopped before all its files were on the disk; its last steps are repeated. */
static int is_complete(const char *folder)
{
  if (flesh_path_is_there(flesh_path("%s/" FLESH_CHECKPOINT_NAME, folder))) return 0;
  json_t *result;
  flesh_json_read(flesh_path("%s/result.json", folder), &result);
  const char *status = json_string_value(json_object_get(result, "status"));
  const int complete = status && !strcmp(status, "complete");
  const json_t *figures = json_object_get(result, "figures");
  const int steps = (int)json_integer_value(json_object_get(figures, "steps"));
  if (complete)
    printf("%s: this run is complete, %d step%s to t = %g s; there is nothing to go on with\n", folder, steps,
           steps == 1 ? "" : "s", json_number_value(json_object_get(figures, "t_end")));
  json_decref(result);
  return complete;
}

/* Opens the folder's checkpoint and its scene on every rank; *path, the scene's, is new text. Returns
 * FLESH_OPTIONS_GO_ON or the exit code. */
static int open_resumed(given *g, flesh_checkpoint *checkpoint, char **path, flesh_scene **scene)
{
  flesh_runner_options *options = &g->options;
  *path = flesh_text_new("%s/scene.yaml", g->resume);
  int status = *path ? flesh_confine(g->resume) : flesh_no_memory();
  status = flesh_ranks_agree(g->ranks, status);
  if (status) return flesh_ranks_fail(g->ranks, "run", status);
  if (flesh_ranks_largest(g->ranks, flesh_ranks_first(g->ranks) && is_complete(g->resume))) {
    options->out = g->resume;
    status = g->ranks ? FLESH_OK : flesh_error_catch_up(options, g->error);
    return status ? flesh_ranks_fail(g->ranks, "run", status) : 0;
  }
  status = flesh_checkpoint_open(g->resume, checkpoint);
  const int rank = g->ranks ? g->ranks->rank : 0, count = g->ranks ? g->ranks->count : 0;
  if (!status) status = flesh_scene_read_on_rank(*path, 0, NULL, rank, count, scene);
  if (!status) status = refuse_bars(g, *scene);
  status = flesh_ranks_agree(g->ranks, status);
  if (!status)
    status = flesh_ranks_same(g->ranks, flesh_archive_sum(0, checkpoint->main, checkpoint->size), "another checkpoint");
  if (!status && g->ranks) status = flesh_ranks_share(g->ranks, *scene);
  if (status) return flesh_ranks_fail(g->ranks, "run", status);
  options->out = g->resume;
  options->scene_path = *path;
  options->resume = checkpoint;
  options->no_frames = checkpoint->head.no_frames;
  if (!g->checkpoint) options->checkpoint = checkpoint->head.times;
  if (!(options->max_seconds > 0)) options->max_seconds = checkpoint->head.max_seconds;
  return FLESH_OPTIONS_GO_ON;
}

/* Runs the scene and prints its outcome; adds error bars if they are `wanted` or the scene asks for them. */
static int run_scene(const flesh_scene *scene, const flesh_runner_options *options, int wanted)
{
  flesh_figures figures = {0};
  flesh_outcome outcome = {0};
  if (options->ranks && !options->ranks->working) return flesh_pool_stand_by();
  if (!options->quiet) describe(scene, options->ranks);
  flesh_runner_run(scene, options, &figures, &outcome);
  const int first = flesh_ranks_first(options->ranks);
  if (outcome.status && first) fprintf(stderr, "flesh run: %s\n", outcome.message);
  if (outcome.has_failure && first) flesh_failure_print(stderr, &outcome, scene);
  if (!options->quiet && isfinite(figures.wall_s + figures.t)) report(&figures, &outcome, options->out);
  flesh_figures_close(&figures);
  const int code = flesh_ranks_broadcast(options->ranks, outcome.exit_code);
  flesh_pool_dismiss(options->ranks, code);
  const int bars = wanted || scene->keys.output.error_bars, status = code || !bars ? FLESH_OK : flesh_error_bars(options);
  return status ? flesh_command_fail("run", status) : code;
}

/* Runs the scene on meshes that are refined until a tolerance is met. */
static int run_to(const given *g)
{
  const int status = flesh_adapt_run(&g->options, &g->overrides.texts, g->to);
  return status ? flesh_command_fail("run", status) : 0;
}

/* Fails unless all ranks have the same build and the same options beside the scene. */
static int agree_on_options(const given *g)
{
  const flesh_runner_options *options = &g->options;
  char identity[FLESH_IDENTITY_SIZE];
  flesh_provenance_identity(identity);
  const char *const texts[] = {identity, g->resume, g->checkpoint, options->out, options->save_state};
  uint64_t sum = 0;
  for (size_t k = 0; k < sizeof texts / sizeof *texts; k++)
    sum = texts[k] ? flesh_archive_sum(sum, texts[k], strlen(texts[k]) + 1) : sum + 1;
  sum = flesh_archive_sum(sum, &options->no_frames, sizeof options->no_frames);
  sum = flesh_archive_sum(sum, &options->max_seconds, sizeof options->max_seconds);
  return flesh_ranks_same(g->ranks, sum, "other options, or is another build,");
}

static int read_and_run(given *g, int argc, char **argv)
{
  flesh_runner_options *options = &g->options;
  const flesh_option rows[] = {
      {"out", "DIR", FLESH_OPTION_TEXT, &options->out, "folder of the results (default out/<scene>)"},
      {"set", "KEY=VALUE", FLESH_OPTION_LIST, &g->overrides.texts,
       "a value of the scene, as in --set time.step=1/120"},
      {"method", methods, FLESH_OPTION_TEXT, &g->method, "how to step in time (--set time.method=NAME)"},
      {"start-state", "FILE", FLESH_OPTION_TEXT, &g->start_state,
       "start from rows `x y z vx vy vz` (--set start.state=FILE)"},
      {"save-state", "FILE", FLESH_OPTION_TEXT, &options->save_state, "write the last state here as well"},
      {"checkpoint", "EVERY", FLESH_OPTION_TEXT, &g->checkpoint,
       "write checkpoint.bin, for --resume, every 60s or 100steps, and when the run is asked to stop"},
      {"resume", "DIR", FLESH_OPTION_TEXT, &g->resume,
       "go on with the run in DIR from its last checkpoint, with the scene and options that it began with (instead of "
       "SCENE); on the same number of ranks, bitwise identical"},
      {"max-seconds", "S", FLESH_OPTION_POSITIVE, &options->max_seconds,
       "stop in order after S seconds, reading the scene and the time before --resume included; the step under way is given "
       "up, or with --checkpoint has up to 10 s to end"},
      {"no-frames", NULL, FLESH_OPTION_SWITCH, &options->no_frames, "write no VTU frames"},
      {"error", NULL, FLESH_OPTION_SWITCH, &g->error,
       "add error bars of mesh and step, by further runs (--set output.error_bars=true); with --resume also to a run that "
       "is complete"},
      {"to", "TOLERANCE:COLUMN", FLESH_OPTION_TEXT, &g->to,
       "refine the mesh of an equilibrium, as ten-node tets, until a column of the probes has an error bar within "
       "TOLERANCE, as in 1%:tip.position_z"},
      {"profile", NULL, FLESH_OPTION_SWITCH, &options->profile, "print each effect's CPU time, beside its calls and memory"},
      {"quiet", NULL, FLESH_OPTION_SWITCH, &options->quiet, "print errors only"},
      {0}};
  const flesh_usage usage = {
      "run", "[SCENE]", "Simulates a scene (see `flesh schema` for its keys).", flesh_own_text("run_help"), 0, 1, rows, NULL,
      FLESH_EXITS_ALL};
  int count, code = flesh_ranks_read_options(g->ranks, &usage, argc, argv, &count, check, g);
  flesh_checkpoint checkpoint = {0};
  flesh_scene *scene = NULL;
  char *made = NULL; /* path of a file or of a folder */
  if (code != FLESH_OPTIONS_GO_ON) return code;
  const int agreed = agree_on_options(g);
  if (agreed) return flesh_ranks_fail(g->ranks, "run", agreed);
  flesh_interrupt_watch();
  options->begun = flesh_wall_seconds();
  double deadline = options->begun + options->max_seconds;
  if (options->max_seconds > 0) flesh_scene_set_stop(flesh_interrupt_asked, &deadline);
  if (g->resume) {
    code = open_resumed(g, &checkpoint, &made, &scene);
  } else {
    options->scene_path = argv[1];
    int status = read_given(g, argv[1], &scene);
    status = flesh_ranks_agree(g->ranks, status);
    if (!status && g->ranks) status = flesh_ranks_share(g->ranks, scene);
    if (status) code = flesh_ranks_fail(g->ranks, "run", status);
    else if (!options->out) options->out = made = default_folder(argv[1]);
  }
  flesh_scene_set_stop(flesh_interrupt_asked, NULL); /* the deadline is a local variable */
  if (code == FLESH_OPTIONS_GO_ON) code = g->to ? run_to(g) : run_scene(scene, options, g->error);
  flesh_checkpoint_close(&checkpoint);
  flesh_scene_destroy(&scene);
  free(made);
  return code;
}

int flesh_command_run(int argc, char **argv)
{
  given g = {0};
  int status = flesh_ranks_open(&g.ranks), code;
  if (status) return flesh_command_fail("run", status);
  char **words = malloc(sizeof *words * (size_t)(argc + 1)); /* reading the options permutes argv */
  if (!words) status = flesh_no_memory();
  for (int a = 0; a < argc && words; a++) words[a] = argv[a];
  g.options.argc = argc;
  g.options.argv = words;
  g.options.ranks = g.ranks;
  g.options.quiet = !flesh_ranks_first(g.ranks);
  status = flesh_ranks_agree(g.ranks, status);
  code = status ? flesh_ranks_fail(g.ranks, "run", status) : read_and_run(&g, argc, argv);
  flesh_ranks_close(&g.ranks);
  flesh_overrides_close(&g.overrides);
  free(words);
  return code;
}
