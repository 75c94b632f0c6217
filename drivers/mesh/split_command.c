/* split_command.c: `flesh mesh split`, and boxes that are made in parts. */
#include "mesh/split_command.h"

#include <stdio.h>
#include <stdlib.h>

#include "base/confine.h"
#include "base/error.h"
#include "mesh/split.h"
#include "parallel/partition.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/path.h"
#include "study/embedded.h"

/* Claims the folder for the index, which must be none of the inputs. */
static int claim(const char *command, const char *folder, int inputs, char *const *input, flesh_folder_claim *claim)
{
  const int status = flesh_output_claim(folder, command, claim);
  return status ? status : flesh_output_prepare_from(flesh_path("%s/index.txt", folder), inputs, input, NULL);
}

/* A folder that was made for nothing goes. */
static void let_go(int status, const char *folder, flesh_folder_claim *claim)
{
  flesh_folder_claim_release(claim);
  if (status) flesh_path_remove_folder(folder); /* stays where something is in it */
}

static void say(const char *folder, const flesh_split *split)
{
  long long more = 0;
  int least = split->tets, most = 0;
  for (int k = 0; k < split->parts; k++) {
    const flesh_split_row *row = &split->rows[k];
    if (row->own < least) least = row->own;
    if (row->own > most) most = row->own;
    more += row->tets - row->own;
  }
  printf("%s/index.txt: %d nodes, %d tets%s, %d region%s, in %d part%s of %d to %d tets, with %.1f %% more from around\n",
         folder, split->nodes, split->tets, split->order == 2 ? " of ten nodes" : "", split->region_count,
         split->region_count == 1 ? "" : "s", split->parts, split->parts == 1 ? "" : "s", least, most,
         100. * (double)more / split->tets);
}

int flesh_split_command_box(const int cells[3], const double size[3], const double origin[3], int parts,
                            const char *folder)
{
  flesh_split split = {0};
  flesh_folder_claim claimed = {.descriptor = -1};
  int status = claim("mesh box", folder, 0, NULL, &claimed);
  if (!status) status = flesh_split_box(cells, size, origin, parts, folder, &split);
  if (!status) say(folder, &split);
  flesh_split_close(&split);
  let_go(status, folder, &claimed);
  return status ? flesh_command_fail("mesh box", status) : 0;
}

/* Parts the mesh by METIS, and writes the parts into the folder. */
static int split_mesh(const flesh_mesh *mesh, int parts, const char *folder)
{
  const int tets = flesh_mesh_tet_count(mesh);
  int *owners = malloc((size_t)tets * sizeof *owners);
  int status = owners ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "out of memory for the parts of %d tets", tets);
  if (!status) status = flesh_partition_tets(mesh, parts, owners);
  if (!status) status = flesh_split_mesh(mesh, parts, owners, folder);
  free(owners);
  return status;
}

int flesh_split_command(int argc, char **argv)
{
  int parts = 0, files;
  const char *out = NULL;
  const flesh_option options[] = {{"parts", "N", FLESH_OPTION_COUNT, &parts, "number of parts: ranks of the runs to come"},
                                  {"out", "FOLDER", FLESH_OPTION_TEXT, &out, "where the index and the parts go"},
                                  {.name = NULL}};
  const flesh_usage usage = {"mesh split", "MESH --parts N --out FOLDER", "Writes a mesh in parts, one for each rank of a run.",
                             flesh_own_text("mesh_split_help"), 1, 1, options, NULL, 0};
  int code = flesh_options_read(&usage, argc, argv, &files);
  if (code != FLESH_OPTIONS_GO_ON) return code;
  if (parts < 1) return flesh_option_refuse(usage.command, "parts", NULL, "a number of parts from 1");
  if (!out) return flesh_option_refuse(usage.command, "out", out, "a folder");
  flesh_mesh *mesh = NULL;
  flesh_split split = {0};
  flesh_folder_claim claimed = {.descriptor = -1};
  int status = flesh_mesh_read(argv[1], &mesh);
  if (!status) status = claim(usage.command, out, 1, argv + 1, &claimed);
  if (!status) status = split_mesh(mesh, parts, out);
  flesh_mesh_destroy(&mesh);
  if (!status) status = flesh_split_open(flesh_path("%s/index.txt", out), &split);
  if (!status) say(out, &split);
  flesh_split_close(&split);
  let_go(status, out, &claimed);
  return status ? flesh_command_fail(usage.command, status) : 0;
}
