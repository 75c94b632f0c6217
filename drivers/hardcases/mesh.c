/* mesh.c: makes the meshes of the hard cases. */
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "hardcases/cases.h"

/* Positions, tets and regions from which a mesh is made. */
typedef struct parts {
  flesh_arena memory;
  int nodes, tets;
  double *positions; /* [3*nodes] */
  int *tet_nodes;    /* [4*tets] */
  int *regions;      /* [tets] */
} parts;

static int parts_open(parts *p, int nodes, int tets)
{
  p->positions = flesh_arena_take(&p->memory, (size_t)nodes * 3 * sizeof *p->positions);
  p->tet_nodes = flesh_arena_take(&p->memory, (size_t)tets * 4 * sizeof *p->tet_nodes);
  p->regions = flesh_arena_take(&p->memory, (size_t)tets * sizeof *p->regions);
  return p->positions && p->tet_nodes && p->regions
             ? FLESH_OK
             : flesh_fail(FLESH_ERR_MEMORY, "out of memory for a mesh");
}

/* Copies the arrays of a regular grid, `blocks` times side by side with a gap. */
static int open_blocks(parts *p, const int cells[3], const double size[3], int blocks)
{
  flesh_mesh *box = NULL;
  int status = flesh_mesh_box(cells, size, (double[3]){0}, &box);
  if (status) return status;
  int nodes = flesh_mesh_node_count(box), tets = flesh_mesh_tet_count(box);
  status = parts_open(p, blocks * nodes, blocks * tets);
  for (int b = 0; b < blocks && !status; b++) {
    memcpy(p->positions + 3 * p->nodes, flesh_mesh_positions(box),
           sizeof(double) * 3 * (size_t)nodes);
    for (int i = 0; i < nodes; i++) p->positions[3 * (p->nodes + i)] += b * 1.2 * size[0];
    for (int k = 0; k < 4 * tets; k++)
      p->tet_nodes[4 * p->tets + k] = flesh_mesh_tets(box)[k] + p->nodes;
    p->nodes += nodes, p->tets += tets;
  }
  flesh_mesh_destroy(&box);
  return status;
}

static void colour_cells(parts *p, const int cells[3], int checker)
{
  for (int t = 0; t < p->tets; t++) {
    int cell = t / 6, i = cell % cells[0], j = cell / cells[0] % cells[1],
        k = cell / (cells[0] * cells[1]);
    p->regions[t] = checker ? (i + j + k) % 2 : i >= cells[0] / 2;
  }
}

/* Flattens the first tet of each inner node with odd indices: the node moves towards the opposite face until the height
 * is `part` of what it was. The circumscribed sphere grows as the inscribed one shrinks, so that the radius ratio
 * changes with the square of `part`. The star of the node is convex, so the other tets stay valid, except that the
 * neighbour behind the same flat face of the star also becomes a sliver. */
static void flatten(parts *p, const int cells[3], double part)
{
  for (int k = 1; k < cells[2]; k += 2)
    for (int j = 1; j < cells[1]; j += 2)
      for (int i = 1; i < cells[0]; i += 2) {
        int node = (k * (cells[1] + 1) + j) * (cells[0] + 1) + i, t = 0, corner = 0;
        while (p->tet_nodes[4 * t + corner] != node) corner == 3 ? t++, corner = 0 : corner++;
        for (int c = 0; c < 3; c++) {
          double centre = 0, *x = &p->positions[3 * node + c];
          for (int a = 0; a < 4; a++)
            if (a != corner) centre += p->positions[3 * p->tet_nodes[4 * t + a] + c] / 3;
          *x = centre + part * (*x - centre);
        }
      }
}

/* Adds the six tets of a hexahedron; bits 0, 1 and 2 of a corner's number are its place along the three axes. */
static void split(parts *p, const int corner[8])
{
  static const int orders[6][2] = {{1, 2}, {2, 1}, {1, 4}, {4, 1}, {2, 4}, {4, 2}};
  for (int o = 0; o < 6; o++) {
    int first = orders[o][0], second = first | orders[o][1];
    const int tet[4] = {corner[0], corner[first], corner[second], corner[7]};
    memcpy(p->tet_nodes + 4 * p->tets++, tet, sizeof tet);
  }
}

enum { GRID = 2, LEVELS = 9, SIDE = GRID + 1, SHELL = SIDE * SIDE * SIDE };

/* Makes shells of cells around the corner at the origin, each smaller than the one around it by the same ratio, and a
 * grid of cells in the innermost cube. The outer faces of a shell are x, y or z = its size. */
static int open_graded(parts *p, double size, double smallest)
{
  int numbers[LEVELS][SHELL];
  int status =
      parts_open(p, LEVELS * SHELL, 6 * (3 * GRID * GRID * (LEVELS - 1) + GRID * GRID * GRID));
  for (int level = 0; level < LEVELS && !status; level++)
    for (int n = 0; n < SHELL; n++) {
      const int g[3] = {n % SIDE, n / SIDE % SIDE, n / (SIDE * SIDE)};
      int outer = g[0] == GRID || g[1] == GRID || g[2] == GRID;
      numbers[level][n] = -1;
      if (!outer && level < LEVELS - 1) continue; /* the innermost level is a complete grid */
      for (int c = 0; c < 3; c++)
        p->positions[3 * p->nodes + c] = size * pow(smallest, level / (LEVELS - 1.0)) * g[c] / GRID;
      numbers[level][n] = p->nodes++;
    }
  if (status) return status;
  const int stride[3] = {1, SIDE, SIDE * SIDE};
  for (int level = 0; level + 1 < LEVELS; level++)
    for (int axis = 0; axis < 3; axis++)
      for (int a = 0; a < GRID; a++)
        for (int b = 0; b < GRID; b++) {
          int u = (axis + 1) % 3, v = (axis + 2) % 3, corner[8];
          if (u > v) u = 0, v = axis == 1 ? 2 : 1;
          for (int c = 0; c < 8; c++)
            corner[c] = numbers[level + (c >> 2)][GRID * stride[axis] + (a + (c & 1)) * stride[u] +
                                                  (b + (c >> 1 & 1)) * stride[v]];
          split(p, corner);
        }
  for (int n = 0; n < SHELL; n++) {
    int corner[8];
    if (n % SIDE == GRID || n / SIDE % SIDE == GRID || n / (SIDE * SIDE) == GRID) continue;
    for (int c = 0; c < 8; c++)
      corner[c] = numbers[LEVELS - 1][n + (c & 1) + (c >> 1 & 1) * SIDE + (c >> 2) * SIDE * SIDE];
    split(p, corner);
  }
  return FLESH_OK;
}

