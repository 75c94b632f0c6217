/* subdomain.c: the small system of nonlinear elimination. The elements around the nodes that carry a residual become a body
 * of their own with its outer nodes constrained, whose stage is solved like any other. Effects that are no sum over
 * elements (inertia, loads, contact ...) are replaced by their quadratic models, which are exact for most of them.
 *
 * On a body shared out among ranks, each rank frees only nodes that no other rank has: their residual and their rows of K
 * are complete here, and no element has free nodes of two ranks, so that the ranks' corrections together are a step of the
 * body. */
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/effect.h"
#include "linear/block_matrix.h"
#include "newton/background.h"
#include "newton/newton.h"

enum {
  RINGS = 2,       /* rings of neighbours around the nodes that carry the residual; half as many with ten-node tets */
  ITERATIONS = 60, /* most Newton iterations */
  MOST_WHOLE = 2   /* largest cost of these, in iterations of the whole body */
};
static const double least_residual = 1e-2; /* relative to the largest residual of a node */
static const double largest_fraction = 0.25; /* fraction of the body's nodes */
static const double tolerance = 1e-2; /* newton_tolerance of the subdomain's solve */

typedef struct subdomain {
  flesh_newton *parent;
  const flesh_equations *whole; /* the parent's equations */
  const flesh_effect *sum;  /* an effect that sums over the whole body's elements */
  const flesh_cells *cells; /* these elements */
  uint8_t *state;     /* [nodes of the whole] OUTSIDE, CONSTRAINED or FREE */
  int *local;         /* [nodes of the whole] number in the subdomain, if not OUTSIDE */
  int nodes, *global; /* [nodes] number in the whole */
  int tets, *tet;     /* [tets] their numbers in `cells` */
  int per_cell;       /* 4 or 10 nodes; cells with fewer repeat the last one */
  double *x;          /* [3*nodes] positions at the start */
  flesh_mesh *mesh;
  flesh_system *system;
  flesh_background *others; /* quadratic models of the other effects, owned by the system */
  double largest;           /* largest square of a node's residual, on all ranks */
  int solved, newton;       /* 1: it was solved; its number of iterations */
} subdomain;

enum { OUTSIDE, CONSTRAINED, FREE };

static int no_memory(const subdomain *self)
{
  return flesh_fail(FLESH_ERR_MEMORY, "no memory for a subdomain of %d nodes", self->nodes);
}

static int has_free_node(const subdomain *self, const int *tet)
{
  for (int a = 0; a < self->per_cell; a++)
    if (self->state[tet[a]] == FREE) return 1;
  return 0;
}

static double square(const double r[3]) { return r[0] * r[0] + r[1] * r[1] + r[2] * r[2]; }

static double largest_square(int nodes, const double *r)
{
  double largest = 0;
  for (int i = 0; i < nodes; i++) largest = fmax(largest, square(r + 3 * i));
  return largest;
}

/* Sets free nodes that several ranks have to `state`. */
static void leave_shared_nodes(subdomain *self, const double *ranks, uint8_t state)
{
  for (int i = 0; i < self->whole->n / 3; i++)
    if (ranks[3 * i] > 1 && self->state[i] == FREE) self->state[i] = state;
}

/* Frees the nodes that carry the residual and their neighbours, RINGS deep, and constrains the next ring. Returns the
 * number of free nodes. */
static int choose_nodes(subdomain *self, const double *r, const double *ranks)
{
  const int nodes = self->whole->n / 3;
  const int rings = self->per_cell == 10 ? RINGS / 2 : RINGS;
  int count = 0;
  for (int i = 0; i < nodes; i++)
    self->state[i] = square(r + 3 * i) > least_residual * least_residual * self->largest ? FREE : OUTSIDE;
  leave_shared_nodes(self, ranks, OUTSIDE);
  for (int ring = 0; ring <= rings; ring++) {
    for (int e = 0; e < self->cells->count; e++) {
      const int *tet = self->cells->nodes + self->per_cell * (size_t)e;
      for (int a = 0; a < self->per_cell && has_free_node(self, tet); a++)
        if (self->state[tet[a]] == OUTSIDE) self->state[tet[a]] = CONSTRAINED;
    }
    for (int i = 0; i < nodes && ring < rings; i++)
      if (self->state[i] == CONSTRAINED) self->state[i] = FREE;
    leave_shared_nodes(self, ranks, CONSTRAINED);
  }
  for (int i = 0; i < nodes; i++) count += self->state[i] == FREE;
  return count;
}

