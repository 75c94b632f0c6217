// TEST quick
/* test_partition.c: the distribution of tets: equally many in each part, with flat cuts, and those of METIS if planes
 * would cut far more. */
#include "test.h"

#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "flesh/mesh.h"
#include "parallel/partition.h"
#include "parallel/partition_kinds.h"

typedef struct parted {
  flesh_mesh *mesh;
  int *part; /* [tets] */
} parted;

static void take(flesh_mesh *mesh, parted *p)
{
  p->mesh = mesh;
  p->part = malloc((size_t)flesh_mesh_tet_count(mesh) * sizeof *p->part);
}

static void take_box(int x, int y, int z, parted *p)
{
  flesh_mesh *mesh = NULL;
  CHECK_OK(flesh_mesh_box((const int[]){x, y, z}, (const double[]){x, y, z}, (const double[]){0, 0, 0}, &mesh));
  take(mesh, p);
}

static void drop(parted *p)
{
  flesh_mesh_destroy(&p->mesh);
  free(p->part);
}

/* Returns the difference between the most and the least tets of a part. */
static int unevenness(const parted *p, int parts)
{
  int counts[64] = {0}, least = 1 << 30, most = 0;
  for (int t = 0; t < flesh_mesh_tet_count(p->mesh); t++) counts[p->part[t]]++;
  for (int k = 0; k < parts; k++) {
    if (counts[k] < least) least = counts[k];
    if (counts[k] > most) most = counts[k];
  }
  return most - least;
}

/* Counts the nodes shared by two parts; `place` [3] gets their extent along each axis. */
static int nodes_between(const parted *p, double place[3])
{
  const int nodes = flesh_mesh_node_count(p->mesh), *tets = flesh_mesh_tets(p->mesh);
  const double *x = flesh_mesh_positions(p->mesh);
  int *of = malloc((size_t)nodes * sizeof *of), found = 0;
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (int i = 0; i < nodes; i++) of[i] = -1;
  for (int t = 0; t < flesh_mesh_tet_count(p->mesh); t++)
    for (int c = 0; c < 4; c++) {
      const int i = tets[4 * t + c];
      if (of[i] < 0) of[i] = p->part[t];
      if (of[i] == p->part[t] || of[i] == 64) continue;
      of[i] = 64;
      found++;
      for (int axis = 0; axis < 3; axis++) {
        low[axis] = fmin(low[axis], x[3 * i + axis]);
        high[axis] = fmax(high[axis], x[3 * i + axis]);
      }
    }
  for (int axis = 0; axis < 3; axis++) place[axis] = high[axis] - low[axis];
  free(of);
  return found;
}

static void boxes_are_cut_across_their_length(void)
{
  const int cells[3][3] = {{8, 3, 2}, {3, 8, 2}, {2, 3, 8}};
  for (int axis = 0; axis < 3; axis++) {
    parted p;
    double place[3];
    take_box(cells[axis][0], cells[axis][1], cells[axis][2], &p);
    CHECK_OK(flesh_partition_tets(p.mesh, 2, p.part));
    CHECK(nodes_between(&p, place) == 12);
    CHECK_NEAR(place[axis], 0, 0);
    CHECK_OK(flesh_partition_tets(p.mesh, 4, p.part));
    CHECK(nodes_between(&p, place) == 36);
    CHECK(unevenness(&p, 4) == 0);
    drop(&p);
  }
}

static void parts_are_even(void)
{
  parted p;
  flesh_mesh *mesh = NULL;
  CHECK_OK(flesh_mesh_read("../data/meshes/limb.msh", &mesh));
  take(mesh, &p);
  for (int parts = 2; parts <= 64; parts += parts / 2) {
    CHECK_OK(flesh_partition_planes(p.mesh, parts, p.part));
    CHECK(unevenness(&p, parts) <= 7);
    CHECK_OK(flesh_partition_tets(p.mesh, parts, p.part));
    CHECK(unevenness(&p, parts) <= 7 + flesh_mesh_tet_count(mesh) * 6 / 100 / parts);
  }
  drop(&p);
}

/* A knot, which any plane cuts several times. */
static void bent_bodies_are_parted_by_metis(void)
{
  parted planes, p;
  double place[3];
  int made;
  flesh_mesh *mesh = NULL;
  CHECK_OK(flesh_mesh_read("../data/meshes/torus_knot.msh", &mesh));
  take(mesh, &p);
  planes = p;
  CHECK_OK(flesh_partition_metis(p.mesh, 2, p.part, &made));
  CHECK_OK(flesh_partition_planes(p.mesh, 2, p.part));
  const int by_planes = nodes_between(&planes, place);
  CHECK_OK(flesh_partition_tets(p.mesh, 2, p.part));
  const int found = nodes_between(&p, place);
  printf("# %d nodes between the parts, by planes %d\n", found, by_planes);
  if (made) CHECK(3 * found < 2 * by_planes);
  else CHECK(found == by_planes);
  drop(&p);
}

/* Tets that are all at one position along an axis are divided by their numbers. */
static void tets_of_one_place_are_parted(void)
{
  parted p;
  take_box(1, 1, 1, &p);
  for (int parts = 2; parts <= 6; parts++) {
    CHECK_OK(flesh_partition_planes(p.mesh, parts, p.part));
    CHECK(unevenness(&p, parts) <= 1);
  }
  drop(&p);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(boxes_are_cut_across_their_length), TEST(parts_are_even),
                   TEST(bent_bodies_are_parted_by_metis), TEST(tets_of_one_place_are_parted));
}
