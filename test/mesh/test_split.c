// TEST quick
/* test_split.c: split meshes: the parts reassemble the whole, know their surroundings, and detect damage. */
#include "mesh_files.h"

#include <inttypes.h>

#include "base/archive.h"
#include "mesh/split.h"

enum { PARTS = 3 };

static flesh_mesh *make_box(int order)
{
  flesh_mesh *box, *mesh;
  CHECK_OK(flesh_mesh_box((int[]){6, 3, 2}, (double[]){3, 1, 0.7}, (double[]){-1, 0, 2}, &box));
  const int tets = flesh_mesh_tet_count(box);
  int *regions = malloc((size_t)tets * sizeof *regions);
  for (int t = 0; t < tets; t++) regions[t] = t % 5 ? -7 : t / 50;
  CHECK_OK(flesh_mesh_create(flesh_mesh_node_count(box), flesh_mesh_positions(box), tets, flesh_mesh_tets(box), regions,
                             &mesh));
  free(regions);
  flesh_mesh_destroy(&box);
  if (order == 1) return mesh;
  CHECK_OK(flesh_mesh_raise_order(mesh, &box));
  flesh_mesh_destroy(&mesh);
  return box;
}

/* Divides into slabs along x, or scatters the tets. */
static int *make_owners(const flesh_mesh *mesh, int scattered)
{
  const int tets = flesh_mesh_tet_count(mesh);
  int *owners = malloc((size_t)tets * sizeof *owners);
  for (int t = 0; t < tets; t++) {
    const double x = flesh_mesh_positions(mesh)[3 * flesh_mesh_tets(mesh)[4 * t]];
    owners[t] = scattered ? (int)((unsigned)t * 2654435761u >> 20) % PARTS : x < -0.4 ? 0 : x < 0.9 ? 1 : 2;
  }
  return owners;
}

static void check_same(const flesh_mesh *a, const flesh_mesh *b)
{
  const size_t tets = (size_t)flesh_mesh_tet_count(a), nodes = (size_t)flesh_mesh_node_count(a);
  CHECK(flesh_mesh_tet_count(b) == (int)tets && flesh_mesh_node_count(b) == (int)nodes);
  CHECK(flesh_mesh_order(a) == flesh_mesh_order(b));
  CHECK(!memcmp(flesh_mesh_positions(a), flesh_mesh_positions(b), 3 * nodes * sizeof(double)));
  CHECK(!memcmp(flesh_mesh_tets(a), flesh_mesh_tets(b), 4 * tets * sizeof(int)));
  CHECK(!memcmp(flesh_mesh_regions(a), flesh_mesh_regions(b), tets * sizeof(int)));
  if (flesh_mesh_order(a) == 2) CHECK(!memcmp(flesh_mesh_tet_edges(a), flesh_mesh_tet_edges(b), 6 * tets * sizeof(int)));
}

/* Two sets: "a b" with nodes and tets, and one without tets. */
static void add_sets(flesh_mesh *mesh)
{
  int set;
  CHECK_OK(flesh_mesh_sets_take(&mesh->sets, "a b", 3, &set));
  for (int i = 0; i < mesh->nodes; i += 3) CHECK_OK(flesh_members_add(&mesh->sets.sets[set].nodes, i));
  for (int t = 1; t < mesh->tets; t += 7) CHECK_OK(flesh_members_add(&mesh->sets.sets[set].tets, t));
  CHECK_OK(flesh_mesh_sets_take(&mesh->sets, "#c", 2, &set));
  CHECK_OK(flesh_members_add(&mesh->sets.sets[set].nodes, mesh->nodes - 1));
}

static void check_same_members(const flesh_members *a, const flesh_members *b)
{
  CHECK(a->count == b->count && !(a->count && memcmp(a->values, b->values, (size_t)a->count * sizeof *a->values)));
}

