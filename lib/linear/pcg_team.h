/* pcg_team.h: conjugate gradients of several ranks, with one sum over all ranks per iteration. */
#ifndef FLESH_LINEAR_PCG_TEAM_H
#define FLESH_LINEAR_PCG_TEAM_H

#include "base/isa.h"
#include "linear/pcg_space.h"

/* Number of sums over the nodes that an iteration needs, besides the coarse level's load. */
enum { FLESH_PCG_SUMS = FLESH_PRECONDITIONER_SUMS };

/* Iterates from r = b, x = 0 in `work`'s space. Returns the statuses of flesh_pcg. Collective. */
FLESH_PER_ISA int flesh_pcg_in_team(flesh_pcg_work *work, flesh_pcg_result *result);

#endif
