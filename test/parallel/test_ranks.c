// TEST quick needs=ranks ranks=1,2,3,5
/* test_ranks.c: reductions and messages between ranks, and the parts of a body. */
#include "ranks.h"

#include "base/error.h"

static int rank(void) { return flesh_communicator_rank(ranks); }
static int size(void) { return flesh_communicator_size(ranks); }

/* More numbers than fit in one reduction. */
enum { NUMBERS = 2500 };

static void sums_are_of_all_ranks(void)
{
  double numbers[NUMBERS], largest[2] = {rank() == size() / 2 ? 7 : -rank(), rank()};
  for (int k = 0; k < NUMBERS; k++) numbers[k] = k + rank();
  flesh_communicator_sum(ranks, NUMBERS, numbers);
  for (int k = 0; k < NUMBERS; k += 311) CHECK_NEAR(numbers[k], k * size() + size() * (size() - 1) / 2., 0);
  flesh_communicator_largest(ranks, 2, largest);
  CHECK_NEAR(largest[0], 7, 0);
  CHECK_NEAR(largest[1], size() - 1, 0);
  double none = rank() == size() - 1 ? NAN : 1;
  flesh_communicator_largest(ranks, 1, &none);
  CHECK(isnan(none));
}

/* Numbers whose sum depends on the order: the bits are the same on all ranks, and when repeated. */
static void sums_have_the_same_bits_everywhere(void)
{
  unsigned long long seed = 17 + (unsigned long long)rank();
  double bits[2] = {0};
  for (int k = 0; k < 100; k++) {
    const double mine = (test_uniform(&seed) - 0.5) * pow(10, 20 * test_uniform(&seed));
    double sum = mine, again = mine;
    flesh_communicator_sum(ranks, 1, &sum);
    flesh_communicator_sum(ranks, 1, &again);
    CHECK(memcmp(&sum, &again, sizeof sum) == 0);
    bits[0] = sum;
    bits[1] = -sum;
    flesh_communicator_largest(ranks, 2, bits);
    CHECK(bits[0] == sum && bits[1] == -sum);
  }
}

static void the_worst_status_wins(void)
{
  const int last = size() - 1;
  CHECK(flesh_communicator_agree(ranks, FLESH_OK) == FLESH_OK);
  CHECK(flesh_communicator_agree(ranks, rank() == last ? FLESH_UNDEFINED : FLESH_OK) == FLESH_UNDEFINED);
  int status = rank() == 0 ? FLESH_NOT_CONVERGED : FLESH_OK;
  if (rank() == last) status = flesh_fail(FLESH_ERR_FILE, "rank %d cannot read", last);
  CHECK(flesh_communicator_agree(ranks, status) == FLESH_ERR_FILE);
  char sentence[64];
  snprintf(sentence, sizeof sentence, "rank %d cannot read", last);
  CHECK(strcmp(flesh_error_text(), sentence) == 0);
  /* If several ranks fail with the same status, the first one's message counts. */
  flesh_fail(FLESH_ERR_SOLVE, "rank %d", rank());
  CHECK(flesh_communicator_agree(ranks, FLESH_ERR_SOLVE) == FLESH_ERR_SOLVE);
  CHECK(strcmp(flesh_error_text(), "rank 0") == 0);
}

static flesh_mesh *make_bar(int order)
{
  flesh_mesh *mesh = NULL, *raised = NULL;
  CHECK_OK(flesh_mesh_box((const int[]){7, 3, 2}, (const double[]){0.7, 0.3, 0.2}, (const double[]){0, 0, 0}, &mesh));
  if (order == 1) return mesh;
  CHECK_OK(flesh_mesh_raise_order(mesh, &raised));
  flesh_mesh_destroy(&mesh);
  return raised;
}

/* Every tet and, by its owner, every node of the whole is counted once; positions are those of the whole. */
static void check_part(const flesh_mesh *whole, flesh_rank_part *part)
{
  const flesh_mesh *mesh = flesh_rank_part_mesh(part);
  const flesh_team *team = flesh_rank_part_team(part);
  const int *nodes = flesh_rank_part_nodes(part), *tets = flesh_rank_part_tets(part);
  double counts[4] = {flesh_mesh_tet_count(mesh), team->own, flesh_mesh_volume(mesh, flesh_mesh_positions(mesh)), 0};
  for (int t = 0; t < flesh_mesh_tet_count(mesh); t++)
    for (int a = 0; a < 4; a++)
      counts[3] += nodes[flesh_mesh_tets(mesh)[4 * t + a]] != flesh_mesh_tets(whole)[4 * tets[t] + a];
  flesh_communicator_sum(ranks, 4, counts);
  CHECK_NEAR(counts[0], flesh_mesh_tet_count(whole), 0);
  CHECK_NEAR(counts[1], flesh_mesh_node_count(whole), 0);
  CHECK_NEAR(counts[2], flesh_mesh_volume(whole, flesh_mesh_positions(whole)), 1e-14);
  CHECK_NEAR(counts[3], 0, 0);
  CHECK_NEAR(team->all, flesh_mesh_node_count(whole), 0);
  CHECK(team->nodes == flesh_mesh_node_count(mesh));
  for (int i = 0; i < team->nodes; i++) {
    CHECK(flesh_rank_part_find(part, nodes[i]) == i);
    CHECK(memcmp(flesh_mesh_positions(mesh) + 3 * i, flesh_mesh_positions(whole) + 3 * nodes[i], 3 * sizeof(double)) == 0);
  }
}

