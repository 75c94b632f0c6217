// TEST quick
/* test_archive.c: objects are restored from bytes, also if they were saved with other nodes and tets; bytes of other
 * members are detected. */
#include "test.h"

#include <stdlib.h>

#include "base/archive.h"

enum { NODES = 5, TETS = 4, SAVED = 3 };

typedef struct memory {
  double t, nodes[3 * NODES], tets[TETS];
  int count;
} memory;

static void walk(memory *m, int nodes, int tets, flesh_archive *archive)
{
  FLESH_ARCHIVE(archive, m->t);
  flesh_archive_nodes(archive, m->nodes, (size_t)nodes);
  flesh_archive_tets(archive, m->tets, (size_t)tets);
  flesh_archive_int(archive, &m->count, 1, 9);
}

static memory some(double first)
{
  memory m = {.t = first, .count = 7};
  for (int d = 0; d < 3 * NODES; d++) m.nodes[d] = first + d;
  for (int t = 0; t < TETS; t++) m.tets[t] = -first - t;
  return m;
}

/* Returns the bytes of m, allocated, and their number *size. */
static uint8_t *save(memory *m, int nodes, int tets, size_t *size)
{
  flesh_archive archive = {.mode = FLESH_ARCHIVE_MEASURE};
  walk(m, nodes, tets, &archive);
  *size = archive.at;
  archive = (flesh_archive){.mode = FLESH_ARCHIVE_SAVE, .data = malloc(*size), .size = *size};
  walk(m, nodes, tets, &archive);
  CHECK(!archive.wrong && archive.at == *size);
  return archive.data;
}

static int load(memory *m, int nodes, int tets, uint8_t *data, size_t size, const flesh_archive_others *others)
{
  flesh_archive archive = {.mode = FLESH_ARCHIVE_LOAD, .data = data, .size = size, .others = others};
  walk(m, nodes, tets, &archive);
  return archive.wrong || archive.at != size;
}

static void what_is_saved_comes_back(void)
{
  memory m = some(100), got = some(0);
  size_t size;
  uint8_t *data = save(&m, NODES, TETS, &size);
  CHECK(!load(&got, NODES, TETS, data, size, NULL) && !memcmp(&m, &got, sizeof m));
  free(data);
}

/* Nodes and tets missing from the archive stay as they are; saved ones that are missing here are dropped. */
static void of_other_nodes_and_tets(void)
{
  const int node_places[SAVED] = {4, -1, 0}, tet_places[SAVED] = {2, NODES, -1};
  const flesh_archive_others others = {SAVED, SAVED, node_places, tet_places};
  memory m = some(100), got = some(0), wanted = some(0);
  size_t size;
  uint8_t *data = save(&m, SAVED, SAVED, &size);
  wanted.t = 100;
  memcpy(wanted.nodes + 12, m.nodes, 3 * sizeof(double));
  memcpy(wanted.nodes, m.nodes + 6, 3 * sizeof(double));
  wanted.tets[2] = m.tets[0];
  CHECK(!load(&got, NODES, TETS, data, size, &others) && !memcmp(&wanted, &got, sizeof got));
  free(data);
}

static void wrong_bytes_are_found_out(void)
{
  const int places[TETS] = {0, 1, 2, 3};
  memory m = some(100), got;
  size_t size;
  uint8_t *data = save(&m, SAVED, SAVED, &size);
  for (int more = -1; more <= 1; more++) {
    const flesh_archive_others nodes = {SAVED + more, SAVED, places, places}, tets = {SAVED, SAVED + more, places, places};
    got = some(0);
    CHECK(load(&got, SAVED + more, SAVED, data, size, NULL) == (more != 0));
    CHECK(load(&got, SAVED, SAVED + more, data, size, NULL) == (more != 0));
    CHECK(load(&got, NODES, TETS, data, size, &nodes) == (more != 0));
    CHECK(load(&got, NODES, TETS, data, size, &tets) == (more != 0));
  }
  const flesh_archive_others others = {SAVED, SAVED, places, places};
  for (size_t cut = 0; cut < size; cut++) {
    uint8_t *part = malloc(cut + 1); /* so that sanitizers see reads beyond the end */
    memcpy(part, data, cut);
    got = some(0);
    CHECK(load(&got, SAVED, SAVED, part, cut, NULL) && load(&got, NODES, TETS, part, cut, &others));
    free(part);
  }
  m.count = 10;
  free(data);
  data = save(&m, SAVED, SAVED, &size);
  got = some(0);
  CHECK(load(&got, SAVED, SAVED, data, size, NULL) && got.count == 7);
  free(data);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(what_is_saved_comes_back), TEST(of_other_nodes_and_tets),
                   TEST(wrong_bytes_are_found_out));
}
