// TEST name=vtu quick by=shared/check_vtu.py protocol=exitcode
/* test_io_vtu.c: writes the sample that check_vtu.py reads with VTK (`--write DIR`). */
#include <limits.h>
#include <stdio.h>
#include <string.h>

#include "flesh/status.h"
#include "output/vtu.h"

int main(int argc, char **argv)
{
  if (argc != 3 || strcmp(argv[1], "--write")) return 2;
  double positions[15] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1}, velocity[15];
  int mark[5], tets[8] = {0, 1, 2, 3, 1, 2, 3, 4}, region[2] = {7, INT_MIN};
  double J[2] = {0.5, 1.0 / 3};
  for (int i = 0; i < 15; i++) positions[i] /= 3;
  for (int i = 0; i < 5; i++) {
    velocity[3 * i] = i + 0.1, velocity[3 * i + 1] = i * 0.1, velocity[3 * i + 2] = -i / 7.0;
    mark[i] = -i;
  }
  static const char *const names[] = {"<x>", "y"};
  const flesh_vtu_array point_arrays[] = {
      {.name = "velocity", .components = 3, .doubles = velocity, .unit = "m/s & more"},
      {.name = "mark", .components = 1, .integers = mark}};
  const flesh_vtu_array cell_arrays[] = {{.name = "J & more", .components = 1, .doubles = J},
                                         {.name = "region", .components = 1, .integers = region}};
  const flesh_vtu_array grouped[] = {
      {.name = "named", .components = 4, .doubles = positions, .component_names = names, .groups = 2},
      {.name = "numbered", .components = 3, .doubles = positions, .groups = 3}};
  const flesh_vtu content = {.points = 5,
                             .tets = 2,
                             .positions = positions,
                             .tet_nodes = tets,
                             .point_array_count = 2,
                             .cell_array_count = 2,
                             .point_arrays = point_arrays,
                             .cell_arrays = cell_arrays};
  char path[1024];
  snprintf(path, sizeof path, "%s/sample.vtu", argv[2]);
  int status = flesh_vtu_write(path, &content);
  /* A triangle and a square as polygons. */
  const int starts[] = {0, 3, 7}, corners[] = {0, 1, 4, 0, 2, 4, 3};
  const flesh_vtu polygons = {.points = 5,
                              .positions = positions,
                              .polygons = 2,
                              .starts = starts,
                              .corners = corners,
                              .point_array_count = 2,
                              .cell_array_count = 2,
                              .point_arrays = point_arrays,
                              .cell_arrays = cell_arrays};
  snprintf(path, sizeof path, "%s/polygons.vtu", argv[2]);
  if (!status) status = flesh_vtu_write(path, &polygons);
  /* A ten-node tet: the sample's first four corners, its mid-edge nodes numbered from the last node. */
  static const int edge_nodes[6] = {9, 8, 7, 6, 5, 4}, ends[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
  double ten[30];
  memcpy(ten, positions, 12 * sizeof *ten);
  for (int k = 0; k < 6; k++)
    for (int d = 0; d < 3; d++)
      ten[3 * edge_nodes[k] + d] = (ten[3 * ends[k][0] + d] + ten[3 * ends[k][1] + d]) / 2 + (k + 1) * (d + 1) / 256.;
  const flesh_vtu quadratic = {.points = 10,
                               .tets = 1,
                               .positions = ten,
                               .tet_nodes = tets,
                               .edge_nodes = edge_nodes,
                               .cell_array_count = 2,
                               .cell_arrays = grouped};
  snprintf(path, sizeof path, "%s/quadratic.vtu", argv[2]);
  if (!status) status = flesh_vtu_write(path, &quadratic);
  const char *files[] = {"sample.vtu", "sample.vtu"};
  const double times[] = {0, 1.0 / 3};
  snprintf(path, sizeof path, "%s/sample.pvd", argv[2]);
  if (!status) status = flesh_pvd_write(path, 2, times, files);
  if (status) fprintf(stderr, "%s\n", flesh_error_text());
  return status != 0;
}
