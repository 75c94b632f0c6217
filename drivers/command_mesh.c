/* command_mesh.c: `flesh mesh info|convert|box`. */
#include "command_mesh.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "flesh/mesh.h"
#include "mesh/inspect.h"

enum { EXIT_FINE = 0, EXIT_USAGE = 2, EXIT_MESH = 3 };

static const char mesh_help[] =
    "usage: flesh mesh info FILE...\n"
    "       flesh mesh convert IN OUT\n"
    "       flesh mesh box --cells NX,NY,NZ --size X,Y,Z [--origin X,Y,Z] --out OUT\n"
    "\n"
    "  info     counts, sizes and quality of a tetrahedral mesh\n"
    "  convert  write a mesh in another format\n"
    "  box      make a regular grid of boxes, six tets each\n"
    "\n"
    "Read, told apart by content: TetGen .node/.ele, Gmsh .msh 2.2 and 4.1 (ASCII and binary),\n"
    "Medit .mesh (ASCII) and plain lists. Written, by suffix: .node or .ele (TetGen, both files),\n"
    ".msh (Gmsh 4.1 binary), .mesh (Medit).\n"
    "`flesh mesh COMMAND --help` tells more. Exit codes: 0 fine, 2 usage, 3 file or mesh.\n";

static const char info_help[] =
    "usage: flesh mesh info FILE...\n"
    "\n"
    "Shows for each mesh: nodes (and those that no tet uses), tets (and those whose winding was\n"
    "inverted and has been flipped), surface triangles, regions, volume, bounding box, edge\n"
    "lengths, and the tets' radius ratio, 3 * inradius / circumradius: 1 for a regular tet, 0 for\n"
    "a flat one; as a histogram and with the worst tet's place. Lengths are metres; indices count\n"
    "from 0. Exit codes: 0 fine, 2 usage, 3 file or mesh.\n";

static const char convert_help[] =
    "usage: flesh mesh convert IN OUT\n"
    "\n"
    "Reads IN (format by content) and writes OUT in the format of its suffix: .node or .ele\n"
    "(TetGen, both files), .msh (Gmsh 4.1 binary), .mesh (Medit). Nodes, tets and region tags "
    "keep\n"
    "their order; inverted tets are flipped; unused nodes are kept. An existing OUT is replaced\n"
    "only when the new one is complete. Exit codes: 0 fine, 2 usage, 3 file or mesh.\n";

static const char box_help[] =
    "usage: flesh mesh box --cells NX,NY,NZ --size X,Y,Z [--origin X,Y,Z] --out OUT\n"
    "\n"
    "Makes a regular grid of NX x NY x NZ boxes, six tets each around the diagonal from the low\n"
    "to the high corner (Kuhn), and writes it to OUT (.node, .ele, .msh, .mesh).\n"
    "  --cells NX,NY,NZ  boxes along each axis, at least 1\n"
    "  --size X,Y,Z      size of the whole grid, m\n"
    "  --origin X,Y,Z    its low corner, m (0,0,0)\n"
    "  --out OUT         file to write\n"
    "Node (i,j,k) has the index (k*(NY+1)+j)*(NX+1)+i.\n"
    "Exit codes: 0 fine, 2 usage, 3 file or mesh.\n"
    "Example: flesh mesh box --cells 16,4,4 --size 4,1,1 --out bar.msh\n";

/* Reports the library's last error. */
static int report(int status)
{
  fprintf(stderr, "flesh mesh: %s\n", flesh_error_text());
  return status == FLESH_ERR_ARGUMENT ? EXIT_USAGE : EXIT_MESH;
}

static int wants_help(int argc, char **argv)
{
  for (int a = 1; a < argc; a++)
    if (!strcmp(argv[a], "--help") || !strcmp(argv[a], "-h")) return 1;
  return 0;
}

/* Refuses anything that looks like an option where there is none. */
static int refuse_options(const char *command, int argc, char **argv)
{
  for (int a = 1; a < argc; a++)
    if (argv[a][0] == '-' && argv[a][1]) {
      fprintf(stderr, "flesh mesh %s: unknown option '%s'; see flesh mesh %s --help\n", command,
              argv[a], command);
      return 1;
    }
  return 0;
}

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
    printf("    region %-5d  %d tets, %.8g m^3\n", tags[r], tets, volume);
  }
  if (count > SHOWN) printf("    ... and %d more\n", count - SHOWN);
  free(tags);
}

static void show_histogram(const flesh_mesh *mesh)
{
  static const double bounds[] = {0,   0.001, 0.01, 0.05, 0.1, 0.2, 0.3,
                                  0.4, 0.5,   0.6,  0.7,  0.8, 0.9, 1};
  enum { BINS = sizeof bounds / sizeof *bounds - 1, WIDTH = 40 };
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
    printf("    %5g to %-5g %9d %5.1f %%  ", bounds[b], bounds[b + 1], count[b],
           100.0 * count[b] / tets);
    int length = (int)ceil((double)count[b] * WIDTH / most);
    for (int i = 0; i < length; i++) putchar('#');
    putchar('\n');
  }
}

static void show(const flesh_mesh *mesh, const char *path)
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
  printf("\n  %-14s %d", "tets", info.tets);
  if (info.flipped) printf(" (%d inverted in the file, flipped)", info.flipped);
  printf("\n  %-14s %d triangles\n", "surface", info.triangles);
  printf("  %-14s %d\n", "regions", info.regions);
  show_regions(mesh);
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
  const int *worst = flesh_mesh_tets(mesh) + 4 * (size_t)info.worst_tet;
  double centre[3] = {0};
  for (int i = 0; i < 4; i++)
    for (int d = 0; d < 3; d++) centre[d] += x[3 * (size_t)worst[i] + d] / 4;
  printf("  %-14s %d, nodes %d %d %d %d, centre (%.6g, %.6g, %.6g)\n", "worst tet", info.worst_tet,
         worst[0], worst[1], worst[2], worst[3], centre[0], centre[1], centre[2]);
}

