// TEST quick seconds=60
/* test_mesh_files.c: every format reads valid files, and what is written is read back unchanged. */
#include "mesh_files.h"
#include "flesh/solver.h"

#include <locale.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

/* Checks for the same positions, tets and regions, bit for bit. */
static int same(const flesh_mesh *a, const flesh_mesh *b)
{
  int nodes = flesh_mesh_node_count(a), tets = flesh_mesh_tet_count(a);
  return nodes == flesh_mesh_node_count(b) && tets == flesh_mesh_tet_count(b) &&
         !memcmp(flesh_mesh_positions(a), flesh_mesh_positions(b),
                 3 * (size_t)nodes * sizeof(double)) &&
         !memcmp(flesh_mesh_tets(a), flesh_mesh_tets(b), 4 * (size_t)tets * sizeof(int)) &&
         !memcmp(flesh_mesh_regions(a), flesh_mesh_regions(b), (size_t)tets * sizeof(int));
}

/* A grid with positions of many digits, alternating regions of either sign, and an unused node. */
static flesh_mesh *motley_mesh(void)
{
  flesh_mesh *grid, *mesh;
  CHECK_OK(flesh_mesh_box((int[]){3, 2, 2}, (double[]){3, 2, 2}, (double[]){0, 0, 0}, &grid));
  int nodes = flesh_mesh_node_count(grid), tets = flesh_mesh_tet_count(grid);
  double x[3 * 37];
  int regions[72];
  CHECK(nodes == 36 && tets == 72);
  unsigned long long seed = 3;
  for (int i = 0; i < 3 * nodes; i++)
    x[i] = (flesh_mesh_positions(grid)[i] + 0.1 * test_uniform(&seed)) * 1e-3;
  x[3 * 36] = -1e300, x[3 * 36 + 1] = 5e-324, x[3 * 36 + 2] = 1. / 3;
  for (int t = 0; t < tets; t++)
    regions[t] = t < 30 ? 5 : t % 3 == 0 ? 0 : t % 3 == 1 ? -2147483647 : 1 << 30;
  CHECK_OK(flesh_mesh_create(37, x, tets, flesh_mesh_tets(grid), regions, &mesh));
  flesh_mesh_destroy(&grid);
  return mesh;
}

static int entries_in_work_folder(void)
{
  int count = 0;
  DIR *folder = opendir(work_folder);
  for (struct dirent *entry; (entry = readdir(folder));) count += entry->d_name[0] != '.';
  closedir(folder);
  return count;
}

static void written_meshes_read_back_the_same(void)
{
  static const char *const names[] = {"a.msh", "b.mesh", "c.node", "d.ele"};
  flesh_mesh *mesh = motley_mesh(), *back;
  for (int f = 0; f < 4; f++)
    for (int again = 0; again < 2; again++) { /* the second time over the first file */
      CHECK_OK(flesh_mesh_write(mesh, in_work_folder(names[f])));
      CHECK_OK(flesh_mesh_read(in_work_folder(names[f]), &back));
      CHECK(back && same(mesh, back));
      flesh_mesh_destroy(&back);
    }
  CHECK_OK(flesh_mesh_read(in_work_folder("c.ele"), &back));
  CHECK(back && same(mesh, back));
  CHECK(entries_in_work_folder() == 6);
  flesh_mesh_destroy(&back);
  flesh_mesh_destroy(&mesh);
}

static void failed_writes_leave_nothing(void)
{
  flesh_mesh *mesh = motley_mesh(), *back;
  int before = entries_in_work_folder();
  CHECK(flesh_mesh_write(mesh, in_work_folder("a.stl")) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "suffix '.stl' names no mesh format; it must be .node or .ele");
  CHECK(flesh_mesh_write(mesh, in_work_folder("mesh")) == FLESH_ERR_ARGUMENT);
  CHECK(flesh_mesh_write(mesh, in_work_folder("no/such/a.msh")) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "no/such/a.msh: cannot be written: No such file");
  CHECK(!mkdir(in_work_folder("folder.ele"), 0777));
  CHECK(flesh_mesh_write(mesh, in_work_folder("folder.node")) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "folder.ele: cannot be written: it is a directory");
  CHECK(entries_in_work_folder() == before + 1); /* no folder.node, no temporary file */
  CHECK(!rmdir(in_work_folder("folder.ele")));

  /* A disk that fills up half-way, while an existing file is overwritten. */
  flesh_mesh *old;
  CHECK_OK(flesh_mesh_box((int[]){1, 1, 1}, (double[]){1, 1, 1}, (double[]){0, 0, 0}, &old));
  CHECK_OK(flesh_mesh_write(old, in_work_folder("full.mesh")));
  before = entries_in_work_folder();
  struct rlimit limit, small;
  getrlimit(RLIMIT_FSIZE, &limit);
  small = limit;
  small.rlim_cur = 1000;
  signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &small);
  int status = flesh_mesh_write(mesh, in_work_folder("full.mesh"));
  setrlimit(RLIMIT_FSIZE, &limit);
  CHECK(status == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "full.mesh: could not be written completely: File too large");
  CHECK(entries_in_work_folder() == before);
  CHECK_OK(flesh_mesh_read(in_work_folder("full.mesh"), &back));
  CHECK(back && same(old, back));
  flesh_mesh_destroy(&back);
  flesh_mesh_destroy(&old);
  flesh_mesh_destroy(&mesh);
}

