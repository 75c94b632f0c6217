/* rank_part.c: cuts a rank's mesh out of the whole, and finds the nodes to exchange. */
#include "parallel/rank_part.h"

#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/rising.h"
#include "mesh/mesh.h"
#include "mesh/split_part.h"
#include "parallel/links.h"
#include "parallel/partition.h"
#include "parallel/node_ranks.h"
#include "parallel/split_check.h"

struct flesh_rank_part {
  flesh_communicator *communicator;
  flesh_mesh *mesh;
  int whole_nodes, tet_count;
  int *nodes, *tets; /* [team.overlap], [tet_count] numbers in the mesh from which it was cut */
  int *node_numbers, *tet_numbers; /* the same in the whole, if that mesh is a part of a split one; else NULL */
  uint8_t *always; /* [team.overlap] (links.h) */
  flesh_links links;
  flesh_team team;
};

/* Layers of nodes around those of a rank's tets that make up its overlap. */
enum { LAYERS = 1 };
_Static_assert((int)LAYERS < (int)FLESH_SPLIT_LAYERS, "a part of a split mesh knows who has the nodes of its rank's overlap");

/* The ranks that have each node of the whole, and those that have it in their overlaps. */
typedef struct search {
  const int *part;
  int rank, tie_count;
  const flesh_rank_tie *ties;
  int *owner; /* [nodes of the whole] -1: a node without tets */
  uint8_t *always; /* [nodes of the whole] (links.h); NULL: no tie gives nodes to every rank */
  flesh_node_ranks have, overlap;
} search;

static int is_mine(const search *s, int node) { return flesh_node_ranks_has(&s->have, node, s->rank); }

/* Lists own nodes, then ghosts, then those beyond. */
static int list_nodes(flesh_rank_part *self, const search *s)
{
  flesh_team *team = &self->team;
  for (int i = 0; i < self->whole_nodes; i++) {
    if (s->owner[i] < 0) continue;
    team->all++;
    team->overlap += flesh_node_ranks_has(&s->overlap, i, s->rank);
    team->nodes += is_mine(s, i);
    team->own += s->owner[i] == s->rank;
  }
  self->nodes = flesh_malloc(((size_t)team->overlap + 1) * sizeof *self->nodes);
  team->numbers = self->nodes;
  if (s->always) self->always = flesh_malloc((size_t)team->overlap + 1);
  if (!self->nodes || (s->always && !self->always)) return FLESH_ERR_MEMORY;
  int own = 0, ghost = team->own, beyond = team->nodes;
  for (int i = 0; i < self->whole_nodes; i++) {
    if (!flesh_node_ranks_has(&s->overlap, i, s->rank)) continue;
    self->nodes[!is_mine(s, i) ? beyond++ : s->owner[i] == s->rank ? own++ : ghost++] = i;
  }
  for (int i = 0; i < team->overlap && s->always; i++) self->always[i] = s->always[self->nodes[i]];
  return FLESH_OK;
}

static int list_tets(flesh_rank_part *self, const flesh_mesh *whole, const search *s)
{
  const int tets = flesh_mesh_tet_count(whole);
  for (int t = 0; t < tets; t++) self->tet_count += s->part[t] == s->rank;
  self->tets = flesh_malloc(((size_t)self->tet_count + 1) * sizeof *self->tets);
  if (!self->tets) return FLESH_ERR_MEMORY;
  for (int t = 0, count = 0; t < tets; t++)
    if (s->part[t] == s->rank) self->tets[count++] = t;
  self->team.tets = self->tets;
  return self->tet_count ? FLESH_OK
                         : flesh_fail(FLESH_ERR_ARGUMENT, "rank %d has no tet; every rank needs one", s->rank);
}

/* Gives the nodes of a tet in the part's numbers: corners, then nodes on edges. */
static void take_tet(const flesh_rank_part *self, const flesh_mesh *whole, int tet, int *nodes)
{
  const int *edges = flesh_mesh_tet_edges(whole);
  for (size_t a = 0; a < 4; a++) nodes[a] = flesh_rank_part_find(self, flesh_mesh_tets(whole)[4 * (size_t)tet + a]);
  for (size_t e = 0; e < 6 && edges; e++) {
    const int node = edges[6 * (size_t)tet + e];
    nodes[4 + e] = node < 0 ? -1 : flesh_rank_part_find(self, node);
  }
}