/* Numbers the subdomain's nodes, and makes a mesh of its elements. */
static int make_mesh(subdomain *self)
{
  const flesh_mesh *mesh = flesh_system_mesh(self->whole->system);
  const size_t m = (size_t)self->per_cell;
  for (int i = 0; i < flesh_mesh_node_count(mesh); i++)
    if (self->state[i] != OUTSIDE) {
      self->global[self->nodes] = i;
      self->local[i] = self->nodes++;
    }
  for (int e = 0; e < self->cells->count; e++)
    if (has_free_node(self, self->cells->nodes + m * (size_t)e)) self->tet[self->tets++] = e;
  double *X = flesh_malloc(3 * (size_t)self->nodes * sizeof *X);
  int *own = flesh_malloc(m * (size_t)self->tets * sizeof *own);
  int status = X && own ? FLESH_OK : no_memory(self);
  for (int i = 0; i < self->nodes && !status; i++)
    memcpy(X + 3 * i, flesh_mesh_positions(mesh) + 3 * (size_t)self->global[i], 3 * sizeof *X);
  for (int k = 0; k < self->tets && !status; k++) {
    int node[10], size = flesh_effect_private_of(self->sum)->cell_nodes(self->sum, self->tet[k], node);
    for (int a = 0; a < self->per_cell; a++) own[m * (size_t)k + (size_t)a] = a < size ? self->local[node[a]] : -1;
  }
  if (!status)
    status = m == 4 ? flesh_mesh_create(self->nodes, X, self->tets, own, NULL, &self->mesh)
                    : flesh_mesh_create_quadratic(self->nodes, X, self->tets, own, NULL, &self->mesh);
  flesh_free(X);
  flesh_free(own);
  return status;
}

/* Whether an effect is a sum over the subdomain's elements, which are the mesh's tets, and can be restricted to some. */
static int is_sum(const subdomain *self, const flesh_effect *effect)
{
  if (!flesh_effect_private_of(effect)->restrict_to_cells || effect->operations->internal) return 0;
  const flesh_cells *cells = effect->operations->cells(effect), *known = self->cells;
  if (cells->nodes_per_cell != self->per_cell) return 0;
  return !known || (cells->count == known->count &&
                    !memcmp(cells->nodes, known->nodes,
                            (size_t)self->per_cell * (size_t)known->count * sizeof *cells->nodes));
}

static int add_part(subdomain *self, const flesh_effect *effect)
{
  flesh_effect *part = NULL;
  int status = flesh_effect_private_of(effect)->restrict_to_cells(effect, self->tets, self->tet, self->mesh, &part);
  return status ? status : flesh_system_add_effect(self->system, &part);
}

/* Writes the pairs of free nodes that K couples; NULL: only counts them. */
static int list_pairs(const subdomain *self, int *pair)
{
  const flesh_block_matrix *K = self->whole->K;
  int pairs = 0;
  for (int i = 0; i < self->nodes; i++) {
    const int row = self->global[i];
    for (int k = K->row_start[row] + 1; self->state[row] == FREE && k < K->row_end[row]; k++) {
      if (self->state[K->column[k]] != FREE) continue;
      if (pair) pair[2 * pairs] = i, pair[2 * pairs + 1] = self->local[K->column[k]];
      pairs++;
    }
  }
  return pairs;
}

/* Adds an empty background. `couples`: it has pairs. */
static int add_background(subdomain *self, int couples)
{
  flesh_effect *effect = NULL;
  const int pairs = couples ? list_pairs(self, NULL) : 0;
  int status = flesh_background_create(self->mesh, pairs, self->x, self->whole->stage.shift.x, &self->others, &effect);
  if (status) return status;
  if (pairs) list_pairs(self, self->others->pair);
  return flesh_system_add_effect(self->system, &effect);
}

static int add_pins(subdomain *self)
{
  const uint8_t *constrained = self->whole->constrained.is;
  int *nodes = flesh_malloc((size_t)self->nodes * sizeof *nodes), status = FLESH_OK;
  if (!nodes) return no_memory(self);
  for (unsigned axes = 1; axes <= FLESH_AXES_ALL && !status; axes++) {
    int count = 0;
    for (int i = 0; i < self->nodes; i++) {
      const uint8_t *of_node = constrained + 3 * (size_t)self->global[i];
      const unsigned constrained_axes =
          of_node[0] * FLESH_AXIS_X | of_node[1] * FLESH_AXIS_Y | of_node[2] * FLESH_AXIS_Z;
      if (axes == (self->state[self->global[i]] == CONSTRAINED ? FLESH_AXES_ALL : constrained_axes)) nodes[count++] = i;
    }
    if (count) status = flesh_system_add_pin(self->system, count, nodes, axes, -INFINITY, INFINITY);
  }
  flesh_free(nodes);
  return status;
}