/* Each part has the members of the whole's sets among its nodes and tets, and together they reassemble the sets. */
static void parts_keep_the_sets(void)
{
  for (int order = 1; order <= 2; order++) {
    flesh_mesh *mesh = make_box(order), *again = NULL;
    int *owners = make_owners(mesh, order == 2);
    flesh_split split;
    add_sets(mesh);
    CHECK_OK(flesh_split_mesh(mesh, PARTS, owners, in_work_folder("sets")));
    CHECK_OK(flesh_mesh_read(in_work_folder("sets/index.txt"), &again));
    CHECK(again && again->sets.count == 2 && !strcmp(again->sets.sets[0].name, "a b") && !strcmp(again->sets.sets[1].name, "#c"));
    for (int k = 0; k < 2 && again && again->sets.count == 2; k++) {
      check_same_members(&mesh->sets.sets[k].nodes, &again->sets.sets[k].nodes);
      check_same_members(&mesh->sets.sets[k].tets, &again->sets.sets[k].tets);
    }
    flesh_mesh_destroy(&again);
    CHECK_OK(flesh_split_open(in_work_folder("sets/index.txt"), &split));
    for (int part = 0; part < PARTS; part++) {
      CHECK_OK(flesh_split_read_part(&split, part, &again));
      CHECK(again && again->sets.count == 2);
      int nodes = 0, tets = 0;
      for (int i = 0; again && i < again->nodes; i++) nodes += again->split->nodes[i] % 3 == 0;
      for (int t = 0; again && t < again->tets; t++) tets += again->split->tets[t] % 7 == 1;
      CHECK(again && again->sets.sets[0].nodes.count == nodes && again->sets.sets[0].tets.count == tets && nodes && tets);
      flesh_mesh_destroy(&again);
    }
    flesh_split_close(&split);
    free(owners);
    flesh_mesh_destroy(&mesh);
  }
}

static void parts_make_the_whole_again(void)
{
  for (int order = 1; order <= 2; order++)
    for (int scattered = 0; scattered < 2; scattered++) {
      flesh_mesh *mesh = make_box(order), *again = NULL;
      int *owners = make_owners(mesh, scattered);
      CHECK_OK(flesh_split_mesh(mesh, PARTS, owners, in_work_folder("parts")));
      CHECK_OK(flesh_mesh_read(in_work_folder("parts/index.txt"), &again));
      check_same(mesh, again);
      free(owners);
      flesh_mesh_destroy(&mesh);
      flesh_mesh_destroy(&again);
    }
}

/* Blocks that do not divide the cells evenly, along one axis and along several. */
static void boxes_in_parts_are_boxes(void)
{
  static const struct {
    int cells[3], parts;
  } boxes[] = {{{7, 3, 2}, 1}, {{7, 3, 2}, 3}, {{7, 5, 3}, 4}, {{5, 5, 5}, 12}, {{1, 1, 9}, 9}};
  const double size[3] = {0.7, 1.1, 3}, origin[3] = {1, -2, 0.3};
  for (size_t k = 0; k < sizeof boxes / sizeof *boxes; k++) {
    flesh_mesh *mesh = NULL, *again = NULL;
    flesh_split split;
    CHECK_OK(flesh_split_box(boxes[k].cells, size, origin, boxes[k].parts, in_work_folder("box"), &split));
    CHECK_OK(flesh_mesh_box(boxes[k].cells, size, origin, &mesh));
    CHECK_OK(flesh_mesh_read(in_work_folder("box/index.txt"), &again));
    CHECK(split.parts == boxes[k].parts && split.tets == flesh_mesh_tet_count(mesh));
    check_same(mesh, again);
    flesh_split_close(&split);
    flesh_mesh_destroy(&mesh);
    flesh_mesh_destroy(&again);
  }
  flesh_split split;
  CHECK(flesh_split_box((int[]){2, 3, 2}, size, origin, 5, in_work_folder("box"), &split) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "5 parts cannot be blocks of 2 x 3 x 2 cells");
  flesh_split_close(&split);
}