/* Takes the whole's named sets, restricted to the rank's nodes and tets. */
static int take_sets(flesh_rank_part *self, const flesh_mesh *whole)
{
  if (!whole->sets.count) return FLESH_OK;
  int *nodes = flesh_malloc((size_t)whole->nodes * sizeof *nodes);
  int *tets = flesh_malloc((size_t)whole->tets * sizeof *tets), status = FLESH_ERR_MEMORY;
  if (nodes && tets) {
    for (int i = 0; i < whole->nodes; i++) nodes[i] = -1;
    for (int t = 0; t < whole->tets; t++) tets[t] = -1;
    for (int i = 0; i < self->team.nodes; i++) nodes[self->nodes[i]] = i;
    for (int t = 0; t < self->tet_count; t++) tets[self->tets[t]] = t;
    status = flesh_mesh_sets_append(&self->mesh->sets, &whole->sets, &(flesh_mesh_sets_map){.nodes = nodes, .tets = tets});
    flesh_mesh_sets_settle(&self->mesh->sets);
  }
  flesh_free(nodes);
  flesh_free(tets);
  return status;
}

static int make_mesh(flesh_rank_part *self, const flesh_mesh *whole)
{
  const size_t nodes = (size_t)self->team.nodes, tets = (size_t)self->tet_count;
  const int order = flesh_mesh_order(whole), per_tet = order == 2 ? 10 : 4;
  const double *X = flesh_mesh_positions(whole);
  double *positions = flesh_malloc((3 * nodes + 1) * sizeof *positions);
  int *tet_nodes = flesh_malloc(((size_t)per_tet * tets + 1) * sizeof *tet_nodes);
  int *regions = flesh_malloc((tets + 1) * sizeof *regions);
  int status = positions && tet_nodes && regions ? FLESH_OK : FLESH_ERR_MEMORY;
  for (size_t i = 0; !status && i < nodes; i++)
    memcpy(positions + 3 * i, X + 3 * (size_t)self->nodes[i], 3 * sizeof *X);
  for (size_t t = 0; !status && t < tets; t++) {
    regions[t] = flesh_mesh_regions(whole)[self->tets[t]];
    take_tet(self, whole, self->tets[t], tet_nodes + (size_t)per_tet * t);
  }
  if (status) flesh_fail(status, "no memory for a mesh of %d tets", self->tet_count);
  else status = (order == 2 ? flesh_mesh_create_quadratic : flesh_mesh_create)(
      (int)nodes, positions, (int)tets, tet_nodes, regions, &self->mesh);
  for (int i = 0; !status && i < (int)nodes; i++) flesh_mesh_use_node(self->mesh, i); /* ghosts from ties, too */
  if (!status) status = take_sets(self, whole);
  flesh_free(positions);
  flesh_free(tet_nodes);
  flesh_free(regions);
  return status;
}

/* Makes the halo of nodes that go from all ranks that have them, or only from their owners, to the ranks that `take`
 * them. */
static int make_halo(flesh_rank_part *self, const search *s, const flesh_node_ranks *take, int owners, flesh_halo *halo)
{
  const flesh_node_ranks *have = &s->have;
  flesh_shared_nodes shared = {0};
  for (int i = 0; i < self->team.overlap; i++) {
    const int node = self->nodes[i], owner = s->owner[node];
    const int gives = owners ? owner == s->rank : is_mine(s, node), takes = flesh_node_ranks_has(take, node, s->rank);
    if (owners && takes && !gives) flesh_shared_nodes_add(&shared, owner, 1, node, i);
    for (int k = have->first[node]; k < have->first[node + 1] && takes && !owners; k++)
      if (have->ranks[k] != s->rank) flesh_shared_nodes_add(&shared, have->ranks[k], 1, node, i);
    for (int k = take->first[node]; k < take->first[node + 1] && gives; k++)
      if (take->ranks[k] != s->rank) flesh_shared_nodes_add(&shared, take->ranks[k], 0, node, i);
  }
  const int status = flesh_halo_create(self->communicator, &shared, halo);
  flesh_shared_nodes_clear(&shared);
  return status;
}

/* Takes the whole's numbers and number of nodes, for a part of a split mesh. */
static int take_numbers(flesh_rank_part *self, const flesh_split_part *split)
{
  const size_t nodes = (size_t)self->team.overlap, tets = (size_t)self->tet_count;
  if (!split) return FLESH_OK;
  self->team.numbers = self->node_numbers = flesh_malloc((nodes + 1) * sizeof(int));
  self->team.tets = self->tet_numbers = flesh_malloc((tets + 1) * sizeof(int));
  if (!self->node_numbers || !self->tet_numbers) return FLESH_ERR_MEMORY;
  for (size_t i = 0; i < nodes; i++) self->node_numbers[i] = split->nodes[self->nodes[i]];
  for (size_t t = 0; t < tets; t++) self->tet_numbers[t] = split->tets[self->tets[t]];
  self->whole_nodes = split->whole_nodes;
  self->team.all = split->whole_nodes;
  return FLESH_OK;
}

