/* command.c: `flesh mesh info|convert|surface|box|split`. */
#include "commands.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/confine.h"
#include "base/error.h"
#include "base/sort.h"
#include "cli/path.h"
#include "flesh/mesh.h"
#include "flesh/surface.h"
#include "math/mat3.h"
#include "mesh/inspect.h"
#include "mesh/mesh.h"
#include "mesh/refine.h"
#include "cli/lists.h"
#include "cli/options.h"
#include "cli/output.h"
#include "mesh/split.h"
#include "parallel/partition.h"
#include "study/embedded.h"

static const flesh_option no_options[] = {{.name = NULL}};

static void show_range(const char *name, double low, double high)
{
  printf("  %-14s %-14.8g to %.8g\n", name, low, high);
}

static void show_regions(const flesh_mesh *mesh)
{
  enum { SHOWN = 20 };
  int *tags, count = flesh_mesh_region_list(mesh, &tags);
  const int *regions = flesh_mesh_regions(mesh);
  const double *volumes = flesh_mesh_tet_volumes(mesh);
  for (int r = 0; r < count && r < SHOWN; r++) {
    int tets = 0;
    double volume = 0;
    for (int t = 0; t < flesh_mesh_tet_count(mesh); t++)
      if (regions[t] == tags[r]) tets++, volume += volumes[t];
    printf("    region %-5d  %d tet%s, %.8g m^3\n", tags[r], tets, tets == 1 ? "" : "s", volume);
  }
  if (count > SHOWN) printf("    ... and %d more\n", count - SHOWN);
  free(tags);
}

/* Shows the tag of the region whose tets a set consists of, if there is one. */
static void show_region_of(const flesh_mesh *mesh, const flesh_named_set *set)
{
  const int *regions = flesh_mesh_regions(mesh);
  int all = 0, own = 0;
  for (int t = 0; set->tet_count && t < flesh_mesh_tet_count(mesh); t++) all += regions[t] == regions[set->tets[0]];
  for (int k = 0; k < set->tet_count; k++) own += regions[set->tets[k]] == regions[set->tets[0]];
  if (all && own == all && own == set->tet_count) printf(", region %d", regions[set->tets[0]]);
}

static void show_sets(const flesh_mesh *mesh)
{
  const int count = flesh_mesh_set_count(mesh);
  if (count) printf("  %-14s %d\n", "sets", count);
  for (int k = 0; k < count; k++) {
    const flesh_named_set set = flesh_mesh_set_at(mesh, k);
    printf("    '%s'  %d nodes, %d tets", set.name, set.node_count, set.tet_count);
    show_region_of(mesh, &set);
    putchar('\n');
  }
}

static void show_histogram(const flesh_mesh *mesh)
{
  static const double bounds[] = {0,   0.001, 0.01, 0.05, 0.1, 0.2, 0.3,
                                  0.4, 0.5,   0.6,  0.7,  0.8, 0.9, 1};
  static const char bar[] = "########################################";
  enum { BINS = sizeof bounds / sizeof *bounds - 1, WIDTH = sizeof bar - 1 };
  int count[BINS] = {0}, most = 1, tets = flesh_mesh_tet_count(mesh);
  for (int t = 0; t < tets; t++) {
    double ratio = flesh_mesh_radius_ratio(mesh, t);
    int bin = 0;
    while (bin < BINS - 1 && ratio >= bounds[bin + 1]) bin++;
    if (++count[bin] > most) most = count[bin];
  }
  for (int b = 0; b < BINS; b++) {
    /* The bad tets' bins are shown only when they hold some. */
    if (!count[b] && bounds[b] < 0.1) continue;
    printf("    %5g to %-5g %9d %5.1f %%", bounds[b], bounds[b + 1], count[b],
           100.0 * count[b] / tets);
    printf(count[b] ? "  %.*s\n" : "\n", (int)ceil((double)count[b] * WIDTH / most), bar);
  }
}

