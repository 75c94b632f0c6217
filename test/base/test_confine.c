// TEST quick
/* test_confine.c: inside a confined folder none of the functions follows a link or ".."; elsewhere all of them do. */
#include "temporary.h"
#include "test.h"

#include <errno.h>
#include <fcntl.h>
#include <sys/stat.h>

#include "base/confine.h"
#include "base/file.h"
#include "base/folder.h"
#include "base/scan.h"

static char top[512];

static const char *at(const char *name)
{
  static char paths[4][1024];
  static int next;
  snprintf(paths[next = (next + 1) % 4], sizeof paths[0], "%s/%s", top, name);
  return paths[next];
}

static void put(const char *name, const char *text)
{
  FILE *file = fopen(at(name), "w");
  CHECK(file != NULL);
  if (file) fputs(text, file), fclose(file);
}

static int holds(const char *name, const char *text)
{
  char read[64] = "";
  FILE *file = fopen(at(name), "r");
  if (file && !fgets(read, sizeof read, file)) *read = 0;
  if (file) fclose(file);
  return file && !strcmp(read, text);
}

/* result/ and free/ have the same contents: a file, links to a file and to a folder outside, a pipe. */
static void make(const char *folder)
{
  char name[64];
  mkdir(at(folder), 0700);
  snprintf(name, sizeof name, "%s/own", folder);
  put(name, "own");
  snprintf(name, sizeof name, "%s/file", folder);
  CHECK(!symlink("../secret", at(name)));
  snprintf(name, sizeof name, "%s/folder", folder);
  CHECK(!symlink("../outside", at(name)));
  snprintf(name, sizeof name, "%s/pipe", folder);
  CHECK(!mkfifo(at(name), 0600));
}

static void links_are_refused_within(void)
{
  static const char *const names[] = {"result/file", "result/folder/inner", "result/../secret", "result//folder/inner",
                                      "result/./file", "alias/file"};
  struct stat info;
  for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
    const char *path = at(names[k]);
    char *data;
    size_t size;
    CHECK(flesh_is_confined(path));
    CHECK(flesh_path_open(path, O_RDONLY, 0) < 0 && (errno == ELOOP || errno == EXDEV));
    CHECK(flesh_path_access(path, F_OK) && flesh_path_check(path) == FLESH_ERR_FILE && !flesh_path_is_file(path));
    CHECK(flesh_path_is_there(path));
    CHECK(flesh_file_load(path, &data, &size) == FLESH_ERR_FILE);
    CHECK(strstr(flesh_error_text(), path) && (strstr(flesh_error_text(), "symbolic link") || strstr(flesh_error_text(), "'..'")));
    flesh_file file;
    CHECK(flesh_file_open(path, &file) == FLESH_ERR_FILE);
  }
  CHECK(!flesh_path_stat(at("result/file"), &info) && S_ISLNK(info.st_mode));
  CHECK(!flesh_path_list(at("result/folder")) && errno == ELOOP);
  CHECK(flesh_folder_make(at("result/folder")) == FLESH_ERR_FILE && flesh_folder_make(at("result/folder/new")) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "symbolic link");
  CHECK(flesh_path_unlink(at("result/folder/inner")) && flesh_path_rename(at("result/own"), at("result/folder/own")));
  CHECK(flesh_path_remove_folder(at("result/../outside")));
  CHECK(holds("secret", "secret") && holds("outside/inner", "inner") && holds("result/own", "own"));
}

static void what_is_there_itself_is_used(void)
{
  char *data = NULL;
  size_t size;
  flesh_file file;
  CHECK_OK(flesh_file_load(at("result/own"), &data, &size));
  free(data);
  CHECK_OK(flesh_folder_make(at("result/new/deeper/")));
  CHECK_OK(flesh_file_open(at("result/new/deeper/text"), &file));
  fputs("text", file.stream);
  CHECK_OK(flesh_file_commit(&file));
  CHECK(holds("result/new/deeper/text", "text") && !flesh_path_check(at("result/new/none")));
  CHECK(!flesh_path_is_there(at("result/new/none")));
  CHECK(flesh_path_check(at("result/pipe")) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "not a regular file but a pipe");
  CHECK(flesh_file_open(at("result/pipe"), &file) == FLESH_ERR_FILE);
  DIR *list = flesh_path_list(at("result"));
  CHECK(list && !closedir(list));
  CHECK(!flesh_path_rename(at("result/new/deeper/text"), at("result/text")) && !flesh_path_unlink(at("result/text")));
  CHECK(!flesh_path_remove_folder(at("result/new/deeper")) && !flesh_path_remove_folder(at("result/new")));
}

static void other_folders_are_as_before(void)
{
  char *data = NULL;
  size_t size;
  CHECK(!flesh_is_confined(at("free/file")) && !flesh_is_confined(at("results")) && !flesh_is_confined(at("result/")));
  CHECK_OK(flesh_file_load(at("free/file"), &data, &size));
  free(data);
  CHECK_OK(flesh_file_load(at("free/folder/../secret"), &data, &size));
  free(data);
  CHECK(!flesh_path_check(at("free/folder/inner")));
}

/* The folder is confined before it exists, and found twice; it may be given as a link to a folder. */
static void folders_are_confined_by_name(void)
{
  CHECK_OK(flesh_confine(at("later")));
  CHECK_OK(flesh_folder_make(at("later")));
  CHECK_OK(flesh_confine(at("later///")));
  CHECK_OK(flesh_folder_make(at("later/inner")));
  CHECK(!flesh_path_remove_folder(at("later/inner")) && !flesh_path_remove_folder(at("later")));
}

int main(int argc, char **argv)
{
  if (test_folder_make(top, sizeof top)) return 1;
  put("secret", "secret");
  mkdir(at("outside"), 0700);
  put("outside/inner", "inner");
  make("result");
  make("free");
  CHECK(!symlink("result", at("alias")));
  CHECK_OK(flesh_confine(at("result/")));
  CHECK_OK(flesh_confine(at("alias")));
  const int failed = RUN_TESTS(argc, argv, TEST(links_are_refused_within), TEST(what_is_there_itself_is_used),
                               TEST(other_folders_are_as_before), TEST(folders_are_confined_by_name));
  test_folder_remove(top);
  return failed;
}
