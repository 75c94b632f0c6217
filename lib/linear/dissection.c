/* dissection.c: halves the rows at the median of a coordinate; the separator is the rows of one half that meet the other.
 * The coordinate is the one of the three that gives the smallest separator. */
#include "linear/dissection.h"

#include <stdint.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/sort.h"

/* Number of rows that are not dissected further. */
enum { FEW = 24 };

typedef struct place {
  double at;
  int row;
} place;

/* A dissection in the making. */
typedef struct cut {
  const int *starts, *neighbours;
  const double *points;
  flesh_dissection *to;
  int *rows;     /* [n] rows of the ranges that are yet to be dissected */
  uint8_t *side; /* [n] half of the current range in which a row is, or OUT */
  place *places; /* [n] */
  int *trial;    /* [n] */
} cut;

enum { OUT, LOW, HIGH, BETWEEN };

static int compare_places(const void *a, const void *b)
{
  const place *p = a, *q = b;
  if (p->at != q->at) return (p->at > q->at) - (p->at < q->at);
  return (p->row > q->row) - (p->row < q->row);
}

static int meets(const cut *c, int row, int side)
{
  for (int k = c->starts[row]; k < c->starts[row + 1]; k++)
    if (c->side[c->neighbours[k]] == side) return 1;
  return 0;
}

/* Parts rows [count] at the median of a coordinate. Sets their sides, and returns the size of the separator. */
static int try_axis(const cut *c, const int *rows, int count, int axis)
{
  int between[2] = {0, 0};
  for (int k = 0; k < count; k++) c->places[k] = (place){c->points[3 * (size_t)rows[k] + (size_t)axis], rows[k]};
  flesh_sort(c->places, (size_t)count, sizeof *c->places, compare_places);
  for (int k = 0; k < count; k++) c->side[c->places[k].row] = k < count / 2 ? LOW : HIGH;
  for (int k = 0; k < count; k++) {
    const int low = c->side[rows[k]] == LOW;
    between[low] += meets(c, rows[k], low ? HIGH : LOW);
  }
  const int half = between[1] <= between[0] ? LOW : HIGH, other = half == LOW ? HIGH : LOW;
  for (int k = 0; k < count; k++)
    if (c->side[rows[k]] == half && meets(c, rows[k], other)) c->trial[k] = 1;
    else c->trial[k] = 0;
  for (int k = 0; k < count; k++)
    if (c->trial[k]) c->side[rows[k]] = BETWEEN;
  return between[half == LOW];
}

static void add_part(cut *c, const int *rows, int count, int first_below)
{
  flesh_dissection *to = c->to;
  const int part = to->count++, from = to->first[part];
  memcpy(to->order + from, rows, (size_t)count * sizeof *rows);
  to->first[part + 1] = from + count;
  to->parent[part] = -1;
  for (int k = first_below; k < part; k++)
    if (to->parent[k] < 0) to->parent[k] = part;
}

/* Dissects rows [count] of c->rows from `from` on, none of which meets others that are not ordered after them. */
static void dissect(cut *c, int from, int count)
{
  int *rows = c->rows + from, numbers[3] = {0}, best = 0, least = count;
  const int first_below = c->to->count;
  if (count <= FEW) {
    if (count) add_part(c, rows, count, first_below);
    return;
  }
  for (int axis = 0; axis < 3; axis++) {
    const int between = try_axis(c, rows, count, axis);
    if (between < least) least = between, best = axis;
  }
  try_axis(c, rows, count, best);
  /* Low rows first, then high ones, then the separator. */
  for (int k = 0; k < count; k++) numbers[c->side[rows[k]] - LOW]++;
  int next[3] = {0, numbers[0], numbers[0] + numbers[1]};
  for (int k = 0; k < count; k++) c->trial[next[c->side[rows[k]] - LOW]++] = rows[k];
  memcpy(rows, c->trial, (size_t)count * sizeof *rows);
  for (int k = 0; k < count; k++) c->side[rows[k]] = OUT;
  dissect(c, from, numbers[0]);
  dissect(c, from + numbers[0], numbers[1]);
  if (numbers[2]) add_part(c, c->rows + from + numbers[0] + numbers[1], numbers[2], first_below);
}

int flesh_dissection_create(int n, const int *starts, const int *neighbours, const double *points,
                            flesh_dissection *self)
{
  const size_t rows = (size_t)n;
  *self = (flesh_dissection){.order = flesh_malloc((rows + 1) * sizeof(int)),
                             .first = flesh_malloc((rows + 2) * sizeof(int)),
                             .parent = flesh_malloc((rows + 1) * sizeof(int))};
  cut c = {.starts = starts, .neighbours = neighbours, .points = points, .to = self,
           .rows = flesh_malloc((rows + 1) * sizeof(int)), .side = flesh_calloc(rows + 1, 1),
           .places = flesh_malloc((rows + 1) * sizeof(place)), .trial = flesh_malloc((rows + 1) * sizeof(int))};
  const int failed =
      !self->order || !self->first || !self->parent || !c.rows || !c.side || !c.places || !c.trial;
  for (int k = 0; k < n && !failed; k++) c.rows[k] = k;
  if (!failed) {
    self->first[0] = 0;
    dissect(&c, 0, n);
  }
  flesh_free(c.rows);
  flesh_free(c.side);
  flesh_free(c.places);
  flesh_free(c.trial);
  if (!failed) return FLESH_OK;
  flesh_dissection_clear(self);
  return flesh_fail(FLESH_ERR_MEMORY, "no memory to order %d rows", n);
}

void flesh_dissection_clear(flesh_dissection *self)
{
  flesh_free(self->order);
  flesh_free(self->first);
  flesh_free(self->parent);
  *self = (flesh_dissection){0};
}
