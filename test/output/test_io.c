// TEST quick
/* test_io.c: files are written completely or not at all; numbers are read back exactly; folders are created or
 * refused. */
#include "temporary.h"

#include <locale.h>
#include <signal.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/file.h"
#include "output/vtu.h"
#include "output/vtu_read.h"
#include "test.h"

static char folder[512];

static const char *in_folder(const char *name)
{
  static char path[1024];
  snprintf(path, sizeof path, "%s/%s", folder, name);
  return path;
}

static void put(const char *path, const char *text)
{
  flesh_file file;
  CHECK_OK(flesh_file_open(path, &file));
  fputs(text, file.stream);
  CHECK_OK(flesh_file_commit(&file));
}

static const char *content(const char *path)
{
  static char text[256];
  FILE *stream = fopen(path, "r");
  if (!stream) return "(no file)";
  text[fread(text, 1, sizeof text - 1, stream)] = 0;
  fclose(stream);
  return text;
}

static void a_committed_file_replaces_the_old_one(void)
{
  const char *path = in_folder("replaced");
  put(path, "old");
  flesh_file file;
  CHECK_OK(flesh_file_open(path, &file));
  fputs("new", file.stream);
  fflush(file.stream);
  CHECK(!strcmp(content(path), "old")); /* until the commit */
  CHECK_OK(flesh_file_commit(&file));
  CHECK(!strcmp(content(path), "new"));
}

static void an_abandoned_file_leaves_nothing(void)
{
  const char *path = in_folder("alone/abandoned");
  CHECK_OK(flesh_folder_make(in_folder("alone")));
  flesh_file file;
  path = in_folder("alone/abandoned");
  CHECK_OK(flesh_file_open(path, &file));
  fputs("half", file.stream);
  flesh_file_abandon(&file);
  flesh_file_abandon(&file);
  CHECK(!strcmp(content(path), "(no file)"));
  CHECK(rmdir(in_folder("alone")) == 0); /* empty: no temporary file is left */
}

/* A limit on file sizes makes write() fail in the middle, like a full disk. */
static void a_write_that_fails_keeps_the_target(void)
{
  const char *path = in_folder("kept");
  put(path, "precious");
  struct rlimit before, limit;
  getrlimit(RLIMIT_FSIZE, &before);
  signal(SIGXFSZ, SIG_IGN);
  limit = (struct rlimit){.rlim_cur = 10000, .rlim_max = before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &limit);
  flesh_file file;
  CHECK_OK(flesh_file_open(path, &file));
  for (int i = 0; i < 10000; i++) fputs("0123456789", file.stream);
  int status = flesh_file_commit(&file);
  double positions[3 * 4] = {0};
  int tets[4 * 1000] = {0};
  flesh_vtu grid = {.points = 4, .tets = 1000, .positions = positions, .tet_nodes = tets};
  int grid_status = flesh_vtu_write(path, &grid);
  setrlimit(RLIMIT_FSIZE, &before);
  CHECK(status == FLESH_ERR_FILE);
  CHECK(grid_status == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "kept: could not be written completely");
  CHECK(!strcmp(content(path), "precious"));
}

static void a_full_disk_is_noticed(void)
{
  struct stat info;
  if (stat("/dev/full", &info)) return;
  flesh_file file;
  CHECK_OK(flesh_file_open("/dev/full", &file));
  fputs("text", file.stream);
  CHECK(flesh_file_commit(&file) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "/dev/full");
  CHECK(!stat("/dev/full", &info) && S_ISCHR(info.st_mode));
}

static void links_and_modes_are_kept(void)
{
  char target[1024];
  snprintf(target, sizeof target, "%s", in_folder("target"));
  put(target, "1");
  chmod(target, 0600);
  const char *name = in_folder("link");
  CHECK(symlink("target", name) == 0);
  put(name, "2");
  struct stat info;
  CHECK(!lstat(name, &info) && S_ISLNK(info.st_mode));
  CHECK(!strcmp(content(target), "2"));
  CHECK(!stat(target, &info) && (info.st_mode & 0777) == 0600);
}

