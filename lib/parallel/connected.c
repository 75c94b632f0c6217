/* connected.c: unites connected pieces of the ranks' meshes through the nodes that ranks share. */
#include "parallel/connected.h"

#include <stdlib.h>
#include <string.h>

#include "base/error.h"

/* Sets label [all] to minus the least number of all pieces connected with each piece, on any rank. For ghost i this
 * rank knows that the pieces own[i] and owners[i] are connected. `label` is followed by work space of the same size. */
static void spread_labels(const flesh_team *team, int all, const int *own, const double *owners, double *label)
{
  double *before = label + all;
  int changed = 1;
  for (int p = 0; p < all; p++) label[p] = -p; /* minus, as maxima are exchanged */
  while (changed) {
    memcpy(before, label, (size_t)all * sizeof *label);
    for (int i = team->own; i < team->nodes; i++) {
      double *a = own[i] < 0 ? NULL : &label[own[i]], *b = &label[(int)owners[i]];
      if (a) *a = *b = *a > *b ? *a : *b;
    }
    flesh_team_largest(team, all, label);
    changed = memcmp(before, label, (size_t)all * sizeof *label) != 0; /* the same bits on all ranks */
  }
}

int flesh_connected_unite(const flesh_team *team, int count, double *room, int *part)
{
  double *owners = room, *counts = room + team->nodes;
  int all, parts = 0;
  const int first = flesh_team_count_before(team, count, counts, &all);
  double *label = malloc(2 * ((size_t)all + 1) * sizeof *label);
  int *number = calloc((size_t)all + 1, sizeof *number);
  const int status = flesh_team_agree(team, label && number ? FLESH_OK : FLESH_ERR_MEMORY);
  if (!status) {
    for (int i = 0; i < team->nodes; i++) {
      if (part[i] >= 0) part[i] += first;
      owners[i] = part[i];
    }
    flesh_team_update_ghosts_of(team, 1, owners);
    spread_labels(team, all, part, owners, label);
    for (int p = 0; p < all; p++) /* the least piece of a part comes first */
      number[p] = label[p] == -p ? parts++ : number[(int)-label[p]];
    for (int i = 0; i < team->nodes; i++) part[i] = number[part[i] >= 0 ? part[i] : (int)owners[i]];
  }
  free(label);
  free(number);
  return status ? status : parts;
}