/* Ghosts get their owners' values; owners get the sums of their ghosts'. */
static void check_halo(const flesh_mesh *whole, flesh_rank_part *part)
{
  const flesh_team *team = flesh_rank_part_team(part);
  const int *nodes = flesh_rank_part_nodes(part), all = flesh_mesh_node_count(whole);
  double *vector = calloc((size_t)team->nodes, 3 * sizeof *vector), *gathered = calloc((size_t)all, 3 * sizeof *gathered),
         *times = calloc((size_t)all, sizeof *times);
  for (int d = 0; d < 3 * team->own; d++) vector[d] = 3 * nodes[d / 3] + d % 3;
  for (int d = 3 * team->own; d < 3 * team->nodes; d++) vector[d] = NAN;
  flesh_team_update_ghosts(team, vector);
  for (int d = 0; d < 3 * team->nodes; d++) CHECK_NEAR(vector[d], 3 * nodes[d / 3] + d % 3, 0);
  for (int i = 0; i < team->nodes; i++) times[nodes[i]] = 1;
  flesh_communicator_sum(ranks, all, times); /* number of ranks that have it */
  flesh_team_add_ghosts(team, vector);
  for (int d = 0; d < 3 * team->nodes; d++)
    CHECK_NEAR(vector[d], d < 3 * team->own ? times[nodes[d / 3]] * (3 * nodes[d / 3] + d % 3) : 0, 0);
  flesh_rank_part_gather(part, vector, gathered);
  for (int d = 0; d < 3 * all; d++) CHECK_NEAR(gathered[d], times[d / 3] * d, 0);
  free(vector);
  free(gathered);
  free(times);
}

static void every_tet_and_node_is_counted_once(void)
{
  for (int order = 1; order <= 2; order++) {
    flesh_mesh *whole = make_bar(order);
    flesh_rank_part *part = ranks_cut(whole);
    check_part(whole, part);
    check_halo(whole, part);
    CHECK((flesh_rank_part_neighbours(part) > 0) == (size() > 1));
    flesh_rank_part_destroy(&part);
    flesh_mesh_destroy(&whole);
  }
}

/* Tets distributed in turn: nearly every node belongs to nearly every rank. */
static void scattered_parts_serve(void)
{
  flesh_mesh *whole = make_bar(1);
  flesh_rank_part *part = NULL;
  int *of_tets = calloc((size_t)flesh_mesh_tet_count(whole), sizeof *of_tets);
  for (int t = 0; t < flesh_mesh_tet_count(whole); t++) of_tets[t] = t % size();
  CHECK_OK(flesh_rank_part_create(ranks, whole, of_tets, &part));
  check_part(whole, part);
  check_halo(whole, part);
  flesh_rank_part_destroy(&part);
  free(of_tets);
  flesh_mesh_destroy(&whole);
}

/* Few tets: no rank is without one, and too many ranks are refused. A rank without a tet fails on all. */
static void no_rank_is_empty(void)
{
  flesh_mesh *cube = NULL;
  flesh_rank_part *part = NULL;
  int of_tets[6];
  CHECK_OK(flesh_mesh_box((const int[]){1, 1, 1}, (const double[]){1, 1, 1}, (const double[]){0, 0, 0}, &cube));
  for (int parts = 1; parts <= 6; parts++) {
    int seen = 0;
    CHECK_OK(flesh_partition_tets(cube, parts, of_tets));
    for (int t = 0; t < 6; t++) seen |= 1 << of_tets[t];
    CHECK(seen == (1 << parts) - 1);
  }
  CHECK(flesh_partition_tets(cube, 7, of_tets) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "1 to 6 ranks");
  memset(of_tets, 0, sizeof of_tets);
  const int status = flesh_rank_part_create(ranks, cube, of_tets, &part);
  CHECK(status == (size() == 1 ? FLESH_OK : FLESH_ERR_ARGUMENT));
  if (size() > 1) CHECK_TEXT(flesh_error_text(), "rank 1 has no tet");
  CHECK((part != NULL) == (size() == 1));
  flesh_rank_part_destroy(&part);
  flesh_mesh_destroy(&cube);
}

int main(int argc, char **argv)
{
  return RUN_TESTS_ON_RANKS(argc, argv, TEST(sums_are_of_all_ranks), TEST(sums_have_the_same_bits_everywhere),
                            TEST(the_worst_status_wins), TEST(every_tet_and_node_is_counted_once),
                            TEST(scattered_parts_serve), TEST(no_rank_is_empty));
}
