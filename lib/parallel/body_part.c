/* body_part.c: cuts a rank's mesh out of the whole, and exchanges what nodes have. */
#include "parallel/body_part.h"

#include <stdint.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "parallel/halo.h"
#include "parallel/partition.h"

struct flesh_body_part {
  flesh_communicator *communicator;
  flesh_mesh *mesh;
  int whole_nodes, tet_count;
  int *nodes, *tets; /* [team.nodes], [tet_count] numbers in the whole */
  flesh_halo halo;
  flesh_team team;
};

/* Calls each(data, tet, node) for all nodes of the tets of the whole. */
static void for_nodes(const flesh_mesh *whole, void (*each)(void *data, int tet, int node), void *data)
{
  const int *corners = flesh_mesh_tets(whole), *edges = flesh_mesh_tet_edges(whole);
  for (int t = 0; t < flesh_mesh_tet_count(whole); t++) {
    for (int a = 0; a < 4; a++) each(data, t, corners[4 * (size_t)t + (size_t)a]);
    for (int e = 0; e < 6 && edges; e++)
      if (edges[6 * (size_t)t + (size_t)e] >= 0) each(data, t, edges[6 * (size_t)t + (size_t)e]);
  }
}

typedef struct search {
  const int *part;
  int rank;
  int *owner;    /* [nodes of the whole] the first rank of each; -1: no tet has it */
  uint8_t *mine; /* [nodes of the whole] this rank has it */
} search;

static void look(void *data, int tet, int node)
{
  search *s = data;
  const int rank = s->part[tet];
  if (s->owner[node] < 0 || rank < s->owner[node]) s->owner[node] = rank;
  if (rank == s->rank) s->mine[node] = 1;
}

/* Own nodes, then ghosts. */
static int list_nodes(flesh_body_part *self, const search *s)
{
  int count = 0;
  for (int i = 0; i < self->whole_nodes; i++) {
    count += s->mine[i];
    self->team.own += s->mine[i] && s->owner[i] == s->rank;
    self->team.all += s->owner[i] >= 0;
  }
  self->team.nodes = count;
  self->nodes = flesh_malloc(((size_t)count + 1) * sizeof *self->nodes);
  if (!self->nodes) return FLESH_ERR_MEMORY;
  int own = 0, ghost = self->team.own;
  for (int i = 0; i < self->whole_nodes; i++)
    if (s->mine[i]) self->nodes[s->owner[i] == s->rank ? own++ : ghost++] = i;
  return FLESH_OK;
}

static int list_tets(flesh_body_part *self, const flesh_mesh *whole, const search *s)
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

/* Nodes of a tet of the part, in its own numbers: corners, then edges. */
static void take_tet(const flesh_body_part *self, const flesh_mesh *whole, int tet, int *nodes)
{
  const int *edges = flesh_mesh_tet_edges(whole);
  for (size_t a = 0; a < 4; a++) nodes[a] = flesh_body_part_find(self, flesh_mesh_tets(whole)[4 * (size_t)tet + a]);
  for (size_t e = 0; e < 6 && edges; e++) {
    const int node = edges[6 * (size_t)tet + e];
    nodes[4 + e] = node < 0 ? -1 : flesh_body_part_find(self, node);
  }
}

static int make_mesh(flesh_body_part *self, const flesh_mesh *whole)
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
  flesh_free(positions);
  flesh_free(tet_nodes);
  flesh_free(regions);
  return status;
}

typedef struct pairing {
  const flesh_body_part *part;
  const search *search;
  flesh_shared_nodes *shared;
} pairing;

/* A node that this rank and that of another tet have, one of them as its owner. */
static void pair_up(void *data, int tet, int node)
{
  const pairing *p = data;
  const int rank = p->search->part[tet], own = p->search->rank, owner = p->search->owner[node];
  if (rank == own || !p->search->mine[node] || (owner != own && owner != rank)) return;
  flesh_shared_nodes_add(p->shared, rank, owner == rank, node, flesh_body_part_find(p->part, node));
}

static int build(flesh_body_part *self, const flesh_mesh *whole, const search *s)
{
  if (!s->owner || !s->mine) return FLESH_ERR_MEMORY;
  memset(s->owner, -1, (size_t)self->whole_nodes * sizeof *s->owner);
  for_nodes(whole, look, (void *)s);
  int status = list_tets(self, whole, s);
  if (!status) status = list_nodes(self, s);
  if (!status) status = make_mesh(self, whole);
  if (status) return status;
  flesh_shared_nodes shared = {0};
  for_nodes(whole, pair_up, &(pairing){self, s, &shared});
  status = flesh_halo_create(self->communicator, &shared, &self->halo);
  flesh_shared_nodes_clear(&shared);
  return status;
}

