/* communicator_alone.c: a single rank, for builds without MPI. */
#include "base/error.h"
#include "base/memory.h"
#include "parallel/communicator.h"

struct flesh_communicator {
  int nothing;
};

int flesh_communicator_create(const void *mpi_comm, flesh_communicator **communicator)
{
  FLESH_NEED({communicator, "communicator"});
  *communicator = NULL;
  if (mpi_comm)
    return flesh_fail(FLESH_ERR_ARGUMENT, "flesh is built without MPI: configure with -Dmpi=enabled, or pass no MPI_Comm");
  *communicator = flesh_calloc(1, sizeof **communicator);
  return *communicator ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for a communicator");
}

void flesh_communicator_destroy(flesh_communicator **communicator)
{
  if (!communicator) return;
  flesh_free(*communicator);
  *communicator = NULL;
}

int flesh_communicator_rank(const flesh_communicator *communicator)
{
  (void)communicator;
  return 0;
}

int flesh_communicator_size(const flesh_communicator *communicator)
{
  (void)communicator;
  return 1;
}

flesh_communicator_figures flesh_communicator_exchanged(const flesh_communicator *communicator)
{
  (void)communicator;
  return (flesh_communicator_figures){0};
}

void flesh_communicator_sum(flesh_communicator *communicator, int count, double *numbers)
{
  (void)communicator, (void)count, (void)numbers;
}

void flesh_communicator_largest(flesh_communicator *communicator, int count, double *numbers)
{
  (void)communicator, (void)count, (void)numbers;
}

int flesh_communicator_agree(flesh_communicator *communicator, int status)
{
  FLESH_NEED({communicator, "communicator"});
  return status;
}

const void *flesh_communicator_comm(const flesh_communicator *communicator)
{
  (void)communicator;
  return NULL;
}

void flesh_communicator_spread(flesh_communicator *communicator, int count, int *numbers)
{
  (void)communicator, (void)count, (void)numbers;
}

int flesh_communicator_reserve(flesh_communicator *communicator, int ranks)
{
  (void)communicator, (void)ranks;
  return FLESH_OK;
}

void flesh_communicator_begin(flesh_communicator *communicator, int count, const int *ranks,
                              const flesh_exchange *exchange)
{
  (void)communicator, (void)count, (void)ranks, (void)exchange;
}

void flesh_communicator_end(flesh_communicator *communicator) { (void)communicator; }