/* A node and its coordinate along a slanted direction, on which the nodes of grids do not coincide. */
typedef struct node_along {
  double along;
  int node;
} node_along;

/* Shows how many vertices are at the same place as another, where a mesh that looks whole is torn: closer than a
 * thousandth of the shortest edge, since files round positions. Nodes on the edges of a flat tet may coincide without a
 * tear. FLESH_ERR_MEMORY. */
static int show_coincident(const flesh_mesh *mesh, const flesh_mesh_info *info)
{
  static const double slant[3] = {0.6357, 0.5773, 0.5124};
  const double *x = flesh_mesh_positions(mesh), near = 1e-3 * info->edge_min;
  node_along *nodes = calloc((size_t)info->nodes, sizeof *nodes);
  int used = 0, found = 0, first[2] = {0, 0};
  if (!nodes) return flesh_no_memory();
  for (int k = 0; k < 4 * info->tets; k++) nodes[flesh_mesh_tets(mesh)[k]].node = 1; /* marks used nodes */
  for (int n = 0; n < info->nodes; n++)
    if (nodes[n].node) nodes[used++] = (node_along){flesh_vec3_dot(x + 3 * (size_t)n, slant), n};
  flesh_sort(nodes, (size_t)used, sizeof *nodes, flesh_compare_double);
  for (int i = 0; i < used; i++)
    for (int j = i + 1; j < used && nodes[j].along - nodes[i].along <= near; j++) {
      const double *a = x + 3 * (size_t)nodes[i].node, *b = x + 3 * (size_t)nodes[j].node;
      if (!(hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]) <= near)) continue;
      if (!found++) first[0] = nodes[i].node, first[1] = nodes[j].node;
      break;
    }
  free(nodes);
  if (found)
    printf("  %-14s %d node%s where another is, for example %d and %d: the mesh is torn there. Join the parts before meshing\n"
           "  %-14s (in Gmsh by BooleanFragments or Coherence), or hold them together by the effect weld\n",
           "coincident", found, found == 1 ? "" : "s", first[0], first[1], "");
  return FLESH_OK;
}

static int show(const flesh_mesh *mesh, const char *path)
{
  flesh_mesh_info info;
  flesh_mesh_inspect(mesh, &info);
  const double *x = flesh_mesh_positions(mesh);
  printf("%s\n", path);
  printf("  %-14s %d", "nodes", info.nodes);
  if (info.unused_nodes) {
    int first = 0;
    while (flesh_mesh_node_used(mesh)[first]) first++;
    printf(" (%d used by no tet, the first is %d)", info.unused_nodes, first);
  }
  putchar('\n');
  const int status = show_coincident(mesh, &info);
  if (status) return status;
  printf("  %-14s %d", "tets", info.tets);
  if (info.order == 2) printf(" of ten nodes, %d of them curved", info.curved);
  if (info.flipped) printf(" (%d inverted in the file, flipped)", info.flipped);
  printf("\n  %-14s %d triangles\n", "surface", info.triangles);
  printf("  %-14s %d\n", "regions", info.regions);
  show_regions(mesh);
  show_sets(mesh);
  printf("  %-14s %.8g m^3\n", "volume", info.volume);
  for (int d = 0; d < 3; d++) {
    char name[] = {(char)('x' + d), ' ', '[', 'm', ']', 0};
    show_range(name, info.low[d], info.high[d]);
  }
  show_range("edge [m]", info.edge_min, info.edge_max);
  printf("  %-14s %.8g\n", "edge mean [m]", info.edge_mean);
  printf("  %-14s %.4g at least, %.4g on average\n", "radius ratio", info.radius_ratio_min,
         info.radius_ratio_mean);
  show_histogram(mesh);
  if (info.curved)
    printf("  %-14s %.4g at least, in tet %d\n", "scaled J", info.scaled_jacobian_min, info.most_bent_tet);
  const int *worst = flesh_mesh_tets(mesh) + 4 * (size_t)info.worst_tet;
  double centre[3];
  flesh_mesh_centre(mesh, x, info.worst_tet, centre);
  printf("  %-14s %d, nodes %d %d %d %d, centre (%.6g, %.6g, %.6g)\n", "worst tet", info.worst_tet,
         worst[0], worst[1], worst[2], worst[3], centre[0], centre[1], centre[2]);
  return FLESH_OK;
}