/* Marks the tets with a marked node, and the nodes of marked tets. */
static void grow(const flesh_mesh *mesh, char *has_tet, char *has_node)
{
  const int *tets = flesh_mesh_tets(mesh);
  for (int k = 0; k < 4 * flesh_mesh_tet_count(mesh); k++) has_tet[k / 4] |= has_node[tets[k]];
  for (int k = 0; k < 4 * flesh_mesh_tet_count(mesh); k++) has_node[tets[k]] |= has_tet[k / 4];
}

/* Whether a face with these nodes of the whole is on its surface. */
static int is_on_surface(const flesh_mesh *whole, const int n[3])
{
  int count, found = 0;
  const int *surface = flesh_mesh_surface(whole, &count);
  for (int k = 0; k < count; k++) {
    int same = 0;
    for (int a = 0; a < 9; a++) same += surface[3 * k + a / 3] == n[a % 3];
    found |= same == 3;
  }
  return found;
}

static void check_part(const flesh_mesh *whole, const int *owners, const flesh_mesh *mesh)
{
  const flesh_split_part *part = mesh->split;
  const int tets = flesh_mesh_tet_count(whole), nodes = flesh_mesh_node_count(whole);
  char *near = calloc((size_t)tets, 1), *has = calloc((size_t)tets, 1), *has_node = calloc((size_t)nodes, 1);
  CHECK(part && part->whole_nodes == nodes && part->whole_tets == tets && part->parts == PARTS);
  for (int i = 0; i < mesh->nodes; i++) {
    CHECK(!memcmp(mesh->positions + 3 * i, flesh_mesh_positions(whole) + 3 * part->nodes[i], 3 * sizeof(double)));
    CHECK(flesh_split_part_find(part, mesh->nodes, part->nodes[i]) == i);
  }
  for (int t = 0; t < mesh->tets; t++) {
    CHECK(part->owners[t] == owners[part->tets[t]] && mesh->regions[t] == flesh_mesh_regions(whole)[part->tets[t]]);
    for (int a = 0; a < 4; a++)
      CHECK(part->nodes[mesh->tet_nodes[4 * t + a]] == flesh_mesh_tets(whole)[4 * part->tets[t] + a]);
    has[part->tets[t]] = 1;
  }
  for (int t = 0; t < tets; t++)
    for (int a = 0; a < 4 && owners[t] == part->part; a++) has_node[flesh_mesh_tets(whole)[4 * t + a]] = 1;
  grow(whole, near, has_node);
  char *next = malloc((size_t)tets); /* own tets and one layer: their boundary faces are on the whole's surface */
  memcpy(next, near, (size_t)tets);
  grow(whole, near, has_node);
  CHECK(!memcmp(near, has, (size_t)tets));
  for (int k = 0; k < mesh->triangles; k++) {
    const int *n = mesh->surface + 3 * k;
    if (next[part->tets[mesh->surface_tets[k]]])
      CHECK(is_on_surface(whole, (int[]){part->nodes[n[0]], part->nodes[n[1]], part->nodes[n[2]]}));
  }
  free(near), free(has), free(has_node), free(next);
}

static void a_part_knows_two_layers_around(void)
{
  flesh_mesh *whole = make_box(1);
  for (int scattered = 0; scattered < 2; scattered++) {
    int *owners = make_owners(whole, scattered);
    flesh_split split;
    CHECK_OK(flesh_split_mesh(whole, PARTS, owners, in_work_folder("parts")));
    CHECK_OK(flesh_split_open(in_work_folder("parts/index.txt"), &split));
    CHECK(split.region_count == 6 && split.regions[0] == -7 && split.regions[5] == 4);
    for (int part = 0; part < PARTS; part++) {
      flesh_mesh *mesh = NULL;
      CHECK_OK(flesh_split_read_part(&split, part, &mesh));
      if (mesh) check_part(whole, owners, mesh);
      if (mesh) CHECK(flesh_split_has_region(mesh->split, 3) && !flesh_split_has_region(mesh->split, 9));
      flesh_mesh_destroy(&mesh);
    }
    flesh_split_close(&split);
    free(owners);
  }
  flesh_mesh_destroy(&whole);
}

