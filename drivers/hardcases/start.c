/* start.c: makes the start states of the hard cases. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "hardcases/cases.h"
#include "mesh/pieces.h"

static double uniform(uint64_t *state) /* splitmix64 (Steele, Lea & Flood 2014); [-1, 1) */
{
  uint64_t z = *state += 0x9e3779b97f4a7c15u;
  z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
  z = (z ^ z >> 27) * 0x94d049bb133111ebu;
  return (double)(int64_t)(z ^ z >> 31) * 0x1p-63;
}

/* Computes the mean rest length of the edges at each node, into edge [nodes]. */
static int mean_edges(const flesh_mesh *mesh, double *edge)
{
  int nodes = flesh_mesh_node_count(mesh);
  const double *X = flesh_mesh_positions(mesh);
  int *count = calloc((size_t)nodes, sizeof *count);
  if (!count) return flesh_no_memory();
  for (int i = 0; i < nodes; i++) edge[i] = 0;
  for (int t = 0; t < flesh_mesh_piece_count(mesh); t++) {
    int tet[4];
    flesh_mesh_piece(mesh, t, tet);
    for (int a = 0; a < 4; a++)
      for (int b = 0; b < 4; b++) {
        const double *p = X + 3 * tet[a], *q = X + 3 * tet[b];
        if (a == b) continue;
        edge[tet[a]] += sqrt(pow(p[0] - q[0], 2) + pow(p[1] - q[1], 2) + pow(p[2] - q[2], 2));
        count[tet[a]]++;
      }
  }
  for (int i = 0; i < nodes; i++) edge[i] /= count[i] ? count[i] : 1;
  free(count);
  return FLESH_OK;
}

/* Moves a node through the opposite face of one of its tets, but only so far that no other tet is inverted. */
static void invert_one(const flesh_mesh *mesh, double *x)
{
  static const double factors[] = {2, 1.5, 1.2, 1.05};
  for (int f = 0; f < 4; f++)
    for (int t = 0; t < flesh_mesh_piece_count(mesh); t++)
      for (int corner = 0; corner < 4; corner++) {
        int tet[4], inverted;
        flesh_mesh_piece(mesh, t, tet);
        double kept[3], *moved = x + 3 * tet[corner];
        memcpy(kept, moved, sizeof kept);
        for (int c = 0; c < 3; c++) {
          double centre = 0;
          for (int a = 0; a < 4; a++)
            if (a != corner) centre += x[3 * tet[a] + c] / 3;
          moved[c] += factors[f] * (centre - moved[c]);
        }
        flesh_mesh_jacobian_bounds(mesh, x, NULL, NULL, &inverted);
        if (inverted == 1) return;
        memcpy(moved, kept, sizeof kept);
      }
}

/* Rotates y, z about the middle. */
static void turn(double *x, const double middle[3], double angle)
{
  double y = x[1] - middle[1], z = x[2] - middle[2];
  x[1] = middle[1] + cos(angle) * y - sin(angle) * z;
  x[2] = middle[2] + sin(angle) * y + cos(angle) * z;
}

/* Sizes on which the start of a node depends. */
typedef struct body {
  flesh_mesh_info info;
  double middle[3], length; /* centre of the bounding box, and its length along x; m */
  double step;              /* s */
} body;

/* Moves a node for a random start: u is uniform in [-1, 1)^3, or normal for FLESH_HARDCASES_GAUSS; `edge` is the mean
 * length of the node's edges. */
static void disturb_node(const flesh_hardcases_case *hardcase, const body *b, const double *X, double edge, const double u[3],
                         double *x)
{
  const double amount = hardcase->amount;
  for (int c = 0; c < 3; c++) {
    const double size = b->info.high[c] - b->info.low[c], noise = amount * b->length * u[c];
    switch (hardcase->start) {
    case FLESH_HARDCASES_SCRAMBLE_ONE:
      if (X[0] > 0.1) x[c] = c ? b->middle[c] + 0.5 * u[c] * size : 0.15 + 0.05 * u[c];
      break;
    case FLESH_HARDCASES_SCRAMBLE: x[c] = b->middle[c] + 0.5 * u[c] * size; break;
    case FLESH_HARDCASES_JITTER: x[c] += amount * edge * u[c]; break;
    case FLESH_HARDCASES_PLANE: if (c == 2) x[c] = b->middle[c] + noise; break;
    case FLESH_HARDCASES_LINE: if (c > 0) x[c] = b->middle[c] + noise; break;
    case FLESH_HARDCASES_POINT: x[c] = b->middle[c] + noise; break;
    case FLESH_HARDCASES_GAUSS: x[c] += noise; break;
    default: break;
    }
  }
}