/* Joins every triangle on the surface of a grid of `cells` cubed with the middle. */
static int open_fan(parts *p, double size, int cells)
{
  flesh_mesh *box = NULL;
  const int grid[3] = {cells, cells, cells};
  int status = flesh_mesh_box(grid, (double[3]){size, size, size}, (double[3]){0}, &box),
      triangles = 0;
  if (status) return status;
  const int *surface = flesh_mesh_surface(box, &triangles);
  int nodes = flesh_mesh_node_count(box);
  int *number = flesh_arena_take(&p->memory, (size_t)nodes * sizeof *number);
  status = number ? parts_open(p, nodes + 1, triangles) : flesh_no_memory();
  if (!status) {
    p->positions[0] = p->positions[1] = p->positions[2] = 0.5 * size;
    p->nodes = 1;
    for (int k = 0; k < 3 * triangles; k++) {
      if (!number[surface[k]]) {
        memcpy(p->positions + 3 * p->nodes, flesh_mesh_positions(box) + 3 * surface[k],
               3 * sizeof(double));
        number[surface[k]] = p->nodes++;
      }
      p->tet_nodes[4 * (k / 3) + k % 3] = number[surface[k]];
    }
    p->tets = triangles; /* their fourth nodes stay 0, the middle */
  }
  flesh_mesh_destroy(&box);
  return status;
}

static int open_single(parts *p, double edge)
{
  static const double corners[4][3] = {
      {0, 0, 0}, {1, 1, 0}, {1, 0, 1}, {0, 1, 1}}; /* corners of a cube: a regular tet */
  int status = parts_open(p, 4, 1);
  if (status) return status;
  p->nodes = 4, p->tets = 1;
  for (int a = 0; a < 4; a++) {
    p->tet_nodes[a] = a;
    for (int c = 0; c < 3; c++) p->positions[3 * a + c] = edge * sqrt(0.5) * corners[a][c];
  }
  return FLESH_OK;
}

int flesh_hardcases_make_mesh(const flesh_hardcases_case *hardcase, int quick, flesh_mesh **mesh)
{
  /* Cells of the meshes that begin as grids; those with --quick. */
  static const int grids[][2][3] = {[FLESH_HARDCASES_BLOCK] = {{8, 4, 4}, {6, 3, 3}},
                                    [FLESH_HARDCASES_FINE] = {{24, 3, 3}, {20, 3, 3}},
                                    [FLESH_HARDCASES_CHECKER] = {{8, 4, 4}, {6, 3, 3}},
                                    [FLESH_HARDCASES_HALVES] = {{8, 4, 4}, {6, 3, 3}},
                                    [FLESH_HARDCASES_SLIVERS] = {{8, 4, 4}, {6, 4, 4}},
                                    [FLESH_HARDCASES_TWO_BODIES] = {{4, 4, 4}, {3, 3, 3}},
                                    [FLESH_HARDCASES_BAR] = {{24, 6, 6}, {12, 4, 4}},
                                    [FLESH_HARDCASES_LARGE] = {{32, 16, 16}, {12, 6, 6}}};
  static const double block[] = {0.2, 0.1, 0.1}, half[] = {0.09, 0.1, 0.1}, bar[] = {1, 13. / 48, 13. / 48};
  const flesh_hardcases_mesh kind = hardcase->mesh;
  const int *cells = grids[kind][quick != 0], two = kind == FLESH_HARDCASES_TWO_BODIES;
  parts p = {0};
  int status;
  *mesh = NULL;
  switch (kind) {
  case FLESH_HARDCASES_GRADED:
    status = open_graded(&p, 0.1, 1e-4);
    break;
  case FLESH_HARDCASES_FAN:
    status = open_fan(&p, 0.1, quick ? 5 : 8);
    break;
  case FLESH_HARDCASES_SINGLE:
    status = open_single(&p, 0.1);
    break;
  case FLESH_HARDCASES_CHECKER:
  case FLESH_HARDCASES_HALVES:
  case FLESH_HARDCASES_SLIVERS:
  case FLESH_HARDCASES_TWO_BODIES:
    status = open_blocks(&p, cells, two ? half : block, 1 + two);
    if (!status && kind == FLESH_HARDCASES_SLIVERS) flatten(&p, cells, 0.005);
    else if (!status && !two) colour_cells(&p, cells, kind == FLESH_HARDCASES_CHECKER);
    break;
  default:
    return flesh_mesh_box(cells, kind == FLESH_HARDCASES_BAR ? bar : block, (double[3]){0}, mesh);
  }
  if (!status) status = flesh_mesh_create(p.nodes, p.positions, p.tets, p.tet_nodes, p.regions, mesh);
  flesh_arena_free(&p.memory);
  return status;
}