static char *load(const char *path, size_t *size)
{
  char *data = NULL;
  CHECK_OK(flesh_file_load(path, &data, size));
  return data;
}

/* Part 1 and the whole are refused with these words, and part 0 is unchanged. */
static void check_refused(const char *words)
{
  flesh_split split;
  flesh_mesh *mesh = NULL;
  CHECK_OK(flesh_split_open(in_work_folder("parts/index.txt"), &split));
  CHECK(flesh_split_read_part(&split, 1, &mesh) == FLESH_ERR_FILE && !mesh);
  CHECK_TEXT(flesh_error_text(), words);
  CHECK(flesh_mesh_read(in_work_folder("parts/index.txt"), &mesh) == FLESH_ERR_FILE && !mesh);
  CHECK_OK(flesh_split_read_part(&split, 0, &mesh));
  flesh_mesh_destroy(&mesh);
  flesh_split_close(&split);
}

static void write_parts(const char *folder, double scale)
{
  flesh_mesh *mesh = make_box(1);
  int *owners = make_owners(mesh, 0);
  for (int d = 0; d < 3 * mesh->nodes; d++) mesh->positions[d] *= scale;
  CHECK_OK(flesh_split_mesh(mesh, PARTS, owners, in_work_folder(folder)));
  free(owners);
  flesh_mesh_destroy(&mesh);
}

static void damage_is_told(void)
{
  size_t size;
  write_parts("parts", 1);
  write_parts("others", 2);
  char *data = load(in_work_folder("parts/part_00001.bin"), &size);
  for (size_t at = 0; at < size; at += 61) { /* every array has some */
    data[at] ^= 0x10;
    write_bytes("parts/part_00001.bin", data, size);
    check_refused("part_00001.bin: ");
    data[at] ^= 0x10;
  }
  write_bytes("parts/part_00001.bin", data, size - 8);
  check_refused("bytes; by the index");
  unlink(in_work_folder("parts/part_00001.bin"));
  check_refused("part 1 of the split mesh of");
  free(data);
  data = load(in_work_folder("others/part_00001.bin"), &size);
  write_bytes("parts/part_00001.bin", data, size);
  check_refused("the part is not of the split mesh of");
  free(data);
  data = load(in_work_folder("parts/part_00000.bin"), &size);
  write_bytes("parts/part_00001.bin", data, size); /* of another size or with another number */
  check_refused("part_00001.bin: the part ");
  free(data);
}

/* Parts with a correct checksum but contradictory numbers. */
static void what_contradicts_itself_is_refused(void)
{
  write_parts("parts", 1);
  flesh_split split;
  flesh_split_arrays a;
  flesh_mesh *mesh = NULL;
  CHECK_OK(flesh_split_open(in_work_folder("parts/index.txt"), &split));
  CHECK_OK(flesh_split_load_part(&split, 1, &a));
  int own = 0;
  while (a.owners[own] != 1) own++;
  int *const places[] = {a.node_numbers + 3, a.tet_nodes + 5, a.tet_numbers + 2, a.owners + own, a.owners + own,
                         a.tet_nodes + 7, a.node_numbers + a.nodes - 1};
  const int wrong[] = {a.node_numbers[2], a.nodes, a.tet_numbers[9], PARTS, 2, -1, split.nodes};
  for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
    const int right = *places[k];
    *places[k] = wrong[k];
    const flesh_split_row row = split.rows[1];
    CHECK_OK(flesh_split_write_part(&split, in_work_folder("parts"), 1, &a));
    split.rows[1] = row;
    CHECK(flesh_split_read_part(&split, 1, &mesh) == FLESH_ERR_FILE && !mesh);
    CHECK_TEXT(flesh_error_text(), "the part is inconsistent");
    *places[k] = right;
  }
  /* A tet that two parts claim, in place of another that none does. */
  flesh_split_arrays first;
  CHECK_OK(flesh_split_load_part(&split, 0, &first));
  int other = 0;
  while (a.owners[other] != 0) other++;
  a.owners[other] = 1;
  a.owners[own] = 0;
  CHECK_OK(flesh_split_write_part(&split, in_work_folder("parts"), 1, &a));
  CHECK(flesh_mesh_read(in_work_folder("parts/index.txt"), &mesh) == FLESH_ERR_FILE && !mesh);
  CHECK_TEXT(flesh_error_text(), "which is another's already");
  flesh_split_arrays_clear(&first);
  flesh_split_arrays_clear(&a);
  flesh_split_close(&split);
}

