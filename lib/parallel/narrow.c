/* narrow.c: exchanges of solves that leave out ghosts of effects that see the whole surface, except those for which the
 * rank's matrix has blocks.
 *
 * Every rank tells the owners of its ghosts its relation to them (links.h). An owner tells every rank related to a node
 * about the others. Thus no rank has to know about all ranks, and the exchange grows only with the number of nearby
 * nodes. */
#include "base/error.h"
#include "base/memory.h"
#include "parallel/links.h"

typedef struct narrowed {
  flesh_team team; /* first */
  flesh_links links;
  uint8_t *left_out;
} narrowed;

/* A rank and its relation to an own node. */
typedef struct link {
  int rank, is;
} link;

typedef struct search {
  const flesh_team *team; /* the team to be narrowed */
  const flesh_links *links; /* of the team */
  double *is; /* [team->overlap] this rank's relation to its nodes */
  int *first; /* [team->own+1] first link of each own node */
  link *others; /* links of other ranks to own nodes */
  double *counts; /* [2][neighbours] how many numbers go to and come from each */
  int *first_sent, *first_received; /* [neighbours+1] first number of each */
  double *sent, *received;
  flesh_shared_nodes shared[3]; /* lists for halo, overlap and rows */
} search;

enum { HALO, REACHED, ROWS };

static int open_search(const uint8_t *needed, search *s)
{
  const flesh_team *team = s->team;
  const size_t ranks = (size_t)s->links->overlap.count, own = (size_t)team->own;
  s->is = flesh_malloc(((size_t)team->overlap + 1) * sizeof *s->is);
  s->first = flesh_calloc(own + 2, sizeof *s->first);
  s->others = flesh_malloc(((size_t)s->links->overlap.first_own[ranks] + 1) * sizeof *s->others);
  s->counts = flesh_calloc(2 * ranks + 1, sizeof *s->counts);
  s->first_sent = flesh_calloc(ranks + 1, sizeof *s->first_sent);
  s->first_received = flesh_calloc(ranks + 1, sizeof *s->first_received);
  if (!s->is || !s->first || !s->others || !s->counts || !s->first_sent || !s->first_received) return FLESH_ERR_MEMORY;
  for (int i = 0; i < team->overlap; i++) {
    const int is = s->links->always[i], by_matrix = i < team->own || (i < team->nodes && needed[i]);
    s->is[i] = by_matrix ? FLESH_LINK_HAS | FLESH_LINK_OVERLAPS : is;
  }
  return FLESH_OK;
}

static void close_search(search *s)
{
  void *const arrays[] = {s->is, s->first, s->others, s->counts, s->sent, s->received, s->first_sent, s->first_received};
  for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++) flesh_free(arrays[k]);
  for (int k = 0; k < 3; k++) flesh_shared_nodes_clear(&s->shared[k]);
}

static void share(search *s, int list, int rank, int ghost, int i)
{
  flesh_shared_nodes_add(&s->shared[list], rank, ghost, s->team->numbers[i], i);
}

/* Lists node i for `rows` between this rank and another that is related to it; both may have the node, also in their
 * overlaps. */
static void share_rows(search *s, int i, int rank, int is)
{
  const int mine = (int)s->is[i];
  if (mine & FLESH_LINK_HAS && is & FLESH_LINK_OVERLAPS) share(s, ROWS, rank, 0, i);
  if (mine & FLESH_LINK_OVERLAPS && is & FLESH_LINK_HAS) share(s, ROWS, rank, 1, i);
}

/* Lists nodes between owners and others, from the relations just received, and the links of own nodes by rising
 * neighbour. */
static void link_owners(search *s)
{
  const flesh_halo *all = &s->links->overlap;
  for (int n = 0; n < all->count; n++) {
    for (int k = all->first_own[n]; k < all->first_own[n + 1]; k++) {
      const int is = (int)all->of_own[k], i = all->own[k];
      if (is & FLESH_LINK_HAS) share(s, HALO, all->ranks[n], 0, i);
      if (is & FLESH_LINK_OVERLAPS) share(s, REACHED, all->ranks[n], 0, i);
      share_rows(s, i, all->ranks[n], is);
      s->first[i + 2] += is != 0;
    }
    for (int k = all->first_ghost[n]; k < all->first_ghost[n + 1]; k++) {
      const int i = all->ghosts[k], is = (int)s->is[i];
      if (is & FLESH_LINK_HAS) share(s, HALO, all->ranks[n], 1, i);
      if (is & FLESH_LINK_OVERLAPS) share(s, REACHED, all->ranks[n], 1, i);
      share_rows(s, i, all->ranks[n], FLESH_LINK_HAS | FLESH_LINK_OVERLAPS);
    }
  }
  for (int i = 0; i < s->team->own; i++) s->first[i + 2] += s->first[i + 1];
  for (int n = 0; n < all->count; n++)
    for (int k = all->first_own[n]; k < all->first_own[n + 1]; k++)
      if (all->of_own[k] != 0) s->others[s->first[all->own[k] + 1]++] = (link){all->ranks[n], (int)all->of_own[k]};
}

