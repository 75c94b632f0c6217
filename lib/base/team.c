/* team.c: calls the operations of a team, or does without if there is none. */
#include "base/team.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "base/error.h"

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
  double all[count + 1];
  memset(all, 0, sizeof all); /* a rank that has failed may have no numbers */
  if (!status) memcpy(all, numbers, (size_t)count * sizeof *all);
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

int flesh_ask_together(const flesh_team *team, int (*ask)(void *data), void *data)
{
  const unsigned long said = flesh_fail_count();
  const int status = ask ? ask(data) : FLESH_OK;
  if (status < 0 && said == flesh_fail_count()) flesh_fail(status, "%s", flesh_status_text(status));
  return ask ? flesh_team_agree(team, status) : FLESH_OK;
}

double flesh_team_total(const flesh_team *team, double number)
{
  flesh_team_sum(team, 1, &number);
  return number;
}

double flesh_team_least(const flesh_team *team, double number)
{
  number = -number;
  flesh_team_largest(team, 1, &number);
  return -number;
}

double flesh_team_argmax(const flesh_team *team, double *value, double label)
{
  double most = *value;
  flesh_team_largest(team, 1, &most);
  if (*value != most && !isnan(*value)) label = -INFINITY;
  flesh_team_largest(team, 1, &label);
  *value = most;
  return label;
}

void flesh_team_take_farthest(const flesh_team *team, double value, int count, double *numbers)
{
  if (!team) return;
  const int here = flesh_team_argmax(team, &value, -team->rank) == -team->rank;
  for (int k = 0; k < count && !here; k++) numbers[k] = 0;
  flesh_team_sum(team, count, numbers);
}

int flesh_team_count_before(const flesh_team *team, int here, double *room, int *all)
{
  int before = 0;
  for (int r = 0; r < team->ranks; r++) room[r] = r == team->rank ? here : 0;
  flesh_team_sum(team, team->ranks, room);
  *all = 0;
  for (int r = 0; r < team->ranks; r++) {
    if (r == team->rank) before = *all;
    *all += (int)room[r];
  }
  return before;
}

void flesh_team_count_ranks(const flesh_team *team, int nodes, int width, double *w)
{
  for (int k = 0; k < width * nodes; k++) w[k] = 1;
  flesh_team_sum_nodes(team, width, w);
}

void flesh_team_unite_boxes(const flesh_team *team, double low[3], double high[3])
{
  double ends[6];
  for (int c = 0; c < 3; c++) ends[c] = -low[c], ends[3 + c] = high[c];
  flesh_team_largest(team, 6, ends);
  for (int c = 0; c < 3; c++) low[c] = -ends[c], high[c] = ends[3 + c];
}

void flesh_team_update_ghosts(const flesh_team *team, double *vector) { flesh_team_update_ghosts_of(team, 3, vector); }

void flesh_team_add_ghosts(const flesh_team *team, double *vector)
{
  if (team) team->operations->add_ghosts(team->data, &(flesh_team_vector){3, 3, NULL, vector, 0});
}

void flesh_team_update_ghosts_of(const flesh_team *team, int width, double *values)
{
  if (team) team->operations->update_ghosts(team->data, &(flesh_team_vector){width, width, NULL, values, 0});
}

void flesh_team_update_overlap(const flesh_team *team, int width, double *values)
{
  if (team) team->operations->update_ghosts(team->data, &(flesh_team_vector){width, width, NULL, values, 1});
}

static void sum_at(const flesh_team *team, int overlap, int width, double *values)
{
  const flesh_team_vector vector = {width, width, NULL, values, overlap};
  if (!team) return;
  team->operations->add_ghosts(team->data, &vector);
  team->operations->update_ghosts(team->data, &vector);
}

void flesh_team_sum_nodes(const flesh_team *team, int width, double *values) { sum_at(team, 0, width, values); }

void flesh_team_sum_overlap(const flesh_team *team, int width, double *values) { sum_at(team, 1, width, values); }

void flesh_exchange_begin(const flesh_team *team, const flesh_exchange *exchange)
{
  team->operations->exchange_begin(team->data, team->neighbours.count, team->neighbours.ranks, exchange);
}

void flesh_exchange_end(const flesh_team *team) { team->operations->exchange_end(team->data); }

void flesh_exchange_now(const flesh_team *team, const flesh_exchange *exchange)
{
  flesh_exchange_begin(team, exchange);
  flesh_exchange_end(team);
}

void flesh_exchange_counts(const flesh_team *team, const int *first_sent, double *counts, int *first_received)
{
  const int ranks = team->neighbours.count;
  for (int r = 0; r < ranks; r++) counts[r] = first_sent[r + 1] - first_sent[r];
  flesh_exchange_now(team, &(flesh_exchange){1, NULL, NULL, counts, counts + ranks});
  first_received[0] = 0;
  for (int r = 0; r < ranks; r++) first_received[r + 1] = first_received[r] + (int)counts[ranks + r];
}

int flesh_team_narrow(const flesh_team *team, int status, const uint8_t *needed, const flesh_team **narrow)
{
  *narrow = team;
  status = flesh_team_agree(team, status);
  return !status && team && team->narrows ? team->operations->narrow(team, needed, narrow) : status;
}

void flesh_team_narrow_end(const flesh_team **narrow)
{
  if (*narrow && (*narrow)->left_out) (*narrow)->operations->narrow_end(narrow);
  *narrow = NULL;
}

int flesh_team_own(const flesh_team *team, int nodes) { return team ? team->own : nodes; }

double flesh_team_all(const flesh_team *team, int nodes) { return team ? team->all : nodes; }
