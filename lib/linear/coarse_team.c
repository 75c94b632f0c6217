/* coarse_team.c: exchanges of the coarse level's pattern and loads, some numbers at a time. */
#include "linear/coarse_team.h"

#include "base/memory.h"

enum { ROOM = 1024 /* numbers that ranks exchange at a time */ };

int flesh_coarse_unite(const flesh_team *team, size_t n, uint8_t *touch)
{
  double *row = team ? flesh_malloc((n + 1) * sizeof *row) : NULL;
  const int status = flesh_team_agree(team, row || !team ? FLESH_OK : FLESH_ERR_MEMORY);
  for (size_t i = 0; team && !status && i < n; i++) {
    for (size_t j = 0; j < n; j++) row[j] = touch[n * i + j];
    flesh_team_largest(team, (int)n, row);
    for (size_t j = 0; j < n; j++) touch[n * i + j] = row[j] > 0;
  }
  flesh_free(row);
  return status;
}

void flesh_coarse_sum(const flesh_team *team, int count, float *x)
{
  double some[ROOM];
  for (int begin = 0; team && begin < count; begin += ROOM) {
    const int size = count - begin < ROOM ? count - begin : ROOM;
    for (int k = 0; k < size; k++) some[k] = x[begin + k];
    flesh_team_sum(team, size, some);
    for (int k = 0; k < size; k++) x[begin + k] = (float)some[k];
  }
}
