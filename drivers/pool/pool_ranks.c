/* pool_ranks.c: the ranks behind the first, which do what cases they are given. */
#include <signal.h>
#include <stdlib.h>
#include <string.h>

#include "cli/interrupt.h"
#include "pool/pool_places.h"
#include "run/ranks_join.h"

typedef struct helper {
  flesh_places places;
  int told, left, code; /* of a signal; by the order to leave, with this exit code */
} helper;

static void tell(const flesh_pool_head *head, size_t size, const char *behind)
{
  char *bytes = malloc(sizeof *head + size);
  const flesh_pool_head lacks = {.kind = FLESH_POOL_LACKS, .number = head->number};
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
    tell(&(flesh_pool_head){.kind = FLESH_POOL_ENDED, .number = number, .ended = SIGTERM}, 0, NULL);
    return;
  }
  if (h->places.running < h->places.limit) status = flesh_places_start(&h->places, number, &started);
  if (started) return;
  const char *why = status ? flesh_error_text() : "no more processes can be had";
  tell(&(flesh_pool_head){.kind = FLESH_POOL_LACKS, .number = number}, strlen(why) + 1, why);
}

static void obey(helper *h, const flesh_pool_order *order, int jobs, const flesh_pool_cases *cases)
{
  switch (order->kind) {
  case FLESH_POOL_RUN:
    run(h, order->number);
    break;
  case FLESH_POOL_STOP:
    flesh_places_stop(&h->places);
    break;
  case FLESH_POOL_OVER:
    flesh_places_close(&h->places);
    if (flesh_places_open(jobs, cases, &h->places)) h->places.room = h->places.limit = 0;
    tell(&(flesh_pool_head){.kind = FLESH_POOL_DONE}, 0, NULL);
    break;
  default:
    tell(&(flesh_pool_head){.kind = FLESH_POOL_DONE}, 0, NULL);
    h->left = 1;
    h->code = order->number;
  }
}

/* Tells the first rank of a case that has ended here, and of a signal. */
static void attend(helper *h)
{
  flesh_pool_end end;
  flesh_places_wait(&h->places, 2, &end);
  if (end.number >= 0)
    tell(&(flesh_pool_head){FLESH_POOL_ENDED, end.number, end.ended, end.killed, end.seconds}, end.answer.size,
         end.answer.data);
  free(end.answer.data);
  if (!flesh_interrupt_signal() || h->told) return;
  h->told = 1;
  flesh_places_stop(&h->places);
  tell(&(flesh_pool_head){.kind = FLESH_POOL_SIGNALLED, .number = flesh_interrupt_signal()}, 0, NULL);
}

int flesh_pool_serve(int jobs, const flesh_pool_cases *cases)
{
  helper h = {0};
  const int room = flesh_places_fit(jobs, jobs);
  if (flesh_places_open(room, cases, &h.places)) h.places.room = h.places.limit = 0; /* every case is then refused */
  while (!h.left) {
    flesh_pool_order order;
    size_t size;
    int from;
    if (flesh_ranks_probe(&from, &size)) {
      flesh_ranks_receive(from, size, &order);
      obey(&h, &order, room, cases);
    } else attend(&h);
  }
  flesh_places_close(&h.places);
  return h.code;
}
