// TEST quick seconds=60
/* test_tet_order.c: the order in which tets are processed: each once, without conflicts within a colour. */
#include <stdlib.h>

#include "element/tet_order.h"
#include "flesh/mesh.h"
#include "test.h"

static void check_order(const int cells[3], int fewest_pieces)
{
  flesh_mesh *mesh;
  flesh_tet_order order;
  CHECK_OK(flesh_mesh_box(cells, (double[]){1, 2, 3}, (double[]){0, 0, 0}, &mesh));
  CHECK_OK(flesh_tet_order_create(mesh, flesh_mesh_tet_count(mesh), NULL, NULL, &order));
  int tets = flesh_mesh_tet_count(mesh), nodes = flesh_mesh_node_count(mesh);
  int *owner = malloc((size_t)nodes * sizeof *owner), conflicts = 0, twice = 0;
  char *seen = calloc((size_t)tets, 1);
  CHECK(order.pieces > fewest_pieces && order.colours > 1 && order.colours < 30 * (1 + order.pieces / 256));
  CHECK(order.colour_first[order.colours] == order.pieces);
  CHECK(order.piece_first[order.pieces] == tets);
  for (int c = 0; c < order.colours; c++) {
    CHECK(order.colour_first[c] < order.colour_first[c + 1]);
    for (int i = 0; i < nodes; i++) owner[i] = -1;
    for (int p = order.colour_first[c]; p < order.colour_first[c + 1]; p++)
      for (int k = order.piece_first[p]; k < order.piece_first[p + 1]; k++) {
        twice += seen[order.tet[k]]++;
        for (int a = 0; a < 4; a++) {
          int *own = &owner[flesh_mesh_tets(mesh)[4 * order.tet[k] + a]];
          conflicts += *own >= 0 && *own != p;
          *own = p;
        }
      }
  }
  CHECK(conflicts == 0 && twice == 0);
  free(owner);
  free(seen);
  flesh_tet_order_clear(&order);
  flesh_mesh_destroy(&mesh);
}

/* In one region, and in several. */
static void pieces_of_a_round_share_no_node(void)
{
  check_order((int[]){13, 12, 11}, 20);
  check_order((int[]){30, 30, 25}, 300);
}

int main(int argc, char **argv) { return RUN_TESTS(argc, argv, TEST(pieces_of_a_round_share_no_node)); }
