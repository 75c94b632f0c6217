/* fuzz.h: shared by the fuzzers: small files in memory, and the guarantees of every reader. */
#ifndef FLESH_TEST_CAMPAIGN_FUZZ_H
#define FLESH_TEST_CAMPAIGN_FUZZ_H

#include <fcntl.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/error.h"
#include "flesh/flesh.h"

/* Ends the fuzzer as a crash does, so that the input is kept. */
static inline void fuzz_wrong(const char *what)
{
  fprintf(stderr, "FUZZ: %s: '%s'\n", what, flesh_error_text());
  abort();
}

static inline void fuzz_expect(int condition, const char *what)
{
  if (!condition) fuzz_wrong(what);
}

/* Changes to the folder of this process, $FUZZ_FOLDER or a new one in memory. */
static inline void fuzz_start(void)
{
  static char made[] = "/dev/shm/flesh-fuzz-XXXXXX";
  const char *folder = getenv("FUZZ_FOLDER");
  if (!folder) folder = mkdtemp(made);
  if (!folder || chdir(folder)) {
    perror("FUZZ_FOLDER");
    exit(1);
  }
}

/* Writes the file; its descriptor stays open from one execution to the next. */
static inline void fuzz_write(const char *name, const void *data, size_t size)
{
  static struct {
    const char *name;
    int file;
  } known[8];
  int k = 0;
  while (k < 8 && known[k].name && known[k].name != name) k++;
  if (k == 8) fuzz_wrong("more than 8 files");
  if (!known[k].name) {
    known[k].name = name;
    known[k].file = open(name, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  }
  if (ftruncate(known[k].file, 0) || pwrite(known[k].file, data, size, 0) != (ssize_t)size)
    fuzz_wrong("a file could not be written");
}

/* Checks that a status is success, a bad argument, a bad file or lack of memory, and that a refusal is one line of
 * printable UTF-8. */
static inline void fuzz_status(int status)
{
  if (!status) return;
  fuzz_expect(status == FLESH_ERR_FILE || status == FLESH_ERR_ARGUMENT || status == FLESH_ERR_MEMORY,
              "a status that no reader documents");
  const unsigned char *c = (const unsigned char *)flesh_error_text();
  fuzz_expect(*c, "a refusal without a sentence");
  while (*c) {
    int more = *c < 0x80 ? 0 : *c >> 5 == 6 ? 1 : *c >> 4 == 14 ? 2 : *c >> 3 == 30 ? 3 : -1;
    fuzz_expect(more >= 0 && *c >= 32 && *c != 127, "a refusal that is not one printable line");
    for (c++; more > 0; more--, c++) fuzz_expect(*c >> 6 == 2, "a refusal that is cut within a letter");
  }
}

/* Selects a fixed fraction of the inputs, for checks that take long. */
static inline int fuzz_chosen(const uint8_t *data, size_t size, unsigned of)
{
  uint32_t hash = 2166136261u;
  for (size_t i = 0; i < size; i++) hash = (hash ^ data[i]) * 16777619u;
  return (hash >> 8) % of == 0;
}

/* Splits an input of several files: parts end at "\n%%\n". Returns the size of the next part and advances. */
static inline size_t fuzz_part(const uint8_t **data, size_t *left)
{
  static const char mark[] = "\n%%\n";
  const uint8_t *found = *left ? memmem(*data, *left, mark, 4) : NULL;
  size_t size = found ? (size_t)(found - *data) + 1 : *left, skip = found ? size + 3 : size;
  *data += skip;
  *left -= skip;
  return size;
}

#endif