static int command_info(int argc, char **argv)
{
  if (refuse_options("info", argc, argv)) return EXIT_USAGE;
  if (argc < 2) {
    fputs("flesh mesh info: no file is given; see flesh mesh info --help\n", stderr);
    return EXIT_USAGE;
  }
  for (int a = 1; a < argc; a++) {
    flesh_mesh *mesh;
    int status = flesh_mesh_read(argv[a], &mesh);
    if (status) return report(status);
    if (a > 1) putchar('\n');
    show(mesh, argv[a]);
    flesh_mesh_destroy(&mesh);
  }
  return EXIT_FINE;
}

static int write_and_say(const flesh_mesh *mesh, const char *path)
{
  flesh_mesh_info info;
  int status = flesh_mesh_write(mesh, path);
  if (status) return report(status);
  flesh_mesh_inspect(mesh, &info);
  printf("%s: %d nodes, %d tets, %d region%s", path, info.nodes, info.tets, info.regions,
         info.regions == 1 ? "" : "s");
  if (info.flipped) printf("; %d inverted tets flipped", info.flipped);
  if (info.unused_nodes) printf("; %d nodes used by no tet", info.unused_nodes);
  putchar('\n');
  return EXIT_FINE;
}

static int command_convert(int argc, char **argv)
{
  if (refuse_options("convert", argc, argv)) return EXIT_USAGE;
  if (argc != 3) {
    fprintf(stderr, "flesh mesh convert: %d files are given; it takes IN and OUT\n", argc - 1);
    return EXIT_USAGE;
  }
  flesh_mesh *mesh;
  int status = flesh_mesh_read(argv[1], &mesh);
  if (status) return report(status);
  status = write_and_say(mesh, argv[2]);
  flesh_mesh_destroy(&mesh);
  return status;
}

/* "a,b,c" into three numbers; returns whether that is all of the text. */
static int parse_three(const char *text, double values[3])
{
  for (int d = 0; d < 3; d++) {
    char *end;
    values[d] = strtod(text, &end);
    if (end == text || *end != (d < 2 ? ',' : 0) || !isfinite(values[d])) return 0;
    text = end + 1;
  }
  return 1;
}

static int command_box(int argc, char **argv)
{
  static const char *const names[] = {"--cells", "--size", "--origin", "--out"};
  const char *given[4] = {NULL, NULL, "0,0,0", NULL};
  double values[3][3];
  for (int a = 1; a < argc; a++) {
    int option = 0;
    size_t length = strcspn(argv[a], "=");
    while (option < 4 &&
           (strlen(names[option]) != length || strncmp(argv[a], names[option], length)))
      option++;
    if (option == 4) {
      fprintf(stderr,
              "flesh mesh box: unknown argument '%s'; it takes --cells, --size, --origin and "
              "--out\n",
              argv[a]);
      return EXIT_USAGE;
    }
    if (!argv[a][length] && a + 1 == argc) {
      fprintf(stderr, "flesh mesh box: %s has no value\n", names[option]);
      return EXIT_USAGE;
    }
    given[option] = argv[a][length] ? argv[a] + length + 1 : argv[++a];
  }
  for (int option = 0; option < 4; option++) {
    if (!given[option]) {
      fprintf(stderr, "flesh mesh box: %s is missing; see flesh mesh box --help\n", names[option]);
      return EXIT_USAGE;
    }
    if (option < 3 && !parse_three(given[option], values[option])) {
      fprintf(stderr, "flesh mesh box: %s is '%s'; it must be three numbers, such as %s\n",
              names[option], given[option],
              option == 0   ? "16,4,4"
              : option == 1 ? "4,1,1"
                            : "0,0,0");
      return EXIT_USAGE;
    }
  }
  int cells[3];
  for (int d = 0; d < 3; d++) {
    if (values[0][d] != floor(values[0][d]) || !(values[0][d] >= 1 && values[0][d] <= 1e9)) {
      fprintf(stderr, "flesh mesh box: --cells is '%s'; it must be three whole numbers from 1\n",
              given[0]);
      return EXIT_USAGE;
    }
    cells[d] = (int)values[0][d];
  }
  flesh_mesh *mesh;
  int status = flesh_mesh_box(cells, values[1], values[2], &mesh);
  if (status) return report(status);
  status = write_and_say(mesh, given[3]);
  flesh_mesh_destroy(&mesh);
  return status;
}

int flesh_command_mesh(int argc, char **argv)
{
  static const struct {
    const char *name, *help;
    int (*run)(int argc, char **argv);
  } commands[] = {{"info", info_help, command_info},
                  {"convert", convert_help, command_convert},
                  {"box", box_help, command_box}};
  if (argc < 2) {
    fputs(mesh_help, stderr);
    return EXIT_USAGE;
  }
  for (size_t c = 0; c < sizeof commands / sizeof *commands; c++)
    if (!strcmp(argv[1], commands[c].name)) {
      if (!wants_help(argc - 1, argv + 1)) return commands[c].run(argc - 1, argv + 1);
      fputs(commands[c].help, stdout);
      return EXIT_FINE;
    }
  if (wants_help(argc, argv)) {
    fputs(mesh_help, stdout);
    return EXIT_FINE;
  }
  fprintf(stderr, "flesh mesh: unknown command '%s'; it must be info, convert or box\n", argv[1]);
  return EXIT_USAGE;
}
