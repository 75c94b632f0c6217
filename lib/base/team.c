/* team.c: what the operations of a team do where there may be none. */
#include "base/team.h"

#include <stddef.h>
#include <string.h>

void flesh_team_sum(const flesh_team *team, int count, double *numbers)
{
  if (team) team->operations->sum(team->data, count, numbers);
}

void flesh_team_largest(const flesh_team *team, int count, double *numbers)
{
  if (team) team->operations->largest(team->data, count, numbers);
}

int flesh_team_agree(const flesh_team *team, int status)
{
  return team ? team->operations->agree(team->data, status) : status;
}

int flesh_team_sum_agreed(const flesh_team *team, int status, int count, double *numbers)
{
  if (!team) return status;
  double all[FLESH_TEAM_AGREED + 1];
  memcpy(all, numbers, (size_t)count * sizeof *all);
  all[count] = status != FLESH_OK;
  team->operations->sum(team->data, count + 1, all);
  if (all[count] > 0) return team->operations->agree(team->data, status);
  memcpy(numbers, all, (size_t)count * sizeof *all);
  return FLESH_OK;
}

int flesh_team_any(const flesh_team *team, int here)
{
  double any = here != 0;
  flesh_team_largest(team, 1, &any);
  return any > 0;
}

void flesh_team_share(const flesh_team *team, double *vector)
{
  if (team) team->operations->share(team->data, &(flesh_team_vector){3, 3, NULL, vector, 0});
}

void flesh_team_collect(const flesh_team *team, double *vector)
{
  if (team) team->operations->collect(team->data, &(flesh_team_vector){3, 3, NULL, vector, 0});
}

int flesh_team_narrow(const flesh_team *team, const uint8_t *needed, const flesh_team **narrow)
{
  *narrow = team;
  return team && team->narrows ? team->operations->narrow(team, needed, narrow) : FLESH_OK;
}

void flesh_team_narrow_end(const flesh_team **narrow)
{
  if (*narrow && (*narrow)->left_out) (*narrow)->operations->narrow_end(narrow);
  *narrow = NULL;
}

int flesh_team_own(const flesh_team *team, int nodes) { return team ? team->own : nodes; }

double flesh_team_all(const flesh_team *team, int nodes) { return team ? team->all : nodes; }