static void bad_indices_are_refused(void)
{
  static const char *const bad[][2] = {
      {"flesh-split-mesh 2\n", "flesh-split-mesh is 2; it must be 3 to 3"},
      {"flesh-split-mesh 3\nmark -1\n", "mark is -1"},
      {"flesh-split-mesh 3\nmark 1\norder 3\n", "order is 3; it must be 1 to 2"},
      {"flesh-split-mesh 3\nmark 1\norder 1\nnodes 800000000\n", "nodes is 800000000; it must be 4 to 715827882"},
      {"flesh-split-mesh 3\nmark 1\norder 1\nnodes 4\ntets 0\n", "tets is 0"},
      {"flesh-split-mesh 3\nmark 1\norder 1\nnodes 4\ntets 1\nparts 1\n", "'parts' stands where `regions N` is expected"},
      {"flesh-split-mesh 3\nmark 1\norder 1\nnodes 4\ntets 1\nregions 2\n3\n3\nparts 1\n", "tags must rise"},
      {"flesh-split-mesh 3\nmark 1\norder 1\nnodes 4\ntets 1\nregions 1\n0\nsets 2\na\na\nparts 1\n", "the set 'a' is there twice"},
      {"flesh-split-mesh 3\nmark 1\norder 1\nnodes 4\ntets 1\nregions 1\n0\nsets 1\n\n", "the name of set 0 is missing"},
      {"flesh-split-mesh 3\nmark 1\norder 1\nnodes 4\ntets 1\nregions 1\n0\nsets 0\nparts 1\n1 1 4 -1\n", "-1 members of sets"},
      {"flesh-split-mesh 3\nmark 1\norder 1\nnodes 4\ntets 1\nregions 9000000\n", "region tag is 9000000, but only"},
      {"flesh-split-mesh 3\nmark 1\norder 1\nnodes 4\ntets 2\nregions 1\n0\nsets 0\nparts 1\n1 1 4 0\n",
       "the parts have 1 tets of their own, the whole has 2"},
      {"flesh-split-mesh 3\nmark 1\norder 1\nnodes 4\ntets 1\nregions 1\n0\nsets 0\nparts 1\n0 1 4 0\n", "one own tet at least"},
      {"flesh-split-mesh 3\nmark 1\norder 1\nnodes 4\ntets 1\nregions 1\n0\nsets 0\nparts 1\n1 1 4 0\n5\n", "behind the last of 1"},
      {"flesh-split-mesh 3\nmark 1\norder 1\nnodes 4\ntets 1\nregions 1\n0\nsets 0\nparts 1\n1 1 4 0\n", "`sum N` is expected"},
      {"flesh-split-mesh 3\nmark 1\norder 1\nnodes 4\ntets 1\nregions 1\n0\nsets 0\nparts 1\n1 1 4 0\nsum 0123456789abcdef\n",
       "the index is damaged"},
  };
  flesh_mesh *mesh = NULL;
  for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
    CHECK(flesh_mesh_read(write_text("bad.txt", bad[k][0]), &mesh) == FLESH_ERR_FILE && !mesh);
    CHECK_TEXT(flesh_error_text(), bad[k][1]);
  }
  /* Sizes of the whole, and of a missing part; no memory is allocated. */
  static const char huge[] = "flesh-split-mesh 3\nmark 1\norder 1\nnodes 700000000\ntets 500000000\nregions 1\n0\nsets 0\nparts 1\n"
                             "500000000 500000000 700000000 0\n";
  char whole[sizeof huge + 32];
  unlink(in_work_folder("part_00000.bin"));
  snprintf(whole, sizeof whole, "%ssum %016" PRIx64 "\n", huge, flesh_archive_sum(0, huge, strlen(huge)));
  CHECK(flesh_mesh_read(write_text("bad.txt", whole), &mesh) == FLESH_ERR_FILE && !mesh);
  CHECK_TEXT(flesh_error_text(), "part 0 of the split mesh of");
}

