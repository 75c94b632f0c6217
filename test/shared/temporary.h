/* temporary.h: a fresh folder for a test's files. Include it before any system header. */
#ifndef FLESH_TEST_TEMPORARY_H
#define FLESH_TEST_TEMPORARY_H

#ifndef _GNU_SOURCE
#define _GNU_SOURCE /* nftw */
#endif

#include <ftw.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

/* Makes a folder under $TMPDIR or the system's temporary folder. Returns 0 on success. */
static inline int test_folder_make(char *path, size_t size)
{
  const char *parent = getenv("TMPDIR");
  snprintf(path, size, "%s/flesh-test-XXXXXX", parent && *parent ? parent : P_tmpdir);
  return mkdtemp(path) ? 0 : (perror(path), 1);
}

static int test_folder_remove_entry(const char *path, const struct stat *info, int type,
                                    struct FTW *place)
{
  (void)info, (void)type, (void)place;
  return remove(path);
}

static inline void test_folder_remove(const char *path)
{
  nftw(path, test_folder_remove_entry, 16, FTW_DEPTH | FTW_PHYS);
}

#endif