/* Adds the ranks that get nodes by ties: by those that give all their nodes to every rank, or by the others. */
static int add_ties(search *s, int everywhere, int ranks)
{
  int status = FLESH_OK;
  for (int k = 0; k < s->tie_count && !status; k++)
    if (!s->ties[k].everywhere == !everywhere)
      status = flesh_node_ranks_add_cells(&s->have, s->ties[k].count, s->ties[k].nodes_per_cell, s->ties[k].nodes, s->owner,
                                          everywhere ? ranks : 0);
  if (!status && s->tie_count) status = flesh_node_ranks_add(&s->overlap, &s->have);
  return status;
}

/* Marks the nodes in the rank's overlap before ties add those that every rank gets. */
static int mark_always(const flesh_rank_part *self, search *s)
{
  int some = 0;
  for (int k = 0; k < s->tie_count; k++) some |= s->ties[k].everywhere;
  if (!some || flesh_communicator_size(self->communicator) == 1) return FLESH_OK;
  s->always = flesh_malloc((size_t)self->whole_nodes + 1);
  for (int i = 0; i < self->whole_nodes && s->always; i++)
    s->always[i] = (uint8_t)((is_mine(s, i) ? FLESH_LINK_HAS : 0) |
                             (flesh_node_ranks_has(&s->overlap, i, s->rank) ? FLESH_LINK_OVERLAPS : 0));
  return s->always ? FLESH_OK : FLESH_ERR_MEMORY;
}

/* Finds each node's owner, the first rank whose tets have the node, and the ranks that get nodes by ties. */
static int find_ranks(const flesh_rank_part *self, const flesh_mesh *whole, search *s)
{
  int status = flesh_node_ranks_create(whole, s->part, &s->have);
  if (!status) status = flesh_node_ranks_create(whole, s->part, &s->overlap);
  for (int k = 0; k < LAYERS && !status; k++) status = flesh_node_ranks_grow(whole, &s->overlap);
  s->owner = flesh_malloc(((size_t)self->whole_nodes + 1) * sizeof *s->owner);
  if (status || !s->owner) return FLESH_ERR_MEMORY;
  for (int i = 0; i < self->whole_nodes; i++)
    s->owner[i] = s->have.first[i] < s->have.first[i + 1] ? s->have.ranks[s->have.first[i]] : -1;
  status = add_ties(s, 0, 0);
  if (!status) status = mark_always(self, s);
  if (!status && s->always) status = add_ties(s, 1, flesh_communicator_size(self->communicator));
  return status;
}

static int build(flesh_rank_part *self, const flesh_mesh *whole, search *s)
{
  int status = find_ranks(self, whole, s);
  if (!status) status = list_tets(self, whole, s);
  if (!status) status = list_nodes(self, s);
  if (!status) status = make_mesh(self, whole);
  if (!status) status = take_numbers(self, whole->split);
  if (!status) status = make_halo(self, s, &s->have, 1, &self->links.halo);
  if (!status) status = make_halo(self, s, &s->overlap, 1, &self->links.overlap);
  self->team.narrows = s->always != NULL;
  self->links.always = self->always;
  if (self->team.narrows) return status; /* these lists would connect all ranks with each other */
  if (!status) status = make_halo(self, s, &s->overlap, 0, &self->links.rows);
  if (!status) self->team.neighbours = flesh_links_neighbours(&self->links, s->rank);
  return status;
}

static int create(flesh_communicator *communicator, const flesh_mesh *whole, const int *part, int ties,
                  const flesh_rank_tie *tie, flesh_rank_part **rank_part)
{
  flesh_rank_part *self = *rank_part = flesh_calloc(1, sizeof *self);
  search s = {.part = part, .rank = flesh_communicator_rank(communicator), .tie_count = ties, .ties = tie};
  int status = FLESH_ERR_MEMORY;
  if (self) {
    *self = (flesh_rank_part){.communicator = communicator, .whole_nodes = flesh_mesh_node_count(whole),
                              .links = {.communicator = communicator},
                              .team = {.rank = flesh_communicator_rank(communicator),
                                       .ranks = flesh_communicator_size(communicator),
                                       .comm = flesh_communicator_comm(communicator), .data = &self->links,
                                       .operations = &flesh_links_operations}};
    status = build(self, whole, &s);
  }
  if (status == FLESH_ERR_MEMORY) flesh_fail(status, "no memory for the part of a rank");
  flesh_free(s.owner);
  flesh_free(s.always);
  flesh_node_ranks_clear(&s.have);
  flesh_node_ranks_clear(&s.overlap);
  status = flesh_communicator_agree(communicator, status);
  if (status) flesh_rank_part_destroy(rank_part);
  return status;
}