/* Lists for each neighbour, and each node to which it is related, how many more ranks are, which ranks, and their
 * relations. The number of numbers goes into `counts`; nothing is written if `sent` is NULL. */
static size_t list_sent(search *s)
{
  const flesh_halo *all = &s->links->overlap;
  size_t count = 0;
  for (int n = 0; n < all->count; n++) {
    const size_t begin = count;
    for (int k = all->first_own[n]; k < all->first_own[n + 1]; k++) {
      const int i = all->own[k], links = s->first[i + 1] - s->first[i];
      if (all->of_own[k] == 0) continue;
      if (s->sent) s->sent[count] = links - 1;
      count++;
      for (const link *other = s->others + s->first[i]; other < s->others + s->first[i + 1]; other++) {
        if (other->rank == all->ranks[n]) continue;
        if (s->sent) s->sent[count] = 4. * other->rank + other->is;
        count++;
      }
    }
    s->counts[n] = (double)(count - begin);
  }
  return count;
}

static void exchange(const search *s, const flesh_exchange *exchange)
{
  const flesh_halo *all = &s->links->overlap;
  flesh_communicator_begin(s->links->communicator, all->count, all->ranks, exchange);
  flesh_communicator_end(s->links->communicator);
}

static int exchange_counts(search *s)
{
  const int count = s->links->overlap.count;
  exchange(s, &(flesh_exchange){1, NULL, NULL, s->counts, s->counts + count});
  for (int n = 0; n < count; n++) {
    s->first_sent[n + 1] = s->first_sent[n] + (int)s->counts[n];
    s->first_received[n + 1] = s->first_received[n] + (int)s->counts[count + n];
  }
  s->received = flesh_malloc(((size_t)s->first_received[count] + 1) * sizeof *s->received);
  return s->received ? FLESH_OK : FLESH_ERR_MEMORY;
}

/* Lists nodes between ranks neither of which is the owner, from the numbers received from the owners. */
static void link_others(search *s)
{
  const flesh_halo *all = &s->links->overlap;
  const double *next = s->received;
  for (int k = 0; k < all->first_ghost[all->count]; k++) {
    const int i = all->ghosts[k];
    if (s->is[i] == 0) continue;
    for (int left = (int)*next++; left > 0; left--, next++) share_rows(s, i, (int)*next / 4, (int)*next % 4);
  }
}

static int make(search *s, narrowed *self)
{
  flesh_links *links = &self->links;
  flesh_halo *const halos[] = {&links->halo, &links->overlap, &links->rows};
  int status = FLESH_OK;
  links->communicator = s->links->communicator;
  self->left_out = flesh_malloc((size_t)s->team->overlap + 1);
  if (!self->left_out) return FLESH_ERR_MEMORY;
  for (int i = 0; i < s->team->overlap; i++) self->left_out[i] = s->is[i] == 0;
  for (int k = 0; k < 3 && !status; k++) status = flesh_halo_create(links->communicator, &s->shared[k], halos[k]);
  if (status) return status;
  self->team = *s->team;
  self->team.narrows = 0;
  self->team.left_out = self->left_out;
  self->team.data = links;
  self->team.neighbours = flesh_links_neighbours(links, s->team->rank);
  return FLESH_OK;
}

/* Finds the lists. A failure on one rank makes all fail before the next exchange. */
static int find(search *s, const uint8_t *needed, narrowed *self)
{
  int status = flesh_team_agree(s->team, self ? open_search(needed, s) : FLESH_ERR_MEMORY);
  if (status) return status;
  flesh_halo_tell(&s->links->overlap, s->links->communicator, &(flesh_team_vector){1, 1, NULL, s->is, 1});
  link_owners(s);
  s->sent = flesh_malloc((list_sent(s) + 1) * sizeof *s->sent);
  status = flesh_team_agree(s->team, s->sent ? FLESH_OK : FLESH_ERR_MEMORY);
  if (status) return status;
  list_sent(s);
  status = flesh_team_agree(s->team, exchange_counts(s));
  if (status) return status;
  exchange(s, &(flesh_exchange){1, s->first_sent, s->first_received, s->sent, s->received});
  link_others(s);
  return flesh_team_agree(s->team, make(s, self));
}

int flesh_links_narrow(const flesh_team *team, const uint8_t *needed, const flesh_team **narrow)
{
  narrowed *self = flesh_calloc(1, sizeof *self);
  search s = {.team = team, .links = team->data};
  const int status = find(&s, needed, self);
  close_search(&s);
  *narrow = self ? &self->team : NULL;
  if (!status) return FLESH_OK;
  flesh_links_narrow_end(narrow);
  return flesh_fail(status, "no memory for the exchanges of %d nodes", team->nodes);
}

void flesh_links_narrow_end(const flesh_team **narrow)
{
  narrowed *self = (narrowed *)*narrow;
  *narrow = NULL;
  if (!self) return;
  flesh_links_clear(&self->links);
  flesh_free(self->left_out);
  flesh_free(self);
}
