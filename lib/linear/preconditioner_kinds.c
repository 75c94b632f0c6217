/* preconditioner_kinds.c: names of preconditioners, and the choice of AUTO. */
#include <assert.h>
#include <math.h>
#include <stddef.h>

#include "linear/preconditioner.h"

/* Number of nodes from which on there is a coarse level, for four-node tets and for ten-node ones. */
enum { FEWEST_NODES = 600, FEWEST_QUADRATIC = 400 };

const char *const flesh_preconditioner_names[] = {"auto", "two-level", "ic", "jacobi", "none", "volume-projection", NULL};
/* Stiffness ratios of rows from which on they are projected out: those of nu = 0.489 and 0.493. An equilibrium takes as
 * much work with as without the projection at 0.475 to 0.493, the larger mesh and load are, a step in motion at about
 * 0.495 (README.md). */
static const double STIFF = 6, STIFF_IN_MOTION = 10;
/* Share of the stiffness of the rest, without the rows, from which on inertia counts as motion. */
static const double HEAVY = 1e-3;

/* Numbers of rows, and of rows per unit of the stiffness ratio, from which on polynomials take less time than an exact
 * factor: 11 000 rows at nu = 0.499, 120 000 at 0.4999. */
enum { MANY_ROWS = 12000, ROWS_OF_RATIO = 170 };

/* Nodes per vertex of the coarse level. Fewer give fewer iterations, but the cost of the coarse factor rises faster than
 * the number of vertices: from MANY_NODES on the nodes per vertex rise with the square root of the nodes. Where rows are
 * long, as with ten-node tets, all else costs more: they rise from MORE_NODES on, and small bodies have SMALL sqrt(nodes)
 * vertices, but no fewer than FEWEST nodes for each, without which slender ones do not bend. */
enum { VERTEX_NODES = 50, MANY_NODES = 36000, MORE_NODES = 144000, LONG = 9, FEWEST = 8 };
static const double SMALL = 3.3;
/* Size of the level that all ranks share, and all of them factor. With SAME nodes^POWER vertices, for the nodes of one
 * rank, that takes as long as everything else that the rank does in a Newton iteration; with TENFOLD, ten times as long.
 * FEW vertices, whose factor takes a tenth of a second, may take up to that (data/results/scaling.md). */
static const double SAME = 42, TENFOLD = 95, POWER = 0.36;
enum { FEW = 1600 };

static_assert(sizeof flesh_preconditioner_names / sizeof *flesh_preconditioner_names ==
                  FLESH_PRECONDITIONER_VOLUME_PROJECTION + 2,
              "a name of every preconditioner");

const char *flesh_preconditioner_name(flesh_preconditioner kind)
{
  return (unsigned)kind <= FLESH_PRECONDITIONER_VOLUME_PROJECTION ? flesh_preconditioner_names[kind] : NULL;
}

flesh_preconditioner flesh_preconditioner_choose(flesh_preconditioner kind, double nodes, int order)
{
  if (kind != FLESH_PRECONDITIONER_AUTO && kind != FLESH_PRECONDITIONER_VOLUME_PROJECTION) return kind;
  return nodes >= (order == 2 ? FEWEST_QUADRATIC : FEWEST_NODES) ? FLESH_PRECONDITIONER_TWO_LEVEL : FLESH_PRECONDITIONER_IC;
}

int flesh_preconditioner_projects(flesh_preconditioner kind, const flesh_stiff_rows *rows, double inertia)
{
  if (!rows->count && !rows->nodes_per_row) return 0; /* on no rank */
  const double stiff = inertia >= HEAVY * rows->modulus && inertia > 0 ? STIFF_IN_MOTION : STIFF;
  return kind == FLESH_PRECONDITIONER_VOLUME_PROJECTION || (kind == FLESH_PRECONDITIONER_AUTO && rows->ratio >= stiff);
}

int flesh_preconditioner_takes_polynomials(const flesh_stiff_rows *rows)
{
  return rows->count >= MANY_ROWS && rows->count >= ROWS_OF_RATIO * rows->ratio;
}

flesh_levels flesh_levels_for(double nodes, double blocks, int ranks)
{
  const int is_long = blocks >= LONG * (nodes + 1), many = is_long ? MORE_NODES : MANY_NODES;
  const double usual = nodes / VERTEX_NODES * (nodes > many ? sqrt(many / nodes) : 1),
               vertices = is_long ? fmax(usual, fmin(nodes / FEWEST, SMALL * sqrt(nodes))) : usual;
  const double each = nodes / ranks, growth = pow(each * many / MANY_NODES, POWER),
               most = fmax(SAME * growth, fmin(FEW, TENFOLD * growth));
  if (ranks == 1 || vertices <= most) return (flesh_levels){.shared = (int)vertices};
  return (flesh_levels){.shared = (int)most, .own = VERTEX_NODES * (each > many ? sqrt(each / many) : 1)};
}
