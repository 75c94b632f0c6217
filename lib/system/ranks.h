/* ranks.h: a system on the part of a body that a rank computes (parallel/rank_part.h). Its effects and constraints are
 * those of the rank's tets and nodes; residuals that it returns are collected (base/team.h), and potentials and energies
 * are sums over all ranks. Jacobians stay partial: the matrix of the body is the sum of those of the ranks. Calls of the
 * system are then collective, and all ranks get the same status. */
#ifndef FLESH_SYSTEM_RANKS_H
#define FLESH_SYSTEM_RANKS_H

#include "base/team.h"
#include "flesh/system.h"

/* Returns the team of the system's part; NULL: there is none, and the rank is alone. */
const flesh_team *flesh_system_team(const flesh_system *system);

/* Checks that ranks can share the effect. FLESH_ERR_ARGUMENT if it is no sum over tets and cannot be restricted to a part,
 * or has internal variables of its tets. */
int flesh_system_check_shared(const flesh_effect *effect);
/* Checks all effects of a system that has a team in the same way. */
int flesh_system_check_team(const flesh_system *system);

#endif
