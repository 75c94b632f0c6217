/* command.c: `flesh skin bind|apply`: binds a fine surface to a body, and moves it with the body. */
#include "commands.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/confine.h"
#include "base/error.h"
#include "cli/lists.h"
#include "cli/options.h"
#include "output/skin_frames.h"
#include "run/result.h"
#include "run/run_folder.h"
#include "run/start.h"
#include "cli/output.h"
#include "study/embedded.h"

static int command_bind(int argc, char **argv)
{
  const char *out = NULL;
  const flesh_option options[] = {
      {"out", "FILE", FLESH_OPTION_TEXT, &out, "binding to write (a text, see flesh/skin.h)"},
      {.name = NULL}};
  const flesh_usage usage = {"skin bind", "MESH SURFACE --out FILE", "Binds the vertices of a surface to the tets of a mesh.",
                             flesh_own_text("skin_bind_help"), 2, 2, options, NULL, 0};
  int files, code = flesh_options_read(&usage, argc, argv, &files);
  if (code != FLESH_OPTIONS_GO_ON) return code;
  if (!out) return flesh_option_refuse(usage.command, "out", NULL, "a file for the binding");
  flesh_mesh *mesh = NULL;
  flesh_surface *surface = NULL;
  flesh_skin *skin = NULL;
  int status = flesh_output_prepare_from(out, 2, argv + 1, NULL);
  if (!status) status = flesh_mesh_read(argv[1], &mesh);
  if (!status) status = flesh_surface_read(argv[2], &surface);
  if (!status) status = flesh_skin_bind(mesh, surface, &skin);
  if (!status) status = flesh_skin_write(skin, out);
  if (!status) {
    flesh_skin_info info;
    flesh_skin_inspect(skin, &info);
    flesh_skin_print(stdout, argv[2], &info);
    printf("binding: %s\n", out);
  }
  flesh_skin_destroy(&skin);
  flesh_surface_destroy(&surface);
  flesh_mesh_destroy(&mesh);
  return status ? flesh_command_fail(usage.command, status) : 0;
}

static int apply_to_run(flesh_run_folder *run, flesh_skin_frames *frames)
{
  int status = FLESH_OK;
  for (int k = 0; k < run->count && !status; k++) {
    status = flesh_run_folder_load(run, k);
    if (!status) status = flesh_skin_frames_add(frames, run->frames[k].number, &run->state);
  }
  return status;
}

/* Spares the surface if it is one of the folder's frames of the skin, which are replaced as a whole. */
static int spare_surface(const char *surface, const char *out)
{
  const char *slash = strrchr(surface, '/'), *name = slash ? slash + 1 : surface;
  const char *const names[] = {name, NULL};
  flesh_inputs inputs = {0};
  if (strncmp(name, "skin_", 5)) return FLESH_OK;
  flesh_inputs_add(&inputs, surface);
  return flesh_inputs_spare_in(&inputs, out, names, NULL);
}

static int command_apply(int argc, char **argv)
{
  const char *out = NULL, *formats_text = "obj", *mesh_path = NULL;
  const flesh_option options[] = {
      {"out", "DIR", FLESH_OPTION_TEXT, &out, "folder to write into: skin_000000.obj ..., skin.pc2, skin.pvd"},
      {"formats", "LIST", FLESH_OPTION_TEXT, &formats_text, "some of obj,pc2,vtu (default obj)"},
      {"mesh", "MESH", FLESH_OPTION_TEXT, &mesh_path, "mesh of RUN, if RUN is a state file"},
      {.name = NULL}};
  const flesh_usage usage = {"skin apply", "BINDING SURFACE RUN --out DIR", "Writes the surface as it moves with a run.",
                             flesh_own_text("skin_apply_help"), 3, 3, options, NULL, 0};
  int files, code = flesh_options_read(&usage, argc, argv, &files);
  if (code != FLESH_OPTIONS_GO_ON) return code;
  if (!out) return flesh_option_refuse(usage.command, "out", NULL, "a folder");
  static const char *const names[] = {"obj", "pc2", "vtu", NULL};
  int chosen[sizeof names / sizeof *names], count;
  unsigned formats = 0;
  if (flesh_list_words("formats", formats_text, names, chosen, &count))
    return flesh_command_fail(usage.command, FLESH_ERR_ARGUMENT);
  for (int k = 0; k < count; k++) formats |= 1u << chosen[k];
  struct stat info;
  flesh_run_folder run = {0};
  flesh_mesh *own = NULL;
  flesh_surface *surface = NULL;
  flesh_skin *skin = NULL;
  flesh_skin_frames *frames = NULL;
  flesh_state state = {0};
  int status =
      mesh_path ? flesh_mesh_read(mesh_path, &own) : flesh_run_folder_open(argv[3], &run);
  if (status && !mesh_path && !flesh_path_stat(argv[3], &info) && S_ISREG(info.st_mode))
    status = flesh_fail_within(status, "RUN is no folder of a run (with a state file, --mesh must name its mesh): ");
  const flesh_mesh *mesh = own ? own : run.scene ? flesh_scene_mesh(run.scene) : NULL;
  if (!status) status = flesh_surface_read(argv[2], &surface);
  if (!status) status = flesh_skin_read(argv[1], mesh, surface, &skin);
  if (!status && own) { /* before the folder's older frames are removed */
    status = flesh_state_make(flesh_mesh_node_count(own), 0, 0, &state);
    if (!status) status = flesh_state_read(argv[3], flesh_mesh_node_count(own), &state);
  }
  flesh_folder_claim claim = {.descriptor = -1};
  if (!status) status = spare_surface(argv[2], out);
  if (!status) status = flesh_output_claim(out, "skin apply", &claim);
  if (!status) status = flesh_skin_frames_create(out, skin, surface, formats, 1, &frames);
  if (!status) status = own ? flesh_skin_frames_add(frames, 0, &state) : apply_to_run(&run, frames);
  if (status) flesh_skin_frames_abandon(&frames);
  else status = flesh_skin_frames_close(&frames);
  flesh_folder_claim_release(&claim);
  if (!status)
    printf("%s: %d frame%s of %d vertices\n", out, own ? 1 : run.count,
           own || run.count == 1 ? "" : "s", flesh_surface_vertex_count(surface));
  flesh_skin_destroy(&skin);
  flesh_surface_destroy(&surface);
  flesh_mesh_destroy(&own);
  flesh_run_folder_close(&run);
  free(state.x);
  return status ? flesh_command_fail(usage.command, status) : 0;
}

int flesh_command_skin(int argc, char **argv)
{
  static const flesh_subcommand commands[] = {{"bind", "bind a surface's vertices to the tets of a mesh", command_bind},
                                              {"apply", "write the surface as it moves with a run", command_apply},
                                              {0}};
  return flesh_subcommand_run("skin", "A fine surface that follows the tets of a body.\n",
                              "A scene with\n`output: {skin: {surface: FILE}}` does both while it runs.", commands, argc,
                              argv);
}