/* Checks that the file contains the two tets with regions 3 and `second`, in any of the formats. */
static void check_two_tets(const char *path, int first, int second)
{
  flesh_mesh *mesh, *expected;
  CHECK_OK(flesh_mesh_read(path, &mesh));
  CHECK_OK(flesh_mesh_create(5, two_positions, 2, (int[]){0, 1, 2, 3, 0, 2, 1, 4},
                             (int[]){first, second}, &expected));
  CHECK(mesh && same(mesh, expected));
  flesh_mesh_destroy(&mesh);
  flesh_mesh_destroy(&expected);
}

static char *with_line_ends(const char *text, const char *end)
{
  char *out = malloc(8 * strlen(text) + 1), *to = out;
  for (; *text; text++)
    if (*text == '\n') to = stpcpy(to, end);
    else *to++ = *text;
  *to = 0;
  return out;
}

static void each_text_format_reads(void)
{
  static const struct {
    const char *name, *text;
    int first, second;
  } files[] = {{"two.txt", plain_text, 0, 0},     {"two.mesh", medit_text, 3, 40},
               {"two22.msh", gmsh22_text, 3, 40}, {"two41.msh", gmsh41_text, 3, 40},
               {"two.dat", gmsh41_text, 3, 40}, /* the name does not matter */
               {"odd.node", medit_text, 3, 40}};
  static const char *const ends[] = {"\n", "\r\n", " \t\n"};
  for (size_t f = 0; f < sizeof files / sizeof *files; f++)
    for (int e = 0; e < 3; e++) {
      char *text = with_line_ends(files[f].text, ends[e]);
      check_two_tets(write_text(files[f].name, text), files[f].first, files[f].second);
      free(text);
    }
  for (int e = 0; e < 3; e++) {
    char *nodes = with_line_ends(node_text, ends[e]), *tets = with_line_ends(ele_text, ends[e]);
    write_text("two.node", nodes);
    check_two_tets(write_text("two.ele", tets), 3, 40);
    check_two_tets(in_work_folder("two.node"), 3, 40);
    free(nodes);
    free(tets);
  }
  /* Numbered from 0, without markers, attributes or regions. */
  write_text("zero.node", "  \n5 3\n 0 0 0 0\n 1 1 0 0\n 2 0 1.5 0\n 3 0 0 1\n 4 0 0 -0.1");
  check_two_tets(write_text("zero.ele", "2 4\n 0 0 1 2 3\n 1 0 2 1 4"), 0, 0);
  /* Leading comments and blanks, no line break at the end, no End. */
  check_two_tets(write_text("lead.mesh",
                            "\xef\xbb\xbf# made by hand\n\n  MeshVersionFormatted 1 Dimension 3 "
                            "Vertices 5 0 0 0 0 1 0 0 0 0 1.5 0 0 0 0 1 0 0 0 -1e-1 0 "
                            "Tetrahedra 2 1 2 3 4 -1 1 3 2 5 -2"),
                 -1, -2);
}

static void binary_gmsh_reads_in_either_byte_order(void)
{
  byte_writer w;
  for (int swap = 0; swap < 2; swap++) {
    make_gmsh22(&w, swap);
    check_two_tets(write_bytes("b22.msh", w.bytes, w.size), 3, 40);
    make_gmsh41(&w, swap);
    check_two_tets(write_bytes("b41.msh", w.bytes, w.size), 3, 40);
  }
}

