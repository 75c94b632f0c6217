/* shared_rows.c: which main nodes ranks share, and the exchange of what they have there. */
#include "linear/shared_rows.h"

#include <string.h>

#include "base/error.h"
#include "base/memory.h"

/* Nodes that this rank and another have, in an order that both know: those of the team's lists that are given and taken. */
typedef struct common {
  const flesh_team_reach *reach;
  int nodes;  /* of this rank */
  int *given; /* [nodes] 1 + the last of the ranks at hand that is given each */
} common;

/* Before is_common for a rank. */
static void turn_to(const common *c, int rank)
{
  for (int k = c->reach->first_given[rank]; k < c->reach->first_given[rank + 1]; k++)
    c->given[c->reach->given[k]] = rank + 1;
}

static int is_common(const common *c, int rank, int k)
{
  const int node = c->reach->taken[k];
  return node < c->nodes && c->given[node] == rank + 1;
}

/* Whether this rank has rows at each common node and, after the exchange, whether the other has. `flags` [2*taken]. */
static void exchange_flags(const flesh_row_lists *lists, const int *place_of, const flesh_team *team, const common *c,
                           flesh_team_message *messages, double *flags)
{
  const flesh_team_reach *reach = &team->reach;
  double *send = flags, *receive = flags + reach->first_taken[reach->count];
  for (int r = 0; r < reach->count; r++) {
    int count = 0;
    turn_to(c, r);
    for (int k = reach->first_taken[r]; k < reach->first_taken[r + 1]; k++) {
      if (!is_common(c, r, k)) continue;
      const int p = place_of[reach->taken[k]];
      send[count++] = lists->main[p] && lists->start[p + 1] > lists->start[p];
    }
    messages[r] = (flesh_team_message){reach->ranks[r], count, count, send, receive};
    send += count;
    receive += count;
  }
  team->operations->exchange_begin(team->data, reach->count, messages);
  team->operations->exchange_end(team->data);
}

/* Calls add(self, rank of the list, place) for every node that both ranks have rows at. */
static void for_shared(flesh_shared_rows *self, const int *place_of, const common *c, const flesh_team_message *messages,
                       int *marks, void (*add)(flesh_shared_rows *self, int rank, int place, int *marks))
{
  const flesh_team_reach *reach = c->reach;
  for (int r = 0; r < reach->count; r++) {
    turn_to(c, r);
    for (int k = reach->first_taken[r], next = 0; k < reach->first_taken[r + 1]; k++) {
      if (!is_common(c, r, k)) continue;
      if (messages[r].send[next] > 0 && messages[r].receive[next] > 0) add(self, r, place_of[reach->taken[k]], marks);
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

/* The lists, from the flags that were exchanged. marks [nodes] is zero. */
static int make(flesh_shared_rows *self, const flesh_row_lists *lists, const int *place_of, const common *c, int *marks)
{
  for_shared(self, place_of, c, self->messages, marks, mark);
  for (int r = 0; r < self->ranks; r++) self->first[r + 1] += self->first[r];
  const int status = allocate(self);
  if (status) return status;
  for (int p = 0, count = 0; p < lists->nodes; p++) {
    if (!marks[p]) continue;
    self->nodes[count] = p;
    marks[p] = count++;
  }
  /* first[r + 1] is where the next of rank r is put, and ends where those of the rank do. */
  for (int r = self->ranks; r > 0; r--) self->first[r] = self->first[r - 1];
  for_shared(self, place_of, c, self->messages, marks, list);
  return FLESH_OK;
}

int flesh_shared_rows_create(const flesh_row_lists *lists, const int *place_of, const flesh_team *team,
                             flesh_shared_rows *self)
{
  *self = (flesh_shared_rows){.team = team};
  if (!team) return FLESH_OK;
  const flesh_team_reach *reach = &team->reach;
  const common c = {reach, team->nodes, flesh_calloc((size_t)team->nodes + 1, sizeof *c.given)};
  const size_t ranks = (size_t)(self->ranks = reach->count), taken = (size_t)reach->first_taken[ranks];
  double *flags = flesh_malloc((2 * taken + 1) * sizeof *flags);
  int *marks = flesh_calloc((size_t)lists->nodes + 1, sizeof *marks);
  self->first = flesh_calloc(ranks + 1, sizeof *self->first);
  self->messages = flesh_calloc(ranks + 1, sizeof *self->messages);
  const int failed = !flags || !marks || !c.given || !self->first || !self->messages;
  int status = flesh_team_agree(team, failed ? FLESH_ERR_MEMORY : FLESH_OK);
  if (!status) {
    exchange_flags(lists, place_of, team, &c, self->messages, flags);
    status = flesh_team_agree(team, make(self, lists, place_of, &c, marks));
  }
  flesh_free(flags);
  flesh_free(marks);
  flesh_free(c.given);
  return status ? flesh_fail(status, "no memory for what %d rows share with other ranks", lists->rows) : FLESH_OK;
}

void flesh_shared_rows_clear(flesh_shared_rows *self)
{
  flesh_free(self->nodes);
  flesh_free(self->first);
  flesh_free(self->which);
  flesh_free(self->own); /* and others */
  flesh_free(self->sent); /* and received */
  flesh_free(self->messages);
  *self = (flesh_shared_rows){0};
}

size_t flesh_shared_rows_memory(const flesh_shared_rows *self)
{
  if (!self->first) return 0;
  const size_t width = FLESH_SHARED_ROWS_WIDTH, ranks = (size_t)self->ranks;
  return (size_t)self->count * (sizeof(int) + 2 * width * sizeof(double)) +
         (size_t)self->first[ranks] * (sizeof(int) + 2 * width * sizeof(double)) +
         ranks * (sizeof(int) + sizeof *self->messages);
}

void flesh_shared_rows_begin(const flesh_shared_rows *self, int width)
{
  const size_t numbers = (size_t)width;
  if (!self->ranks) return;
  for (int k = 0; k < self->first[self->ranks]; k++)
    memcpy(self->sent + numbers * (size_t)k, self->own + numbers * (size_t)self->which[k], numbers * sizeof(double));
  for (int r = 0; r < self->ranks; r++) {
    const int from = self->first[r], count = width * (self->first[r + 1] - from);
    self->messages[r] = (flesh_team_message){self->team->reach.ranks[r], count, count,
                                             self->sent + numbers * (size_t)from,
                                             self->received + numbers * (size_t)from};
  }
  self->team->operations->exchange_begin(self->team->data, self->ranks, self->messages);
}

void flesh_shared_rows_end(const flesh_shared_rows *self, int width)
{
  const size_t numbers = (size_t)width;
  if (!self->ranks) return;
  self->team->operations->exchange_end(self->team->data);
  memset(self->others, 0, numbers * (size_t)self->count * sizeof *self->others);
  for (int k = 0; k < self->first[self->ranks]; k++) {
    double *to = self->others + numbers * (size_t)self->which[k];
    for (size_t c = 0; c < numbers; c++) to[c] += self->received[numbers * (size_t)k + c];
  }
}
