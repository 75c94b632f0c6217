/* surface_gaps.c: corrects, node by node, a first iterate that would bring touching bodies into each other or apart. */
#include <float.h>
#include <math.h>
#include <stdlib.h>

#include "base/team.h"
#include "effect/surface_contact.h"
#include "geometry/contact_closest.h"
#include "math/mat3.h"

typedef flesh_surface_near near;

/* In thicknesses: largest depth from which nodes that touched are brought back to their gap, and largest distance
 * beyond it. */
static const double DEEPEST = 3, LEFT = 1;

/* Largest number of sweeps; relative error of the gaps at which corrections end. */
enum { SWEEPS = 10 };
static const double RIGHT = 1e-3;

/* A node and the face below it. */
struct flesh_surface_guard {
  int node;
  const int *face; /* [3] */
  double gap;      /* m, gap before the step */
};

/* Computes the outward unit normal of a face, the weights of the foot of p in its plane, and the height of p above it.
 * Returns 0 if the face has no area. */
static int find_height(const double *p, const int *face, const double *x, double normal[3], double w[3], double *height)
{
  const double *corner[3];
  double e[3], f[3], h[3], q[3];
  for (int k = 0; k < 3; k++) corner[k] = x + 3 * (size_t)face[k];
  for (int c = 0; c < 3; c++) {
    e[c] = corner[1][c] - corner[0][c];
    f[c] = corner[2][c] - corner[0][c];
    h[c] = p[c] - corner[0][c];
  }
  flesh_vec3_cross(e, f, normal);
  const double square = flesh_vec3_dot(normal, normal), length = sqrt(square);
  if (!(square > 0)) return 0;
  flesh_vec3_cross(h, f, q);
  w[1] = flesh_vec3_dot(q, normal) / square;
  flesh_vec3_cross(e, h, q);
  w[2] = flesh_vec3_dot(q, normal) / square;
  w[0] = 1 - w[1] - w[2];
  for (int c = 0; c < 3; c++) normal[c] /= length;
  *height = flesh_vec3_dot(h, normal);
  return 1;
}

/* Whether the foot with these weights lies in the face. */
static int is_above(const double w[3]) { return w[0] >= 0 && w[1] >= 0 && w[2] >= 0; }

/* Finds the guard of a node that touched one of its faces, pairs [2*count], at x_from: the face that it is above at x
 * or, if there is none, the face that it touched. Only faces within the distance `within` count, whatever else a search
 * has found, because a resumed run uses another search. Returns whether there is one. */
static int guard_of(const near *self, double within, int count, const int *pairs, const double *x_from, const double *x,
                    struct flesh_surface_guard *guard)
{
  const flesh_contact_surface *s = &self->contact->surface;
  const double thickness = self->contact->law.thickness;
  const int node = s->nodes[pairs[0]], *touched = NULL;
  const double *from = x_from + 3 * (size_t)node, *to = x + 3 * (size_t)node;
  double n[3], w[3], w_from[3], height, nearest = INFINITY;
  *guard = (struct flesh_surface_guard){.node = node, .gap = thickness};
  for (int k = 0; k < count; k++) {
    const int *face = s->faces + 3 * (size_t)pairs[2 * k + 1];
    if (find_height(from, face, x_from, n, w, &height) && is_above(w) && height > 0 && height < guard->gap)
      guard->gap = height, touched = face;
  }
  for (int k = 0; touched && k < count; k++) {
    const int *face = s->faces + 3 * (size_t)pairs[2 * k + 1];
    if (!find_height(to, face, x, n, w, &height) || height < -DEEPEST * thickness || height >= guard->gap + LEFT * thickness)
      continue;
    const double off = is_above(w) ? fabs(height) : face == touched ? DBL_MAX : INFINITY;
    if (off < nearest && flesh_contact_nearest_of_triangle(from, face, x_from, w_from) <= within * within)
      nearest = off, guard->face = face;
  }
  return guard->face != NULL;
}

/* Lists the guards of a rank's own nodes at x. Returns their number. */
static int list_guards(near *self, double within, const double *x_from, const double *x)
{
  const flesh_near_pairs *near_pairs = &self->static_pairs;
  int count = 0;
  for (int k = 0, of; k < near_pairs->point_count; k += of) {
    const int *pairs = near_pairs->point_faces + 2 * (size_t)k;
    for (of = 1; k + of < near_pairs->point_count && pairs[2 * of] == pairs[0];) of++;
    if (self->contact->surface.nodes[pairs[0]] >= self->contact->own) continue;
    count += guard_of(self, within, of, pairs, x_from, x, &self->guards[count]);
  }
  return count;
}

/* Gathers the guards of all ranks, in the order of their nodes, as one rank alone would have them. Returns their
 * number; 0 if a rank has an error. */
static int share_guards(near *self, const flesh_team *team, int status, int count)
{
  const flesh_contact_surface *s = &self->contact->surface;
  const int numbers = 2 * s->node_count;
  double any = count, *all = status ? NULL : calloc((size_t)numbers + 1, sizeof *all);
  if (flesh_team_sum_agreed(team, all ? FLESH_OK : FLESH_ERR_MEMORY, 1, &any)) any = 0;
  for (int k = 0; k < count && any > 0; k++) {
    double *of = all + 2 * (size_t)s->node_place[self->guards[k].node];
    of[0] = 1 + (double)((self->guards[k].face - s->faces) / 3);
    of[1] = self->guards[k].gap;
  }
  if (any > 0) flesh_team_sum(team, numbers, all);
  count = 0;
  for (int p = 0; p < s->node_count && any > 0; p++) {
    const double *of = all + 2 * (size_t)p;
    if (of[0] > 0) self->guards[count++] = (struct flesh_surface_guard){s->nodes[p], s->faces + 3 * ((size_t)of[0] - 1), of[1]};
  }
  free(all);
  return count;
}

/* Moves a node and its face along its normal, as little as possible, to restore the gap. Returns whether that was
 * needed. */
static int correct(const struct flesh_surface_guard *guard, double *x)
{
  double n[3], w[3], height, *p = x + 3 * (size_t)guard->node;
  if (!find_height(p, guard->face, x, n, w, &height)) return 0;
  const double lack = guard->gap - height;
  if (!(fabs(lack) > RIGHT * guard->gap)) return 0;
  const double move = lack / (1 + flesh_vec3_dot(w, w));
  for (int c = 0; c < 3; c++) {
    p[c] += move * n[c];
    for (int k = 0; k < 3; k++) x[3 * (size_t)guard->face[k] + (size_t)c] -= move * w[k] * n[c];
  }
  return 1;
}

int flesh_surface_near_keep_gaps(near *self, const flesh_team *team, int status, double within, const double *x_from, double *x)
{
  const size_t nodes = (size_t)self->contact->surface.node_count;
  if (!self->guards) self->guards = malloc((nodes + 1) * sizeof *self->guards);
  if (!self->guards) status = FLESH_ERR_MEMORY; /* in this case nothing is corrected */
  int count = status ? 0 : list_guards(self, within, x_from, x);
  if (team) count = share_guards(self, team, status, count);
  int changed = 0, again = count > 0;
  for (int sweep = 0; again && sweep < SWEEPS; sweep++) {
    again = 0;
    for (int k = 0; k < count; k++) again |= correct(&self->guards[k], x);
    changed |= again;
  }
  return changed;
}