/* Finds the rank of each tet, the same on all ranks; new. */
static int cut(flesh_communicator *communicator, const flesh_mesh *whole, int **ranks)
{
  const int tets = flesh_mesh_tet_count(whole);
  *ranks = flesh_malloc(((size_t)tets + 1) * sizeof **ranks);
  int status = *ranks ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for the ranks of %d tets", tets);
  if (!status && flesh_communicator_rank(communicator) == 0)
    status = flesh_partition_tets(whole, flesh_communicator_size(communicator), *ranks);
  status = flesh_communicator_agree(communicator, status);
  if (!status) flesh_communicator_spread(communicator, tets, *ranks);
  return status;
}

/* Checks that the part of a split mesh is this rank's. */
static int check_split(const flesh_communicator *communicator, const flesh_split_part *split)
{
  const int rank = flesh_communicator_rank(communicator), size = flesh_communicator_size(communicator);
  return split->parts == size && split->part == rank
             ? FLESH_OK
             : flesh_fail(FLESH_ERR_ARGUMENT, "rank %d of %d has part %d of %d; it must be its own", rank, size,
                          split->part, split->parts);
}

int flesh_rank_part_create_tied(flesh_communicator *communicator, const flesh_mesh *whole, const int *ranks, int count,
                                const flesh_rank_tie *ties, flesh_rank_part **rank_part)
{
  int *made = NULL, status = FLESH_OK;
  if (whole->split) status = flesh_communicator_agree(communicator, check_split(communicator, whole->split));
  if (whole->split && !status) status = flesh_split_check_parts(communicator, whole);
  if (whole->split && !status) ranks = whole->split->owners;
  if (!status && !ranks) status = cut(communicator, whole, &made);
  if (!status) status = create(communicator, whole, ranks ? ranks : made, count, ties, rank_part);
  flesh_free(made);
  return status;
}

int flesh_rank_part_create(flesh_communicator *communicator, const flesh_mesh *whole, const int *ranks,
                           flesh_rank_part **rank_part)
{
  FLESH_NEED({rank_part, "rank_part"});
  *rank_part = NULL;
  FLESH_NEED({communicator, "communicator"}, {whole, "whole"});
  return flesh_rank_part_create_tied(communicator, whole, ranks, 0, NULL, rank_part);
}

void flesh_rank_part_destroy(flesh_rank_part **rank_part)
{
  if (!rank_part || !*rank_part) return;
  flesh_rank_part *self = *rank_part;
  flesh_mesh_destroy(&self->mesh);
  flesh_free(self->nodes);
  flesh_free(self->tets);
  flesh_free(self->node_numbers);
  flesh_free(self->tet_numbers);
  flesh_free(self->always);
  flesh_links_clear(&self->links);
  flesh_free(self);
  *rank_part = NULL;
}

const flesh_mesh *flesh_rank_part_mesh(const flesh_rank_part *self) { return self->mesh; }

const flesh_team *flesh_rank_part_team(const flesh_rank_part *self) { return &self->team; }

const int *flesh_rank_part_nodes(const flesh_rank_part *self) { return self->nodes; }

const int *flesh_rank_part_tets(const flesh_rank_part *self) { return self->tets; }

int flesh_rank_part_own(const flesh_rank_part *self) { return self->team.own; }

int flesh_rank_part_neighbours(const flesh_rank_part *self) { return self->links.halo.count; }

static int find_in(const flesh_rank_part *self, const int *numbers, int node)
{
  const int own = flesh_rising_find(numbers, 0, self->team.own, node);
  return own >= 0 ? own : flesh_rising_find(numbers, self->team.own, self->team.nodes, node);
}

int flesh_rank_part_find(const flesh_rank_part *self, int node) { return find_in(self, self->nodes, node); }

int flesh_rank_part_find_number(const flesh_rank_part *self, int number)
{
  return find_in(self, self->team.numbers, number);
}

int flesh_rank_part_gather(const flesh_rank_part *self, const double *vector, double *whole)
{
  FLESH_NEED({self, "rank_part"}, {vector, "vector"}, {whole, "whole"});
  memset(whole, 0, 3 * (size_t)self->whole_nodes * sizeof *whole);
  for (size_t i = 0; i < (size_t)self->team.own; i++)
    memcpy(whole + 3 * (size_t)self->team.numbers[i], vector + 3 * i, 3 * sizeof *whole);
  flesh_communicator_sum(self->communicator, 3 * self->whole_nodes, whole);
  return FLESH_OK;
}