static int make_system(subdomain *self)
{
  const flesh_system *system = self->whole->system;
  int status = flesh_system_create(self->mesh, &self->system), couples = 0;
  for (int k = 0; k < flesh_system_effect_count(system) && !status; k++) {
    const flesh_effect *effect = flesh_system_effect(system, k);
    if (is_sum(self, effect)) status = add_part(self, effect);
    else couples |= effect->operations->cells != NULL;
  }
  if (!status) status = add_background(self, couples);
  if (!status) status = add_pins(self);
  return status ? status : flesh_system_finalize(self->system);
}

/* Sets the subdomain's nodes to their positions at u. */
static void place(subdomain *self, const double *u)
{
  const flesh_equations *whole = self->whole;
  for (int i = 0; i < self->nodes; i++)
    for (int c = 0; c < 3; c++) {
      const int d = 3 * self->global[i] + c;
      self->x[3 * i + c] =
          whole->stage.x0[d] + whole->stage.shift.x * (whole->constrained.is[d] ? whole->constrained.u[d] : u[d]);
    }
}

/* Fills the background with the whole body's residual at u and its K, less the elements' own: K has the same filter and is
 * at the same u. */
static int fill_background(subdomain *self, const double *u, const double *r, flesh_block_matrix *K, double *work)
{
  const flesh_equations *whole = self->whole;
  flesh_background *others = self->others;
  double *of_elements = work, *zeros = work + 3 * self->nodes;
  flesh_point point = flesh_point_at(whole->stage.t, self->x, zeros, zeros);
  flesh_shift shift = whole->stage.shift;
  shift.filter = self->parent->direction.filter;
  place(self, self->parent->u);
  int status = flesh_system_jacobian(self->system, &point, &shift, K);
  place(self, u);
  if (!status) status = flesh_system_residual(self->system, &point, of_elements);
  for (int k = 0, i, j; k < others->nodes + others->pairs && !status; k++) {
    flesh_background_ends(others, k, &i, &j);
    if (self->state[self->global[i]] == CONSTRAINED) continue;
    const int from = flesh_block_find(whole->K, self->global[i], self->global[j]), own = flesh_block_find(K, i, j);
    for (int c = 0; c < 9; c++)
      others->K[9 * (size_t)k + c] = whole->K->values[9 * (size_t)from + c] - K->values[9 * (size_t)own + c];
  }
  for (int d = 0; d < 3 * self->nodes && !status; d++)
    others->g[d] = r[3 * self->global[d / 3] + d % 3] - of_elements[d];
  return status;
}

static int set_background(subdomain *self, const double *u, const double *r)
{
  flesh_block_matrix *K = NULL;
  double *work = flesh_calloc(6 * (size_t)self->nodes, sizeof *work);
  int status = work ? flesh_system_matrix_create(self->system, &K) : no_memory(self);
  if (!status) status = fill_background(self, u, r, K, work);
  flesh_block_matrix_destroy(&K);
  flesh_free(work);
  return status;
}

static int solve(subdomain *self, double *w)
{
  const flesh_newton *parent = self->parent;
  const double fraction = (double)self->tets / self->cells->count;
  flesh_solver_options options = parent->options;
  options.newton_tolerance = tolerance;
  options.max_newton = (int)fmax(1, fmin(ITERATIONS, MOST_WHOLE / fraction));
  options.accept_unconverged = 1;
  options.techniques &= ~(unsigned)FLESH_TECHNIQUE_NONLINEAR_ELIMINATION;
  options.threads = 1;
  /* A subdomain constrained all around has no smooth displacements that would need a coarse level. */
  if (options.preconditioner == FLESH_PRECONDITIONER_AUTO) options.preconditioner = FLESH_PRECONDITIONER_IC;
  /* All constrained nodes stay where they are. */
  const flesh_stage stage = {
      .t = self->whole->stage.t, .load = 1, .prescribed_fraction = 0, .shift = self->whole->stage.shift, .x0 = self->x};
  flesh_solve_stats stats = {0};
  double *du = flesh_calloc(3 * (size_t)self->nodes, sizeof *du);
  if (!du) return no_memory(self);
  int status = parent->solver.solve(parent->solver.data, self->system, &options, &stage, parent->stop, &stats, du);
  self->solved = 1;
  self->newton = stats.newton;
  if (status >= 0) { /* an iterate that has not converged also lowers the potential */
    for (int i = 0; i < self->nodes; i++) memcpy(w + 3 * (size_t)self->global[i], du + 3 * i, 3 * sizeof *w);
    status = FLESH_OK;
  }
  flesh_free(du);
  return status;
}

