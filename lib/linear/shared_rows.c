/* shared_rows.c: main nodes that ranks share, and exchanges of their values. */
#include "linear/shared_rows.h"

#include <string.h>

#include "base/error.h"
#include "base/memory.h"

/* Nodes that this rank and another have, in an order that both know: those in the team's lists of given and taken nodes. */
typedef struct common {
  const flesh_team_neighbours *neighbours;
  int nodes;  /* number of this rank's nodes */
  int *given; /* [nodes] 1 + the last rank so far that is given the node */
  int *first; /* [ranks+1] first node of each rank */
  double *here, *there; /* [first[ranks]] 1: this rank has rows at the node; 1: the other rank has */
} common;

/* Prepares is_common for a rank. */
static void turn_to(const common *c, int rank)
{
  for (int k = c->neighbours->first_given[rank]; k < c->neighbours->first_given[rank + 1]; k++)
    c->given[c->neighbours->given[k]] = rank + 1;
}

static int is_common(const common *c, int rank, int k)
{
  const int node = c->neighbours->taken[k];
  return node < c->nodes && c->given[node] == rank + 1;
}

/* Finds whether this rank and the other have rows at each common node. */
static void exchange_flags(const flesh_row_lists *lists, const int *place_of, const flesh_team *team, const common *c)
{
  for (int r = 0, count = 0; r < c->neighbours->count; r++) {
    turn_to(c, r);
    for (int k = c->neighbours->first_taken[r]; k < c->neighbours->first_taken[r + 1]; k++) {
      if (!is_common(c, r, k)) continue;
      const int p = place_of[c->neighbours->taken[k]];
      c->here[count++] = lists->main[p] && lists->start[p + 1] > lists->start[p];
    }
    c->first[r + 1] = count;
  }
  flesh_exchange_now(team, &(flesh_exchange){1, c->first, c->first, c->here, c->there});
}

/* Calls add(self, rank of the list, place) for every node at which both ranks have rows. */
static void for_shared(flesh_shared_rows *self, const int *place_of, const common *c, int *marks,
                       void (*add)(flesh_shared_rows *self, int rank, int place, int *marks))
{
  for (int r = 0, next = 0; r < c->neighbours->count; r++) {
    turn_to(c, r);
    for (int k = c->neighbours->first_taken[r]; k < c->neighbours->first_taken[r + 1]; k++) {
      if (!is_common(c, r, k)) continue;
      if (c->here[next] > 0 && c->there[next] > 0) add(self, r, place_of[c->neighbours->taken[k]], marks);
      next++;
    }
  }
}

static void mark(flesh_shared_rows *self, int rank, int place, int *marks)
{
  self->count += !marks[place];
  marks[place] = 1;
  self->first[rank + 1]++;
}

static void list(flesh_shared_rows *self, int rank, int place, int *marks)
{
  self->which[self->first[rank + 1]++] = marks[place];
}

static int allocate(flesh_shared_rows *self)
{
  const size_t width = FLESH_SHARED_ROWS_WIDTH, count = (size_t)self->count, all = (size_t)self->first[self->ranks];
  self->nodes = flesh_malloc((count + 1) * sizeof *self->nodes);
  self->which = flesh_malloc((all + 1) * sizeof *self->which);
  self->own = flesh_calloc(2 * width * count + 1, sizeof *self->own);
  self->sent = flesh_calloc(2 * width * all + 1, sizeof *self->sent);
  if (!self->nodes || !self->which || !self->own || !self->sent) return FLESH_ERR_MEMORY;
  self->others = self->own + width * count;
  self->received = self->sent + width * all;
  return FLESH_OK;
}