static void team_sum(const void *data, int count, double *numbers)
{
  flesh_communicator_sum(((const flesh_body_part *)data)->communicator, count, numbers);
}

static void team_largest(const void *data, int count, double *numbers)
{
  flesh_communicator_largest(((const flesh_body_part *)data)->communicator, count, numbers);
}

static int team_agree(const void *data, int status)
{
  return flesh_communicator_agree(((const flesh_body_part *)data)->communicator, status);
}

static void team_share(const void *data, const flesh_team_vector *vector)
{
  const flesh_body_part *self = data;
  flesh_halo_share(&self->halo, self->communicator, vector);
}

static void team_collect(const void *data, const flesh_team_vector *vector)
{
  const flesh_body_part *self = data;
  flesh_halo_collect(&self->halo, self->communicator, vector);
}

static const flesh_team_operations team_operations = {
    .sum = team_sum, .largest = team_largest, .agree = team_agree, .share = team_share, .collect = team_collect};

static int create(flesh_communicator *communicator, const flesh_mesh *whole, const int *part,
                  flesh_body_part **body_part)
{
  const size_t nodes = (size_t)flesh_mesh_node_count(whole);
  flesh_body_part *self = *body_part = flesh_calloc(1, sizeof *self);
  search s = {.part = part, .rank = flesh_communicator_rank(communicator),
              .owner = flesh_malloc((nodes + 1) * sizeof *s.owner), .mine = flesh_calloc(nodes + 1, 1)};
  int status = FLESH_ERR_MEMORY;
  if (self) {
    *self = (flesh_body_part){.communicator = communicator, .whole_nodes = (int)nodes,
                              .team = {.data = self, .operations = &team_operations}};
    status = build(self, whole, &s);
  }
  if (status == FLESH_ERR_MEMORY) flesh_fail(status, "no memory for the part of a rank");
  flesh_free(s.owner);
  flesh_free(s.mine);
  status = flesh_communicator_agree(communicator, status);
  if (status) flesh_body_part_destroy(body_part);
  return status;
}

/* The rank of each tet by METIS, the same on all ranks; new. */
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

int flesh_body_part_create(flesh_communicator *communicator, const flesh_mesh *whole, const int *ranks,
                           flesh_body_part **body_part)
{
  FLESH_NEED({body_part, "body_part"});
  *body_part = NULL;
  FLESH_NEED({communicator, "communicator"}, {whole, "whole"});
  int *made = NULL, status = ranks ? FLESH_OK : cut(communicator, whole, &made);
  if (!status) status = create(communicator, whole, ranks ? ranks : made, body_part);
  flesh_free(made);
  return status;
}

void flesh_body_part_destroy(flesh_body_part **body_part)
{
  if (!body_part || !*body_part) return;
  flesh_body_part *self = *body_part;
  flesh_mesh_destroy(&self->mesh);
  flesh_free(self->nodes);
  flesh_free(self->tets);
  flesh_halo_clear(&self->halo);
  flesh_free(self);
  *body_part = NULL;
}

const flesh_mesh *flesh_body_part_mesh(const flesh_body_part *self) { return self->mesh; }

const flesh_team *flesh_body_part_team(const flesh_body_part *self) { return &self->team; }

const int *flesh_body_part_nodes(const flesh_body_part *self) { return self->nodes; }

const int *flesh_body_part_tets(const flesh_body_part *self) { return self->tets; }

int flesh_body_part_own(const flesh_body_part *self) { return self->team.own; }

int flesh_body_part_neighbours(const flesh_body_part *self) { return self->halo.count; }

/* Where `node` is in the rising `nodes` from `low` to before `high`; -1. */
static int find(const int *nodes, int low, int high, int node)
{
  while (low < high) {
    const int middle = low + (high - low) / 2;
    if (nodes[middle] == node) return middle;
    if (nodes[middle] < node) low = middle + 1;
    else high = middle;
  }
  return -1;
}

int flesh_body_part_find(const flesh_body_part *self, int node)
{
  const int own = find(self->nodes, 0, self->team.own, node);
  return own >= 0 ? own : find(self->nodes, self->team.own, self->team.nodes, node);
}

int flesh_body_part_gather(const flesh_body_part *self, const double *vector, double *whole)
{
  FLESH_NEED({self, "body_part"}, {vector, "vector"}, {whole, "whole"});
  memset(whole, 0, 3 * (size_t)self->whole_nodes * sizeof *whole);
  for (size_t i = 0; i < (size_t)self->team.own; i++)
    memcpy(whole + 3 * (size_t)self->nodes[i], vector + 3 * i, 3 * sizeof *whole);
  flesh_communicator_sum(self->communicator, 3 * self->whole_nodes, whole);
  return FLESH_OK;
}