static int command_info(int argc, char **argv)
{
  const flesh_usage usage = {"mesh info", "FILE...", "Shows counts, sizes and quality of tetrahedral meshes.",
                             flesh_own_text("mesh_info_help"), 1, INT_MAX, no_options, NULL, 0};
  int files, code = flesh_options_read(&usage, argc, argv, &files);
  if (code != FLESH_OPTIONS_GO_ON) return code;
  for (int f = 1; f <= files; f++) {
    flesh_mesh *mesh;
    int status = flesh_mesh_read(argv[f], &mesh);
    if (status) return flesh_command_fail(usage.command, status);
    if (f > 1) putchar('\n');
    status = show(mesh, argv[f]);
    flesh_mesh_destroy(&mesh);
    if (status) return flesh_command_fail(usage.command, status);
  }
  return 0;
}

static int write_and_say(const char *command, const flesh_mesh *mesh, const char *path)
{
  flesh_mesh_info info;
  int status = flesh_mesh_write(mesh, path);
  if (status) return flesh_command_fail(command, status);
  flesh_mesh_inspect(mesh, &info);
  printf("%s: %d nodes, %d tet%s%s, %d region%s", path, info.nodes, info.tets,
         info.tets == 1 ? "" : "s", info.order == 2 ? " of ten nodes" : "", info.regions, info.regions == 1 ? "" : "s");
  if (info.flipped)
    printf("; %d inverted tet%s flipped", info.flipped, info.flipped == 1 ? "" : "s");
  if (info.unused_nodes)
    printf("; %d node%s used by no tet", info.unused_nodes, info.unused_nodes == 1 ? "" : "s");
  const int sets = flesh_mesh_set_count(mesh);
  if (sets && flesh_mesh_file_has_sets(path)) printf(", %d named set%s", sets, sets == 1 ? "" : "s");
  else if (sets) printf("; without the %d named set%s, which only .msh holds", sets, sets == 1 ? "" : "s");
  putchar('\n');
  return 0;
}

/* Raises or lowers *mesh to `order` (0: keeps its own). */
static int set_order(flesh_mesh **mesh, int order)
{
  flesh_mesh *other;
  if (!order || order == flesh_mesh_order(*mesh)) return FLESH_OK;
  int status = order == 2 ? flesh_mesh_raise_order(*mesh, &other) : flesh_mesh_lower_order(*mesh, &other);
  if (status) return status;
  flesh_mesh_destroy(mesh);
  *mesh = other;
  return FLESH_OK;
}

/* Cuts each tet into eight, `times` times; before that, checks the size of the result in the order that it will
 * have. */
static int refine(flesh_mesh **mesh, int times, int order)
{
  const int own = flesh_mesh_order(*mesh);
  int status = flesh_mesh_check_refine(*mesh, order > own ? order : own, times);
  if (status) return flesh_fail_within(status, "--refine %d: ", times);
  for (int k = 0; k < times; k++) {
    flesh_mesh *finer;
    status = flesh_mesh_refine(*mesh, &finer);
    if (status) return status;
    flesh_mesh_destroy(mesh);
    *mesh = finer;
  }
  return FLESH_OK;
}