/* Makes and solves the subdomain in the thread's reserve, which is emptied afterwards. On entry w has the number of ranks
 * that have each node. */
static int make_and_solve(subdomain *self, const double *u, const double *r, double *w)
{
  const size_t nodes = (size_t)self->whole->n / 3;
  self->state = flesh_malloc(nodes);
  self->local = flesh_malloc(nodes * sizeof *self->local);
  self->global = flesh_malloc(nodes * sizeof *self->global);
  self->tet = flesh_malloc((size_t)self->cells->count * sizeof *self->tet);
  self->x = flesh_malloc(3 * nodes * sizeof *self->x);
  int status = self->state && self->local && self->global && self->tet && self->x ? FLESH_OK : no_memory(self);
  if (!status) {
    const int free_nodes = choose_nodes(self, r, w);
    if (!free_nodes || free_nodes > largest_fraction * (double)nodes) status = FLESH_NOT_CONVERGED;
  }
  memset(w, 0, (size_t)self->whole->n * sizeof *w);
  if (!status) status = make_mesh(self);
  if (!status) status = make_system(self);
  if (!status) status = set_background(self, u, r);
  if (!status) status = solve(self, w);
  flesh_system_destroy(&self->system); /* effects may own more than memory */
  return status;
}

/* Adds up the counts of all ranks. Returns FLESH_OK if any rank has found a correction; all then take the step. */
static int meet(const subdomain *self, int status)
{
  const flesh_team *team = self->whole->team;
  flesh_solve_stats *stats = &self->parent->stats;
  const double cells = self->cells ? self->cells->count : 0, elements = (double)self->newton * self->tets;
  double all[] = {status == FLESH_OK, self->solved, self->newton, cells, elements};
  flesh_team_sum(team, 5, all);
  stats->subdomains += (int)all[1];
  stats->subdomain_newton += (int)all[2];
  stats->subdomain_share += all[1] > 0 ? all[4] / all[3] : 0;
  return all[0] > 0 ? FLESH_OK : team ? FLESH_NOT_CONVERGED : status;
}

int flesh_subdomain_solve(flesh_newton *parent, const double *u, const double *r, double *w)
{
  subdomain self = {.parent = parent, .whole = &parent->equations,
                    .largest = largest_square(parent->equations.n / 3, r)};
  int status = FLESH_NOT_CONVERGED;
  flesh_team_largest(self.whole->team, 1, &self.largest);
  self.per_cell = flesh_mesh_order(flesh_system_mesh(self.whole->system)) == 2 ? 10 : 4;
  flesh_team_count_ranks(self.whole->team, self.whole->n / 3, 3, w);
  for (int k = 0; k < flesh_system_effect_count(self.whole->system) && !self.cells; k++) {
    const flesh_effect *effect = flesh_system_effect(self.whole->system, k);
    if (is_sum(&self, effect)) self.sum = effect, self.cells = effect->operations->cells(effect);
  }
  if (self.cells) {
    flesh_reserve *before = flesh_reserve_enter(parent->reserve);
    status = make_and_solve(&self, u, r, w);
    flesh_reserve_enter(before);
    flesh_reserve_empty(parent->reserve);
  } else {
    memset(w, 0, (size_t)self.whole->n * sizeof *w);
  }
  return meet(&self, status);
}

/* A whole body takes 1222 bytes for each tet of a block of 20 736, several times that with ten nodes. The reserve is only
 * address space, which costs nothing where it is not used. */
flesh_reserve *flesh_subdomain_reserve(const flesh_system *system)
{
  const flesh_mesh *mesh = flesh_system_mesh(system);
  const size_t nodes = (size_t)flesh_mesh_node_count(mesh), tets = (size_t)flesh_mesh_tet_count(mesh);
  size_t sums = 0;
  for (int k = 0; k < flesh_system_effect_count(system); k++)
    sums += flesh_effect_private_of(flesh_system_effect(system, k))->restrict_to_cells != NULL;
  const size_t of_tet = flesh_mesh_order(mesh) == 2 ? 16384 : 2048;
  return flesh_reserve_create((1 << 20) + 1024 * nodes + (of_tet + 1024 * sums) * tets);
}
