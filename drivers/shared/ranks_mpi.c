/* ranks_mpi.c: begin and end of MPI. */
#include <mpi.h>

#include "base/error.h"
#include "shared/ranks_join.h"

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

void flesh_ranks_leave(flesh_communicator **communicator)
{
  int begun, ended;
  flesh_communicator_destroy(communicator);
  MPI_Initialized(&begun);
  MPI_Finalized(&ended);
  if (begun && !ended) MPI_Finalize();
}
