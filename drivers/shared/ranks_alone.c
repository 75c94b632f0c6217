/* ranks_alone.c: where flesh is built without MPI, it cannot run on ranks. */
#include "base/error.h"
#include "shared/ranks_join.h"

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

void flesh_ranks_leave(flesh_communicator **communicator) { flesh_communicator_destroy(communicator); }