static void bad_targets_are_refused(void)
{
  flesh_file file;
  CHECK(flesh_file_open(in_folder("no/such/folder"), &file) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "no/such/folder");
  CHECK(flesh_file_open(folder, &file) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "is a directory");
}

static void folders_are_made_with_their_parents(void)
{
  CHECK_OK(flesh_folder_make(in_folder("a/b//c/")));
  CHECK_OK(flesh_folder_make(in_folder("a/b/c")));
  put(in_folder("a/file"), "");
  CHECK(flesh_folder_make(in_folder("a/file")) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "must be a directory");
  CHECK(flesh_folder_make(in_folder("a/file/d")) == FLESH_ERR_FILE);
  CHECK(flesh_folder_make("") == FLESH_ERR_FILE);
}

static void numbers_read_back_exactly(void)
{
  char text[FLESH_NUMBER_SIZE];
  CHECK(!strcmp(flesh_number_text(0.1, text), "0.1"));
  CHECK(!strcmp(flesh_number_text(1.0 / 3, text), "0.3333333333333333"));
  CHECK(!strcmp(flesh_number_text(-NAN, text), "nan"));
  CHECK(!strcmp(flesh_number_text(-INFINITY, text), "-inf"));
  unsigned long long random = 1;
  for (int i = 0; i < 20000; i++) {
    double value = ldexp(test_uniform(&random) - 0.5, (int)(2000 * test_uniform(&random)) - 1000);
    if (strtod(flesh_number_text(value, text), NULL) != value) {
      CHECK(!"reads back");
      printf("# %a became %s\n", value, text);
      break;
    }
  }
}

