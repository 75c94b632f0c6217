/* pool.c: hands cases out to processes on this machine and to other ranks; runs the ranks behind the first, which do
 * the cases that they are given. */
#include "pool/pool.h"

#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/error.h"
#include "cli/interrupt.h"
#include "pool/pool_slots.h"
#include "run/ranks.h"

struct flesh_pool {
  flesh_ranks *ranks; /* NULL: none */
  flesh_slots slots;
  int *busy;          /* [ranks] number of cases that each other rank has */
  int jobs, away;     /* limit of cases at a time on each rank; cases on all other ranks */
  int stopped;        /* the processes know of a signal */
  flesh_text last;    /* answer of the end reported last */
};

int flesh_pool_jobs(const flesh_ranks *ranks, int given)
{
  const long processors = sysconf(_SC_NPROCESSORS_ONLN);
  return given > 0 ? given : ranks || processors < 1 ? 1 : (int)processors;
}

int flesh_pool_slots(const flesh_ranks *ranks, int jobs, int count)
{
  const int here = flesh_slots_fit(jobs, count);
  const double all = ranks ? (double)here * ranks->count : here;
  return all > count && count > 0 ? count : (int)all;
}

int flesh_pool_open(flesh_ranks *ranks, int jobs, int count, const flesh_pool_cases *cases, flesh_pool **pool)
{
  flesh_pool *self = *pool = calloc(1, sizeof *self);
  if (!self) return flesh_no_memory();
  self->ranks = ranks;
  self->jobs = jobs;
  if (ranks) self->busy = calloc((size_t)ranks->count, sizeof *self->busy);
  int status = flesh_slots_open(flesh_slots_fit(jobs, count), cases, &self->slots);
  if (!status && ranks && !self->busy) status = flesh_no_memory();
  if (status) flesh_pool_close(pool);
  return status;
}

static void order_all(const flesh_ranks *ranks, int kind, int number)
{
  const flesh_pool_message order = {.kind = kind, .number = number};
  for (int r = 1; ranks && r < ranks->count; r++) flesh_ranks_send(r, sizeof order, &order);
}

/* Receives the next message: its head, and the rest as a text. Returns 0 if there is none. Adopts a signal to another
 * rank, as it may come while another message is waited for. */
static int receive(flesh_pool_message *head, flesh_text *behind, int *from)
{
  size_t size;
  if (!flesh_ranks_probe(from, &size)) return 0;
  char *bytes = malloc(size);
  if (!bytes) return 0; /* tries again when there is memory */
  flesh_ranks_receive(*from, size, bytes);
  memcpy(head, bytes, sizeof *head);
  if (head->kind == FLESH_POOL_SIGNALLED) flesh_interrupt_adopt(head->number);
  flesh_text_append(behind, bytes + sizeof *head, size - sizeof *head);
  free(bytes);
  return 1;
}

/* Discards messages of the other ranks until `left` of them have said that they are done. */
static void discard_until_done(int left)
{
  while (left > 0) {
    flesh_pool_message head;
    flesh_text behind = {0};
    int from;
    if (receive(&head, &behind, &from)) left -= head.kind == FLESH_POOL_DONE;
    else usleep(1000);
    free(behind.data);
  }
}

typedef struct helper {
  flesh_slots slots;
  int signalled, left, code; /* the first rank knows of a signal; ordered to leave, with this exit code */
} helper;

static void report(const flesh_pool_message *head, size_t size, const char *behind)
{
  char *bytes = malloc(sizeof *head + size);
  const flesh_pool_message lacks = {.kind = FLESH_POOL_LACKS, .number = head->number};
  if (bytes) memcpy(bytes, head, sizeof *head);
  if (bytes && size) memcpy(bytes + sizeof *head, behind, size);
  if (bytes) flesh_ranks_send(0, sizeof *head + size, bytes);
  else flesh_ranks_send(0, sizeof lacks, &lacks);
  free(bytes);
}

static void run(helper *h, int number)
{
  int started = 0, status = FLESH_OK;
  if (flesh_interrupt_signal()) {
    report(&(flesh_pool_message){.kind = FLESH_POOL_ENDED, .number = number, .ended = SIGTERM}, 0, NULL);
    return;
  }
  if (h->slots.running < h->slots.limit) status = flesh_slots_start(&h->slots, number, &started);
  if (started) return;
  const char *why = status ? flesh_error_text() : "no more processes can be had";
  report(&(flesh_pool_message){.kind = FLESH_POOL_LACKS, .number = number}, strlen(why) + 1, why);
}

static void carry_out(helper *h, const flesh_pool_message *order, int jobs, const flesh_pool_cases *cases)
{
  switch (order->kind) {
  case FLESH_POOL_RUN:
    run(h, order->number);
    break;
  case FLESH_POOL_STOP:
    flesh_slots_stop(&h->slots);
    break;
  case FLESH_POOL_OVER:
    flesh_slots_close(&h->slots);
    if (flesh_slots_open(jobs, cases, &h->slots)) h->slots.room = h->slots.limit = 0;
    report(&(flesh_pool_message){.kind = FLESH_POOL_DONE}, 0, NULL);
    break;
  default:
    report(&(flesh_pool_message){.kind = FLESH_POOL_DONE}, 0, NULL);
    h->left = 1;
    h->code = order->number;
  }
}