/* Whichever byte of an index is changed, nothing of the index is used. */
static void every_byte_of_an_index_counts(void)
{
  flesh_split split;
  char *text = NULL;
  size_t size = 0;
  write_parts("parts", 1);
  CHECK_OK(flesh_file_load(in_work_folder("parts/index.txt"), &text, &size));
  for (size_t k = 0; k < size; k++)
    for (int flip = 1; flip < 256; flip *= 6) { /* 1, 6 and 36: other digits, letters and line ends */
      text[k] ^= (char)flip;
      FILE *file = fopen(in_work_folder("parts/changed.txt"), "wb");
      CHECK(file && fwrite(text, 1, size, file) == size && !fclose(file));
      text[k] ^= (char)flip;
      const int status = flesh_split_open(in_work_folder("parts/changed.txt"), &split);
      if (status != FLESH_ERR_FILE) printf("# byte %zu, '%c', changed by %d\n", k, text[k], flip);
      CHECK(status == FLESH_ERR_FILE);
      flesh_split_close(&split);
    }
  CHECK_OK(flesh_split_open(in_work_folder("parts/index.txt"), &split));
  flesh_split_close(&split);
  free(text);
}

/* A mesh with unused nodes; and a folder with a file of somebody else that would be lost. */
static void what_cannot_be_split_is_refused(void)
{
  flesh_mesh *mesh;
  const double X[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 5, 5, 5, 0, 0, 1};
  CHECK_OK(flesh_mesh_create(5, X, 1, (int[]){0, 1, 2, 4}, NULL, &mesh));
  CHECK(flesh_split_mesh(mesh, 1, (int[]){0}, in_work_folder("unused")) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "nodes that no tet uses (1, the first is 3)");
  flesh_mesh_destroy(&mesh);
  mkdir(in_work_folder("mine"), 0700);
  write_text("mine/index.txt", "my own\n");
  mesh = make_box(1);
  int *owners = make_owners(mesh, 0);
  CHECK(flesh_split_mesh(mesh, PARTS, owners, in_work_folder("mine")) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "no index of a split mesh");
  CHECK(!access(in_work_folder("mine/index.txt"), F_OK) && access(in_work_folder("mine/part_00000.bin"), F_OK));
  /* Old parts of a split into more parts are removed. */
  write_parts("parts", 1);
  for (int t = 0; t < mesh->tets; t++) owners[t] = 0;
  CHECK_OK(flesh_split_mesh(mesh, 1, owners, in_work_folder("parts")));
  CHECK(!access(in_work_folder("parts/part_00000.bin"), F_OK) && access(in_work_folder("parts/part_00001.bin"), F_OK));
  free(owners);
  flesh_mesh_destroy(&mesh);
}

int main(int argc, char **argv)
{
  if (!make_work_folder()) return 1;
  RUN_TESTS(argc, argv, TEST(parts_make_the_whole_again), TEST(parts_keep_the_sets), TEST(boxes_in_parts_are_boxes),
            TEST(a_part_knows_two_layers_around), TEST(damage_is_told), TEST(what_contradicts_itself_is_refused),
            TEST(bad_indices_are_refused), TEST(every_byte_of_an_index_counts), TEST(what_cannot_be_split_is_refused));
}
