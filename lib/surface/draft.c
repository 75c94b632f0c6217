/* draft.c: arrays that grow while a surface's file is read. */
#include "surface/surface.h"

#include <stdlib.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/sort.h"

static int no_memory(int things)
{
  return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a surface of more than %d items", things);
}

int flesh_surface_draft_vertex(flesh_surface_draft *draft, const double position[3])
{
  if (!flesh_grow(&draft->positions, 3 * sizeof *draft->positions, draft->vertices, &draft->vertex_room))
    return no_memory(draft->vertices);
  for (int d = 0; d < 3; d++) draft->positions[3 * (size_t)draft->vertices + d] = position[d];
  draft->vertices++;
  return FLESH_OK;
}

int flesh_surface_draft_texture(flesh_surface_draft *draft, const double uv[2])
{
  if (!flesh_grow(&draft->texture, 2 * sizeof *draft->texture, draft->textures, &draft->texture_room))
    return no_memory(draft->textures);
  for (int d = 0; d < 2; d++) draft->texture[2 * (size_t)draft->textures + d] = uv[d];
  draft->textures++;
  return FLESH_OK;
}

int flesh_surface_draft_corner(flesh_surface_draft *draft, int vertex, int texture)
{
  int room = draft->corner_room;
  if (!flesh_grow(&draft->vertex_of, sizeof(int), draft->corners, &room) ||
      !flesh_grow(&draft->texture_of, sizeof(int), draft->corners, &draft->corner_room))
    return no_memory(draft->corners);
  draft->vertex_of[draft->corners] = vertex;
  draft->texture_of[draft->corners++] = texture;
  return FLESH_OK;
}

int flesh_surface_draft_face(flesh_surface_draft *draft)
{
  if (!flesh_grow(&draft->ends, sizeof(int), draft->faces, &draft->face_room)) return no_memory(draft->faces);
  draft->ends[draft->faces++] = draft->corners;
  return FLESH_OK;
}

int flesh_surface_draft_open_corners(const flesh_surface_draft *draft)
{
  return draft->corners - (draft->faces ? draft->ends[draft->faces - 1] : 0);
}

static int has_texture(const flesh_surface_draft *draft)
{
  for (int c = 0; c < draft->corners; c++)
    if (draft->texture_of[c] >= 0) return 1;
  return 0;
}

/* A vertex and its position. */
typedef struct spot {
  const double *x;
  int vertex;
} spot;

static int compare(const void *a, const void *b)
{
  const spot *p = a, *q = b;
  for (int d = 0; d < 3; d++)
    if (p->x[d] != q->x[d]) return p->x[d] < q->x[d] ? -1 : 1;
  return 0;
}

int flesh_surface_first_vertices(int count, const double *positions, int *first)
{
  spot *spots = malloc(((size_t)count + 1) * sizeof *spots);
  if (!spots) return no_memory(count);
  for (int v = 0; v < count; v++) spots[v] = (spot){positions + 3 * (size_t)v, v};
  flesh_sort(spots, (size_t)count, sizeof *spots, compare); /* the sort is stable */
  for (int k = 0, from = 0; k < count; k++) {
    if (compare(&spots[k], &spots[from])) from = k;
    first[spots[k].vertex] = spots[from].vertex;
  }
  free(spots);
  return FLESH_OK;
}

int flesh_surface_draft_finish(flesh_surface_draft *draft, flesh_surface **surface)
{
  *surface = NULL;
  int *starts = malloc(sizeof *starts * ((size_t)draft->faces + 1));
  if (!starts) return no_memory(draft->faces);
  starts[0] = 0;
  for (int f = 0; f < draft->faces; f++) starts[f + 1] = draft->ends[f];
  int status = flesh_surface_create(draft->vertices, draft->positions, draft->faces, starts,
                                    draft->vertex_of, surface);
  free(starts);
  if (!status && has_texture(draft)) {
    (*surface)->texture_count = draft->textures;
    (*surface)->texture = draft->texture;
    (*surface)->texture_corners = draft->texture_of;
    draft->texture = NULL;
    draft->texture_of = NULL;
  }
  flesh_surface_draft_clear(draft);
  return status;
}

void flesh_surface_draft_clear(flesh_surface_draft *draft)
{
  free(draft->positions);
  free(draft->texture);
  free(draft->ends);
  free(draft->vertex_of);
  free(draft->texture_of);
  *draft = (flesh_surface_draft){0};
}
