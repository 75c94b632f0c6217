/* draft.c: arrays that grow while a surface's file is read. */
#include "surface/surface.h"

#include <limits.h>
#include <stdint.h>
#include <stdlib.h>

#include "base/error.h"

static int no_memory(int things)
{
  return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a surface of more than %d items", things);
}

/* Makes room for `wanted` items of `size` bytes. */
static int reserve(void *array, size_t *room, int wanted, size_t size)
{
  if (wanted < 0 || wanted > INT_MAX / 4) return no_memory(INT_MAX / 4);
  if ((size_t)wanted <= *room) return FLESH_OK;
  size_t more = *room ? 2 * *room : 256;
  void *moved = realloc(*(void **)array, more * size);
  if (!moved) return no_memory(wanted);
  *(void **)array = moved;
  *room = more;
  return FLESH_OK;
}

int flesh_surface_draft_vertex(flesh_surface_draft *draft, const double position[3])
{
  int status = reserve(&draft->positions, &draft->vertex_room, draft->vertices + 1,
                       3 * sizeof *draft->positions);
  if (status) return status;
  for (int d = 0; d < 3; d++) draft->positions[3 * (size_t)draft->vertices + d] = position[d];
  draft->vertices++;
  return FLESH_OK;
}

int flesh_surface_draft_texture(flesh_surface_draft *draft, const double uv[2])
{
  int status = reserve(&draft->texture, &draft->texture_room, draft->textures + 1,
                       2 * sizeof *draft->texture);
  if (status) return status;
  for (int d = 0; d < 2; d++) draft->texture[2 * (size_t)draft->textures + d] = uv[d];
  draft->textures++;
  return FLESH_OK;
}

int flesh_surface_draft_corner(flesh_surface_draft *draft, int vertex, int texture)
{
  size_t room = draft->corner_room;
  int status = reserve(&draft->vertex_of, &room, draft->corners + 1, sizeof(int));
  if (!status)
    status = reserve(&draft->texture_of, &draft->corner_room, draft->corners + 1, sizeof(int));
  if (status) return status;
  draft->vertex_of[draft->corners] = vertex;
  draft->texture_of[draft->corners++] = texture;
  return FLESH_OK;
}

int flesh_surface_draft_face(flesh_surface_draft *draft)
{
  int status = reserve(&draft->ends, &draft->face_room, draft->faces + 1, sizeof(int));
  if (!status) draft->ends[draft->faces++] = draft->corners;
  return status;
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