static int command_convert(int argc, char **argv)
{
  int order = -1, times = 0; /* order: index of the choice */
  const flesh_option options[] = {
      {"order", "1|2", FLESH_OPTION_CHOICE, &order, "1: tets of four nodes; 2: of ten (default: as in IN)"},
      {"refine", "N", FLESH_OPTION_COUNT, &times, "times that each tet is cut into eight (default 0)"},
      {.name = NULL}};
  const flesh_usage usage = {"mesh convert", "IN OUT", "Writes a mesh in another format.",
                             flesh_own_text("mesh_convert_help"), 2, 2, options, NULL, 0};
  int files, code = flesh_options_read(&usage, argc, argv, &files);
  if (code != FLESH_OPTIONS_GO_ON) return code;
  flesh_mesh *mesh = NULL;
  int status = flesh_output_prepare_from(argv[2], 1, argv + 1, NULL);
  if (!status) status = flesh_mesh_read(argv[1], &mesh);
  if (!status) status = refine(&mesh, times, order + 1);
  if (!status) status = set_order(&mesh, order + 1);
  code = status ? flesh_command_fail(usage.command, status) : write_and_say(usage.command, mesh, argv[2]);
  flesh_mesh_destroy(&mesh);
  return code;
}

static int command_surface(int argc, char **argv)
{
  const flesh_usage usage = {"mesh surface", "IN OUT", "Writes the boundary triangles of a mesh.",
                             flesh_own_text("mesh_surface_help"), 2, 2, no_options, NULL, 0};
  int files, code = flesh_options_read(&usage, argc, argv, &files);
  if (code != FLESH_OPTIONS_GO_ON) return code;
  flesh_mesh *mesh = NULL;
  flesh_surface *surface = NULL;
  int status = flesh_output_prepare_from(argv[2], 1, argv + 1, NULL);
  if (!status) status = flesh_mesh_read(argv[1], &mesh);
  if (!status) status = flesh_surface_of_mesh(mesh, &surface);
  if (!status) status = flesh_surface_write(surface, NULL, argv[2]);
  if (!status)
    printf("%s: %d vertices, %d triangles\n", argv[2], flesh_surface_vertex_count(surface),
           flesh_surface_face_count(surface));
  flesh_surface_destroy(&surface);
  flesh_mesh_destroy(&mesh);
  return status ? flesh_command_fail(usage.command, status) : 0;
}

/* Claims the folder and prepares its index, which must be none of the inputs. */
static int claim_parts(const char *command, const char *folder, int inputs, char *const *input, flesh_folder_claim *claim)
{
  const int status = flesh_output_claim(folder, command, claim);
  return status ? status : flesh_output_prepare_from(flesh_path("%s/index.txt", folder), inputs, input, NULL);
}

static void print_parts(const char *folder, const flesh_split *split)
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

/* Prints and closes the parts that were written, and releases their folder. Returns the exit code. */
static int finish_parts(const char *command, int status, const char *folder, flesh_split *split, flesh_folder_claim *claim)
{
  if (!status) print_parts(folder, split);
  flesh_split_close(split);
  flesh_folder_claim_release(claim);
  if (!status) return 0;
  flesh_path_remove_folder(folder); /* fails if there is anything in it */
  return flesh_command_fail(command, status);
}

/* Partitions the mesh by METIS and writes the parts into the folder. */
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