/* Makes the lists from the exchanged flags; marks [nodes] is zero. */
static int make(flesh_shared_rows *self, const flesh_row_lists *lists, const int *place_of, const common *c, int *marks)
{
  for_shared(self, place_of, c, marks, mark);
  for (int r = 0; r < self->ranks; r++) self->first[r + 1] += self->first[r];
  const int status = allocate(self);
  if (status) return status;
  for (int p = 0, count = 0; p < lists->nodes; p++) {
    if (!marks[p]) continue;
    self->nodes[count] = p;
    marks[p] = count++;
  }
  /* Before this loop first[r + 1] is the place of the next node of rank r; afterwards it is the end of the rank's nodes. */
  for (int r = self->ranks; r > 0; r--) self->first[r] = self->first[r - 1];
  for_shared(self, place_of, c, marks, list);
  return FLESH_OK;
}

/* Makes a node that is main to one rank main to all; main [nodes] is work space. */
static void unite_main(const flesh_row_lists *lists, const int *place_of, const flesh_team *team, double *main)
{
  for (int i = 0; i < team->nodes; i++) main[i] = lists->main[place_of[i]];
  flesh_team_sum_nodes(team, 1, main);
  for (int i = 0; i < team->nodes; i++) lists->main[place_of[i]] = main[i] > 0;
}

int flesh_shared_rows_create(const flesh_row_lists *lists, const int *place_of, const flesh_team *team, int status,
                             flesh_shared_rows *self)
{
  *self = (flesh_shared_rows){.team = team};
  if (!team) return status;
  const size_t ranks = (size_t)(self->ranks = team->neighbours.count), taken = (size_t)team->neighbours.first_taken[ranks];
  common c = {.neighbours = &team->neighbours, .nodes = team->nodes};
  c.given = flesh_calloc((size_t)team->nodes + 1, sizeof *c.given);
  c.first = flesh_calloc(ranks + 1, sizeof *c.first);
  c.here = flesh_malloc((taken + 1) * sizeof *c.here);
  c.there = flesh_malloc((taken + 1) * sizeof *c.there);
  int *marks = flesh_calloc((size_t)team->nodes + 1, sizeof *marks);
  double *main = flesh_malloc((size_t)team->nodes * sizeof *main + 1);
  self->first = flesh_calloc(ranks + 1, sizeof *self->first);
  const int enough = c.given && c.first && c.here && c.there && marks && main && self->first;
  status = flesh_team_agree(team, enough ? status : FLESH_ERR_MEMORY);
  if (!status) {
    unite_main(lists, place_of, team, main);
    exchange_flags(lists, place_of, team, &c);
    status = flesh_team_agree(team, make(self, lists, place_of, &c, marks));
  }
  void *const arrays[] = {c.given, c.first, c.here, c.there, marks, main};
  for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++) flesh_free(arrays[k]);
  return status ? flesh_fail(status, "no memory for rows shared with other ranks") : FLESH_OK;
}

void flesh_shared_rows_clear(flesh_shared_rows *self)
{
  flesh_free(self->nodes);
  flesh_free(self->first);
  flesh_free(self->which);
  flesh_free(self->own); /* `others` is in the same allocation */
  flesh_free(self->sent); /* `received` is in the same allocation */
  *self = (flesh_shared_rows){0};
}

void flesh_shared_rows_begin(const flesh_shared_rows *self, int width)
{
  const size_t numbers = (size_t)width;
  if (!self->ranks) return;
  for (int k = 0; k < self->first[self->ranks]; k++)
    memcpy(self->sent + numbers * (size_t)k, self->own + numbers * (size_t)self->which[k], numbers * sizeof(double));
  flesh_exchange_begin(self->team, &(flesh_exchange){width, self->first, self->first, self->sent, self->received});
}

void flesh_shared_rows_end(const flesh_shared_rows *self, int width)
{
  const size_t numbers = (size_t)width;
  if (!self->ranks) return;
  flesh_exchange_end(self->team);
  memset(self->others, 0, numbers * (size_t)self->count * sizeof *self->others);
  for (int k = 0; k < self->first[self->ranks]; k++) {
    double *to = self->others + numbers * (size_t)self->which[k];
    for (size_t c = 0; c < numbers; c++) to[c] += self->received[numbers * (size_t)k + c];
  }
}