/* A copy as text puts a CR before each LF, also within binary numbers. */
static void binary_gmsh_copied_as_text_is_refused(void)
{
  byte_writer w, copy = {.size = 0};
  flesh_mesh *mesh;
  make_gmsh41(&w, 0);
  for (size_t k = 0; k < w.size; k++) {
    if (w.bytes[k] == '\n') put_text(&copy, "\r");
    copy.bytes[copy.size++] = w.bytes[k];
  }
  CHECK(flesh_mesh_read(write_bytes("copy.msh", copy.bytes, copy.size), &mesh) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "copy.msh:2: a binary file's line ends in CR LF");
}

static void files_of_the_gmsh_program_agree(void)
{
  static const struct {
    const char *path;
    int left, right;
    int renumbered; /* the program's partitioning reorders nodes and tets */
  } files[] = {{"reference/meshes/two_boxes_41_binary.msh", 7, 9, 0},
               {"reference/meshes/two_boxes_41_ascii.msh", 7, 9, 0},
               {"reference/meshes/two_boxes_22_binary.msh", 7, 9, 0},
               {"reference/meshes/two_boxes_22_ascii.msh", 7, 9, 0},
               {"reference/meshes/two_boxes_22_untagged.msh", 3, 5, 0},
               {"reference/meshes/two_boxes_41_parts.msh", 7, 9, 1},
               {"reference/meshes/two_boxes_41_untagged_parts.msh", 3, 5, 1}};
  flesh_mesh *first, *mesh;
  CHECK_OK(flesh_mesh_read(files[0].path, &first));
  for (size_t f = 0; f < sizeof files / sizeof *files; f++) {
    flesh_mesh_info info;
    double halves[2] = {0, 0};
    CHECK_OK(flesh_mesh_read(files[f].path, &mesh));
    flesh_mesh_inspect(mesh, &info);
    CHECK(info.nodes == 23 && info.tets == 48 && info.triangles == 40);
    CHECK(info.unused_nodes == 0 && info.regions == 2);
    CHECK_NEAR(info.volume, 1.5, 1e-14);
    for (int t = 0; t < info.tets; t++) {
      int right = flesh_mesh_regions(mesh)[t] == files[f].right;
      CHECK(right || flesh_mesh_regions(mesh)[t] == files[f].left);
      halves[right] += flesh_mesh_tet_volumes(mesh)[t];
    }
    CHECK_NEAR(halves[0], 1, 1e-14);
    CHECK_NEAR(halves[1], 0.5, 1e-14);
    if (!files[f].renumbered) {
      CHECK(!memcmp(flesh_mesh_tets(first), flesh_mesh_tets(mesh), 4 * 48 * sizeof(int)));
      /* gmsh writes 16 digits. */
      for (int i = 0; i < 3 * 23; i++)
        CHECK_NEAR(flesh_mesh_positions(mesh)[i], flesh_mesh_positions(first)[i], 1e-15);
    }
    flesh_mesh_destroy(&mesh);
  }
  flesh_mesh_destroy(&first);
}

/* Switches to a locale with a decimal comma: an installed one, or one made for the test. */
static int enter_comma_locale(void)
{
  static const char *const names[] = {"de_DE.UTF-8", "de_DE", "fr_FR.UTF-8", "it_IT.UTF-8"};
  for (size_t i = 0; i < sizeof names / sizeof *names; i++)
    if (setlocale(LC_ALL, names[i]) && *localeconv()->decimal_point == ',') return 1;
  char command[1400];
  snprintf(command, sizeof command, "localedef -i de_DE -f UTF-8 '%s/de_DE.UTF-8' >'%s/log' 2>&1",
           work_folder, work_folder);
  int made = system(command);
  setenv("LOCPATH", work_folder, 1);
  return !made && setlocale(LC_ALL, "de_DE.UTF-8") && *localeconv()->decimal_point == ',';
}

static void a_decimal_comma_changes_nothing(void)
{
  int found = enter_comma_locale();
  if (!found) printf("# no locale with a decimal comma can be had: tried in the plain one\n");
  flesh_mesh *mesh = motley_mesh(), *back;
  char shown[32];
  CHECK_OK(flesh_mesh_write(mesh, in_work_folder("comma.mesh")));
  CHECK_OK(flesh_mesh_read(in_work_folder("comma.mesh"), &back));
  CHECK(back && same(mesh, back));
  /* The caller's locale is unchanged. */
  snprintf(shown, sizeof shown, "%.1f", 0.5);
  CHECK_TEXT(shown, found ? "0,5" : "0.5");
  check_two_tets(write_text("comma.txt", plain_text), 0, 0);
  FILE *file = tmpfile();
  char row[256] = "";
  CHECK_OK(flesh_solve_stats_print(&(flesh_solve_stats){.h_last = 0.5}, FLESH_STATS_CSV_ROW, file));
  rewind(file);
  CHECK(fgets(row, sizeof row, file) != NULL);
  CHECK(strstr(row, ",0.5,") != NULL);
  fclose(file);
  setlocale(LC_ALL, "C");
  flesh_mesh_destroy(&back);
  flesh_mesh_destroy(&mesh);
}

