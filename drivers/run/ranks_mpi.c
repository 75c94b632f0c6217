/* ranks_mpi.c: begins and ends MPI, and exchanges messages. */
#include <mpi.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "run/ranks.h"

int flesh_ranks_join(flesh_communicator **communicator, int *here)
{
  MPI_Comm world = MPI_COMM_WORLD, machine;
  int got;
  *communicator = NULL;
  if (MPI_Init_thread(NULL, NULL, MPI_THREAD_FUNNELED, &got)) return flesh_fail(FLESH_ERR_ARGUMENT, "MPI cannot begin");
  MPI_Comm_split_type(world, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &machine);
  MPI_Comm_size(machine, here);
  MPI_Comm_free(&machine);
  return flesh_communicator_create(&world, communicator);
}

int flesh_ranks_split(int takes_part, flesh_communicator **communicator)
{
  MPI_Comm some;
  *communicator = NULL;
  MPI_Comm_split(MPI_COMM_WORLD, takes_part ? 0 : MPI_UNDEFINED, 0, &some);
  if (!takes_part) return FLESH_OK;
  const int status = flesh_communicator_create(&some, communicator);
  MPI_Comm_free(&some);
  return status;
}

/* A message that was sent but perhaps not yet received. */
typedef struct sent {
  struct sent *next;
  MPI_Request request;
  char bytes[];
} sent;
static sent *pending;

enum { TAG = 7 };

/* Frees the messages that have been received; with `wait`, waits for all of them. */
static void reap(int wait)
{
  for (sent **at = &pending; *at;) {
    sent *message = *at;
    int done = 1;
    if (wait) MPI_Wait(&message->request, MPI_STATUS_IGNORE);
    else MPI_Test(&message->request, &done, MPI_STATUS_IGNORE);
    if (done) *at = message->next, free(message);
    else at = &message->next;
  }
}

void flesh_ranks_send(int to, size_t size, const void *bytes)
{
  sent *message = malloc(sizeof *message + size);
  reap(0);
  if (!message) {
    MPI_Send(bytes, (int)size, MPI_BYTE, to, TAG, MPI_COMM_WORLD);
    return;
  }
  memcpy(message->bytes, bytes, size);
  MPI_Isend(message->bytes, (int)size, MPI_BYTE, to, TAG, MPI_COMM_WORLD, &message->request);
  message->next = pending;
  pending = message;
}

int flesh_ranks_probe(int *from, size_t *size)
{
  MPI_Status status;
  int there, count = 0;
  MPI_Iprobe(MPI_ANY_SOURCE, TAG, MPI_COMM_WORLD, &there, &status);
  if (there) MPI_Get_count(&status, MPI_BYTE, &count);
  *from = there ? status.MPI_SOURCE : 0;
  *size = (size_t)count;
  return there;
}

void flesh_ranks_receive(int from, size_t size, void *bytes)
{
  MPI_Recv(bytes, (int)size, MPI_BYTE, from, TAG, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
}

void flesh_ranks_leave(flesh_communicator **communicator)
{
  int begun, ended;
  flesh_communicator_destroy(communicator);
  MPI_Initialized(&begun);
  MPI_Finalized(&ended);
  if (!begun || ended) return;
  reap(1);
  MPI_Finalize();
}