static void numbers_ignore_the_locale(void)
{
  const char *names[] = {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8", "ps_AF.UTF-8"};
  int found = 0;
  for (int i = 0; i < 4 && !found; i++) found = setlocale(LC_NUMERIC, names[i]) != NULL;
  if (!found)
    printf("# no locale with a decimal comma is installed: this test proves nothing here\n");
  char text[FLESH_NUMBER_SIZE];
  CHECK(!strcmp(flesh_number_text(-2.5e-7, text), "-2.5e-07"));
  setlocale(LC_NUMERIC, "C");
}

/* A frame of three points, as written. */
static void frames_read_back(void)
{
  double x[9], v[9], got[18];
  int tets[4] = {0, 1, 2, 2};
  for (int d = 0; d < 9; d++) x[d] = d / 7., v[d] = -d / 3.;
  const flesh_vtu_array arrays[] = {{.name = "displacement", .components = 3, .doubles = x, .unit = "m"},
                                    {.name = "velocity", .components = 3, .doubles = v}};
  const flesh_vtu content = {.points = 3, .tets = 1, .positions = x, .tet_nodes = tets,
                             .point_array_count = 2, .point_arrays = arrays};
  static const char *const names[] = {"Points", "velocity"};
  double *const targets[] = {got, got + 9};
  CHECK_OK(flesh_vtu_write(in_folder("f.vtu"), &content));
  CHECK_OK(flesh_vtu_read(in_folder("f.vtu"), 3, 2, names, targets));
  CHECK(!memcmp(got, x, sizeof x) && !memcmp(got + 9, v, sizeof v));
  CHECK(flesh_vtu_read(in_folder("f.vtu"), 4, 2, names, targets) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "f.vtu: the frame has 3 points; the mesh has 4 nodes");
  static const char *const missing[] = {"pressure"};
  CHECK(flesh_vtu_read(in_folder("f.vtu"), 3, 1, missing, targets) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "no complete array 'pressure' of vectors");
  const double times[] = {0, 1 / 3.};
  const char *const files[] = {"f.vtu", "g&h.vtu"};
  flesh_pvd index = {0};
  CHECK_OK(flesh_pvd_write(in_folder("f.pvd"), 2, times, files));
  CHECK_OK(flesh_pvd_read(in_folder("f.pvd"), &index));
  CHECK(index.count == 2 && index.times[1] == 1 / 3. && !strcmp(index.names[0], "f.vtu"));
  flesh_pvd_clear(&index);
  CHECK(flesh_pvd_read(in_folder("f.vtu"), &index) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "this is not a .pvd");
  static const char *const wrong[] = {"1e666", "nan", "", "soon", "1s"};
  for (int k = 0; k < 5; k++) {
    FILE *stream = fopen(in_folder("wrong.pvd"), "w");
    fprintf(stream, "<VTKFile type=\"Collection\">\n<DataSet timestep=\"%s\" file=\"f.vtu\"/>\n", wrong[k]);
    fclose(stream);
    CHECK(flesh_pvd_read(in_folder("wrong.pvd"), &index) == FLESH_ERR_FILE);
    CHECK_TEXT(flesh_error_text(), "not a time in seconds");
    flesh_pvd_clear(&index);
  }

  /* Lengths of four bytes, or of eight in larger files and in those of earlier versions; an array that ends early. */
  static const char array[] = "<DataArray type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\" offset=\"0\"/>";
  for (int k = 0; k < 4; k++) {
    const int wide = k & 1, whole = k < 2;
    const uint64_t length = sizeof x;
    const uint32_t narrow = sizeof x;
    FILE *stream = fopen(in_folder("made.vtu"), "wb");
    fprintf(stream, "<VTKFile byte_order=\"%s\"%s><Piece NumberOfPoints=\"3\">%s<AppendedData encoding=\"raw\">\n_",
            *(const char *)&(const short){1} ? "LittleEndian" : "BigEndian", wide ? " header_type=\"UInt64\"" : "", array);
    fwrite(wide ? (const void *)&length : &narrow, wide ? sizeof length : sizeof narrow, 1, stream);
    fwrite(x, sizeof *x, whole ? 9 : 5, stream);
    fputs("\n</VTKFile>\n", stream);
    fclose(stream);
    memset(got, 0, sizeof got);
    CHECK(flesh_vtu_read(in_folder("made.vtu"), 3, 1, names, targets) == (whole ? FLESH_OK : FLESH_ERR_FILE));
    if (whole) CHECK(!memcmp(got, x, sizeof x));
    else CHECK_TEXT(flesh_error_text(), "no complete array 'Points'");
  }
  CHECK(flesh_vtu_length_size(&content) == 4);
  flesh_vtu large = content;
  large.points = 178956970; /* 24 bytes each: 4 GiB minus 16 bytes */
  CHECK(flesh_vtu_length_size(&large) == 4);
  large.points++;
  CHECK(flesh_vtu_length_size(&large) == 8);

  /* Truncated anywhere and with bytes changed: read or refused. */
  char bytes[4096], harmed[4096];
  FILE *stream = fopen(in_folder("f.vtu"), "rb");
  size_t size = fread(bytes, 1, sizeof bytes, stream);
  unsigned long long seed = 1;
  fclose(stream);
  for (int trial = 0; trial < 400; trial++) {
    memcpy(harmed, bytes, size);
    size_t kept = trial & 1 ? size : (size_t)(test_uniform(&seed) * (double)size);
    if (trial & 1) harmed[(size_t)(test_uniform(&seed) * (double)size)] = (char)(int)(256 * test_uniform(&seed) - 128);
    stream = fopen(in_folder("h.vtu"), "wb");
    fwrite(harmed, 1, kept, stream);
    fclose(stream);
    int status = flesh_vtu_read(in_folder("h.vtu"), 3, 2, names, targets);
    CHECK(status == FLESH_ERR_FILE || (status == FLESH_OK && kept == size));
  }
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  int result =
      RUN_TESTS(argc, argv, TEST(a_committed_file_replaces_the_old_one),
                TEST(an_abandoned_file_leaves_nothing), TEST(a_write_that_fails_keeps_the_target),
                TEST(a_full_disk_is_noticed), TEST(links_and_modes_are_kept),
                TEST(bad_targets_are_refused), TEST(folders_are_made_with_their_parents),
                TEST(numbers_read_back_exactly), TEST(numbers_ignore_the_locale),
                TEST(frames_read_back));
  test_folder_remove(folder);
  return result;
}
