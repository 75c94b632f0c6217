/* ranks_alone.c: replaces ranks_mpi.c in a build without MPI, which cannot run on ranks. */
#include "base/error.h"
#include "run/ranks.h"

int flesh_ranks_join(flesh_communicator **communicator, int *here)
{
  *communicator = NULL;
  *here = 1;
  return flesh_fail(FLESH_ERR_ARGUMENT,
                    "a launcher of MPI started this, but flesh is built without MPI; configure with -Dmpi=enabled");
}

int flesh_ranks_split(int takes_part, flesh_communicator **communicator)
{
  (void)takes_part;
  *communicator = NULL;
  return FLESH_OK;
}

void flesh_ranks_send(int to, size_t size, const void *bytes) { (void)to, (void)size, (void)bytes; }

int flesh_ranks_probe(int *from, size_t *size)
{
  *from = 0;
  *size = 0;
  return 0;
}

void flesh_ranks_receive(int from, size_t size, void *bytes) { (void)from, (void)size, (void)bytes; }

void flesh_ranks_leave(flesh_communicator **communicator) { flesh_communicator_destroy(communicator); }