static void shipped_meshes_are_what_their_names_say(void)
{
  static const struct {
    const char *name;
    int nodes, tets, triangles, flipped, unused, regions;
    double volume, tolerance, worst; /* least radius ratio: at least this */
  } meshes[] = {
      {"one_tet.mesh", 4, 1, 4, 0, 0, 1, 1. / 6, 1e-15, 0.73},
      {"one_inverted_tet.mesh", 4, 1, 4, 1, 0, 1, 1. / 6, 1e-15, 0.73},
      {"one_regular_tet.mesh", 4, 1, 4, 0, 0, 1, 8. / 3, 1e-15, 1 - 1e-14},
      {"one_sliver_tet.mesh", 4, 1, 4, 0, 0, 1, 1e-4 / 6, 1e-18, 1e-4},
      {"two_tets_sharing_a_face.mesh", 5, 2, 6, 0, 0, 1, 1. / 3, 1e-15, 0.73},
      {"two_tets_sharing_an_edge.mesh", 6, 2, 8, 0, 0, 1, 1. / 3, 1e-15, 0.73},
      {"two_tets_sharing_a_node.mesh", 7, 2, 8, 0, 0, 1, 1. / 3, 1e-15, 0.73},
      {"two_separate_tets.mesh", 8, 2, 8, 0, 0, 1, 1. / 3, 1e-15, 0.73},
      {"cube_of_six_tets.mesh", 8, 6, 12, 0, 0, 1, 1, 1e-15, 0.71},
      {"unused_node.mesh", 5, 1, 4, 0, 1, 1, 1. / 6, 1e-15, 0.73},
      {"two_regions.mesh", 5, 2, 6, 0, 0, 2, 1. / 3, 1e-15, 0.73},
      {"bar_8x2x2.mesh", 81, 192, 144, 0, 0, 1, 4, 1e-14, 0.71},
      {"bar_16x4x4.mesh", 425, 1536, 576, 0, 0, 1, 4, 1e-14, 0.71},
      {"finger_coarse.msh", 456, 1474, 718, 0, 0, 1, 1.749e-5, 4e-7, 0.1},
      {"finger_fine.msh", 1894, 7689, 2246, 0, 0, 1, 1.749e-5, 2e-7, 0.1},
      {"hand_coarse.msh", 1515, 5100, 2306, 0, 0, 1, 2.63e-4, 7e-6, 0.1},
      {"hand_fine.msh", 11091, 49764, 10582, 0, 0, 1, 2.63e-4, 1e-6, 0.1},
  };
  for (size_t m = 0; m < sizeof meshes / sizeof *meshes; m++) {
    char path[128];
    flesh_mesh *mesh;
    flesh_mesh_info info;
    snprintf(path, sizeof path, "../data/meshes/%s", meshes[m].name);
    CHECK_OK(flesh_mesh_read(path, &mesh));
    if (!mesh) continue;
    flesh_mesh_inspect(mesh, &info);
    printf("# %s\n", meshes[m].name);
    CHECK(info.nodes == meshes[m].nodes && info.tets == meshes[m].tets);
    CHECK(info.triangles == meshes[m].triangles && info.flipped == meshes[m].flipped);
    CHECK(info.unused_nodes == meshes[m].unused && info.regions == meshes[m].regions);
    CHECK_NEAR(info.volume, meshes[m].volume, meshes[m].tolerance);
    CHECK(info.radius_ratio_min >= meshes[m].worst);
    flesh_mesh_destroy(&mesh);
  }
}

int main(int argc, char **argv)
{
  if (!make_work_folder()) return 1;
  return RUN_TESTS(argc, argv, TEST(written_meshes_read_back_the_same),
                   TEST(failed_writes_leave_nothing), TEST(each_text_format_reads),
                   TEST(binary_gmsh_reads_in_either_byte_order),
                   TEST(binary_gmsh_copied_as_text_is_refused),
                   TEST(files_of_the_gmsh_program_agree), TEST(a_decimal_comma_changes_nothing),
                   TEST(shipped_meshes_are_what_their_names_say));
}
