/* preconditioner_kinds.c: what preconditioners are called and which is the default. */
#include <assert.h>
#include <stddef.h>

#include "linear/preconditioner.h"

/* From so many nodes on there is a coarse level. */
enum { FEWEST_NODES = 600 };

const char *const flesh_preconditioner_names[] = {"auto", "two-level", "ic", "jacobi", "none", NULL};
static_assert(sizeof flesh_preconditioner_names / sizeof *flesh_preconditioner_names == FLESH_PRECONDITIONER_NONE + 2,
              "a name of every preconditioner");

const char *flesh_preconditioner_name(flesh_preconditioner kind)
{
  return (unsigned)kind <= FLESH_PRECONDITIONER_NONE ? flesh_preconditioner_names[kind] : NULL;
}

flesh_preconditioner flesh_preconditioner_choose(flesh_preconditioner kind, int nodes)
{
  if (kind != FLESH_PRECONDITIONER_AUTO) return kind;
  return nodes >= FEWEST_NODES ? FLESH_PRECONDITIONER_TWO_LEVEL : FLESH_PRECONDITIONER_IC;
}
