/* pcg_team.h: conjugate gradients of several ranks, with one sum of all ranks an iteration. */
#ifndef FLESH_LINEAR_PCG_TEAM_H
#define FLESH_LINEAR_PCG_TEAM_H

#include "base/isa.h"
#include "linear/pcg_space.h"

/* Sums over the nodes that an iteration asks for, besides the coarse level's load. */
enum { FLESH_PCG_SUMS = FLESH_PRECONDITIONER_SUMS };

/* Iterates from r = b, x = 0 in `work`'s space. The statuses are those of flesh_pcg. Collective. */
FLESH_PER_ISA int flesh_pcg_in_team(flesh_pcg_work *work, flesh_pcg_result *result);

#endif