/* Reports a case that has ended here, and a signal, to the first rank. */
static void report_ends(helper *h)
{
  flesh_pool_end end;
  flesh_slots_wait(&h->slots, 2, &end);
  if (end.number >= 0)
    report(&(flesh_pool_message){FLESH_POOL_ENDED, end.number, end.ended, end.killed, end.seconds}, end.answer.size,
         end.answer.data);
  free(end.answer.data);
  if (!flesh_interrupt_signal() || h->signalled) return;
  h->signalled = 1;
  flesh_slots_stop(&h->slots);
  report(&(flesh_pool_message){.kind = FLESH_POOL_SIGNALLED, .number = flesh_interrupt_signal()}, 0, NULL);
}

/* Works as a rank behind the first until it is ordered to leave. Returns the exit code of that order. */
static int serve(int jobs, const flesh_pool_cases *cases)
{
  helper h = {0};
  const int room = flesh_slots_fit(jobs, jobs);
  if (flesh_slots_open(room, cases, &h.slots)) h.slots.room = h.slots.limit = 0; /* every case is then refused */
  while (!h.left) {
    flesh_pool_message order;
    size_t size;
    int from;
    if (flesh_ranks_probe(&from, &size)) {
      flesh_ranks_receive(from, size, &order);
      carry_out(&h, &order, room, cases);
    } else report_ends(&h);
  }
  flesh_slots_close(&h.slots);
  return h.code;
}

void flesh_pool_close(flesh_pool **pool)
{
  flesh_pool *self = *pool;
  if (!self) return;
  order_all(self->ranks, FLESH_POOL_OVER, 0);
  discard_until_done(self->ranks ? self->ranks->count - 1 : 0);
  flesh_slots_close(&self->slots);
  free(self->busy);
  free(self->last.data);
  free(self);
  *pool = NULL;
}

int flesh_pool_lead(flesh_ranks *ranks, const char *name, int status, int jobs, const flesh_pool_cases *cases,
                    int (*lead)(void *data), void *data)
{
  status = flesh_ranks_agree(ranks, status);
  if (status) return flesh_ranks_fail(ranks, name, status);
  if (!flesh_ranks_first(ranks)) return serve(jobs, cases);
  const int code = lead(data);
  order_all(ranks, FLESH_POOL_LEAVE, code);
  discard_until_done(ranks ? ranks->count - 1 : 0);
  return code;
}

int flesh_pool_stand_by(void)
{
  const flesh_pool_cases none = {0};
  return serve(1, &none);
}

void flesh_pool_listen(const flesh_ranks *ranks)
{
  flesh_pool_message head;
  flesh_text behind = {0};
  int from;
  if (!ranks || ranks->all <= ranks->count || !flesh_ranks_first(ranks)) return;
  receive(&head, &behind, &from);
  free(behind.data);
}

void flesh_pool_dismiss(const flesh_ranks *ranks, int code)
{
  const flesh_pool_message leave = {.kind = FLESH_POOL_LEAVE, .number = code};
  if (!ranks || !flesh_ranks_first(ranks)) return;
  for (int r = ranks->count; r < ranks->all; r++) flesh_ranks_send(r, sizeof leave, &leave);
  discard_until_done(ranks->all - ranks->count);
}

/* Returns a rank behind the first with a free slot and the fewest cases; 0 if none has a slot. */
static int free_rank(const flesh_pool *pool)
{
  int found = 0;
  for (int r = 1; pool->ranks && r < pool->ranks->count; r++)
    if (pool->busy[r] < pool->jobs && (!found || pool->busy[r] < pool->busy[found])) found = r;
  return found;
}

int flesh_pool_has_room(const flesh_pool *pool)
{
  return pool->slots.running < pool->slots.limit || free_rank(pool) > 0;
}

int flesh_pool_start(flesh_pool *pool, int number, int *started)
{
  const int rank = free_rank(pool), here = pool->slots.running < pool->slots.limit;
  if (here && (!rank || pool->slots.running <= pool->busy[rank]))
    return flesh_slots_start(&pool->slots, number, started);
  const flesh_pool_message order = {.kind = FLESH_POOL_RUN, .number = number};
  flesh_ranks_send(rank, sizeof order, &order);
  pool->busy[rank]++;
  pool->away++;
  *started = 1;
  return FLESH_OK;
}

/* Receives a message; returns whether it says that a case of another rank has ended. */
static int receive_end(flesh_pool *pool, flesh_pool_end *end, int *status)
{
  flesh_pool_message head;
  int from;
  if (!pool->ranks || !receive(&head, &pool->last, &from)) return 0;
  if (head.kind == FLESH_POOL_SIGNALLED) return 0;
  pool->busy[from]--;
  pool->away--;
  if (head.kind == FLESH_POOL_LACKS)
    *status = flesh_fail(FLESH_ERR_MEMORY, "rank %d: %s", from, pool->last.data ? pool->last.data : "out of memory");
  *end = (flesh_pool_end){head.number, head.ended, head.killed, head.seconds, pool->last};
  return 1;
}

int flesh_pool_wait(flesh_pool *pool, flesh_pool_end *end)
{
  int status = FLESH_OK;
  free(pool->last.data);
  pool->last = (flesh_text){0};
  *end = (flesh_pool_end){.number = -1};
  if (receive_end(pool, end, &status)) return status;
  /* Messages of other ranks do not end the wait, so it is short. */
  status = flesh_slots_wait(&pool->slots, pool->ranks ? 2 : 200, end);
  pool->last = end->answer;
  if (flesh_interrupt_signal() && !pool->stopped) {
    pool->stopped = 1;
    flesh_slots_stop(&pool->slots);
    order_all(pool->ranks, FLESH_POOL_STOP, 0);
  }
  return status;
}