static int command_split(int argc, char **argv)
{
  int parts = 0, files;
  const char *out = NULL;
  const flesh_option options[] = {{"parts", "N", FLESH_OPTION_COUNT, &parts, "number of parts, one for each rank of a run"},
                                  {"out", "FOLDER", FLESH_OPTION_TEXT, &out, "folder for the index and the parts"},
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
  if (!status) status = claim_parts(usage.command, out, 1, argv + 1, &claimed);
  if (!status) status = split_mesh(mesh, parts, out);
  flesh_mesh_destroy(&mesh);
  if (!status) status = flesh_split_open(flesh_path("%s/index.txt", out), &split);
  return finish_parts(usage.command, status, out, &split, &claimed);
}

static int command_box(int argc, char **argv)
{
  const char *cells_text = NULL, *size_text = NULL, *origin_text = "0,0,0", *out = NULL;
  int order = 0, parts = 0; /* order: index of the choice */
  const flesh_option options[] = {
      {"cells", "NX,NY,NZ", FLESH_OPTION_TEXT, &cells_text, "number of boxes along each axis, at least 1 each"},
      {"size", "X,Y,Z", FLESH_OPTION_TEXT, &size_text, "size of the whole grid, m"},
      {"origin", "X,Y,Z", FLESH_OPTION_TEXT, &origin_text, "low corner of the grid, m (default 0,0,0)"},
      {"order", "1|2", FLESH_OPTION_CHOICE, &order, "1: tets of four nodes (default); 2: of ten"},
      {"parts", "N", FLESH_OPTION_COUNT, &parts,
       "write it split into N blocks, one at a time: the whole is never in memory (see flesh mesh split)"},
      {"out", "FILE", FLESH_OPTION_TEXT, &out, "mesh to write: .node, .ele, .msh or .mesh; with --parts a folder"},
      {.name = NULL}};
  const flesh_usage usage = {"mesh box", "--cells NX,NY,NZ --size X,Y,Z --out FILE",
                             "Makes a regular grid of boxes, six tets each.",
                             flesh_own_text("mesh_box_help"), 0, 0, options, NULL, 0};
  int none, code = flesh_options_read(&usage, argc, argv, &none);
  if (code != FLESH_OPTIONS_GO_ON) return code;
  double count[3], size[3], origin[3];
  int cells[3], whole = cells_text && flesh_list_parse(cells_text, 3, count) == 3;
  for (int d = 0; d < 3 && whole; d++) {
    whole = count[d] == floor(count[d]) && count[d] >= 1 && count[d] <= 1e9;
    if (whole) cells[d] = (int)count[d];
  }
  if (!whole)
    return flesh_option_refuse(usage.command, "cells", cells_text, "three whole numbers from 1, such as 16,4,4");
  if (!size_text || flesh_list_parse(size_text, 3, size) != 3)
    return flesh_option_refuse(usage.command, "size", size_text, "three positive numbers, such as 4,1,1");
  if (flesh_list_parse(origin_text, 3, origin) != 3)
    return flesh_option_refuse(usage.command, "origin", origin_text, "three numbers, such as 0,0,0");
  if (!out) return flesh_option_refuse(usage.command, "out", out, "a file named .node, .ele, .msh or .mesh, or a folder");
  if (parts && order)
    return flesh_command_refuse(usage.command, "--order is 2; with --parts it must be 1 (or split what mesh box writes)");
  flesh_mesh *mesh = NULL;
  int status;
  if (parts) {
    flesh_split split = {0};
    flesh_folder_claim claimed = {.descriptor = -1};
    status = claim_parts(usage.command, out, 0, NULL, &claimed);
    if (!status) status = flesh_split_box(cells, size, origin, parts, out, &split);
    return finish_parts(usage.command, status, out, &split, &claimed);
  }
  status = flesh_output_prepare_from(out, 0, NULL, NULL);
  if (!status) status = flesh_mesh_box(cells, size, origin, &mesh);
  if (!status) status = set_order(&mesh, order + 1);
  code = status ? flesh_command_fail(usage.command, status) : write_and_say(usage.command, mesh, out);
  flesh_mesh_destroy(&mesh);
  return code;
}

int flesh_command_mesh(int argc, char **argv)
{
  static const flesh_subcommand commands[] = {
      {"info", "show counts, sizes and quality of tetrahedral meshes", command_info},
      {"convert", "write a mesh in another format", command_convert},
      {"surface", "write the boundary triangles of a mesh", command_surface},
      {"box", "make a regular grid of boxes, six tets each", command_box},
      {"split", "write a mesh in parts, one for each rank of a run", command_split},
      {0}};
  return flesh_subcommand_run("mesh", flesh_own_text("mesh_help"), NULL, commands, argc, argv);
}