/* Computes position x and velocity v of a node with rest position X, for the other starts. */
static void start_node(const flesh_hardcases_case *hardcase, const body *b, const double *X, double *x, double *v)
{
  const double pi = acos(-1), amount = hardcase->amount;
  switch (hardcase->start) {
  case FLESH_HARDCASES_MIRROR: x[0] = 2 * b->middle[0] - x[0]; break;
  case FLESH_HARDCASES_SCALE_X: x[0] *= amount; break;
  case FLESH_HARDCASES_SCALE_ALL:
    for (int c = 0; c < 3; c++)
      x[c] = b->middle[c] * (c > 0) + amount * (x[c] - b->middle[c] * (c > 0));
    break;
  case FLESH_HARDCASES_TWIST: turn(x, b->middle, 2 * pi * amount * x[0] / b->length); break;
  case FLESH_HARDCASES_SHEAR: x[2] += amount * x[0]; break;
  case FLESH_HARDCASES_STRETCH_TWIST:
    turn(x, b->middle, pi * x[0] / b->length);
    x[0] *= amount;
    break;
  case FLESH_HARDCASES_SPIN:
    v[0] = -2 * pi * amount / b->step * (x[1] - b->middle[1]);
    v[1] = 2 * pi * amount / b->step * (x[0] - b->middle[0]);
    break;
  case FLESH_HARDCASES_SPEED: v[0] = amount; break;
  case FLESH_HARDCASES_HALF_TURN: if (X[0] > b->middle[0]) turn(x, b->middle, pi); break;
  case FLESH_HARDCASES_INSIDE_OUT: for (int c = 0; c < 3; c++) x[c] = 2 * b->middle[c] - x[c]; break;
  case FLESH_HARDCASES_FLY:
    x[0] -= amount;
    v[0] = 100;
    break;
  default: break; /* at rest, or random */
  }
}

/* Turns two uniform numbers a, b in [-1, 1) into normal ones (Box & Muller 1958). */
static void make_normal(double *a, double *b)
{
  const double radius = sqrt(-2 * log(0.5 * (1 - *a))), angle = acos(-1) * *b;
  *a = radius * cos(angle);
  *b = radius * sin(angle);
}

/* Moves random nodes, each in its own random direction. */
static void throw_nodes(int nodes, double distance, uint64_t *random, double *x)
{
  const int count = nodes / 100 > 3 ? nodes / 100 : 3;
  for (int k = 0; k < count; k++) {
    double u[3], length = 0;
    const int i = (int)fmin(nodes - 1, floor(0.5 * (uniform(random) + 1) * nodes));
    while (!(length > 0.1 && length < 1)) {
      length = 0;
      for (int c = 0; c < 3; c++) u[c] = uniform(random), length += u[c] * u[c];
    }
    for (int c = 0; c < 3; c++) x[3 * i + c] += distance * u[c] / sqrt(length);
  }
}

int flesh_hardcases_make_start(const flesh_hardcases_case *hardcase, const flesh_mesh *mesh, int seed,
                               double step, flesh_state *state)
{
  int nodes = flesh_mesh_node_count(mesh);
  const double *X = flesh_mesh_positions(mesh);
  double *edge = malloc(sizeof *edge * (size_t)nodes);
  body b = {.step = step};
  if (!edge) return flesh_no_memory();
  int status = mean_edges(mesh, edge);
  flesh_mesh_inspect(mesh, &b.info);
  for (int c = 0; c < 3; c++) b.middle[c] = 0.5 * (b.info.low[c] + b.info.high[c]);
  b.length = b.info.high[0] - b.info.low[0];
  uint64_t random = (uint64_t)seed * 0x632be59bd9b4e019u;
  state->t = 0;
  memcpy(state->x, X, sizeof(double) * 3 * (size_t)nodes);
  memset(state->v, 0, sizeof(double) * 3 * (size_t)nodes);
  for (int i = 0; i < nodes && !status; i++) {
    double u[3];
    for (int c = 0; c < 3; c++) u[c] = uniform(&random);
    if (hardcase->start == FLESH_HARDCASES_GAUSS) {
      double spare = uniform(&random);
      make_normal(&u[0], &u[1]);
      make_normal(&u[2], &spare);
    }
    disturb_node(hardcase, &b, X + 3 * i, edge[i], u, state->x + 3 * i);
    start_node(hardcase, &b, X + 3 * i, state->x + 3 * i, state->v + 3 * i);
    for (int c = 0; c < 3; c++) state->x[3 * i + c] += hardcase->noise * edge[i] * u[c];
  }
  if (!status && hardcase->start == FLESH_HARDCASES_INVERT_ONE) invert_one(mesh, state->x);
  if (!status && hardcase->start == FLESH_HARDCASES_THROW) throw_nodes(nodes, hardcase->amount * b.length, &random, state->x);
  free(edge);
  return status;
}
