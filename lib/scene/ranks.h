/* ranks.h: a scene whose body is shared by several ranks. */
#ifndef FLESH_SCENE_RANKS_H
#define FLESH_SCENE_RANKS_H

#include <stdint.h>

#include "flesh/probe.h"
#include "flesh/ranks.h"
#include "flesh/scene.h"

/* Like flesh_scene_read, on rank `rank` of `ranks`. If the body's mesh is split (mesh/split.h) for that many ranks, the
 * scene has the rank's part only, and no system of the whole. Further errors: FLESH_ERR_ARGUMENT if the mesh is split
 * for another number of ranks, or the scene asks for something that needs the whole. */
int flesh_scene_read_on_rank(const char *path, int count, const char *const *overrides, int rank, int ranks,
                             flesh_scene **scene);

/* Checksums of a scene, by which ranks compare what they have read: all keys in force, the mesh (0 for a part of a
 * split one), the start, and the bytes of the other files that the scene names. */
typedef struct flesh_scene_sums {
  uint64_t keys, mesh, start, files;
} flesh_scene_sums;
/* Computes the checksums. FLESH_ERR_FILE, FLESH_ERR_MEMORY. */
int flesh_scene_sum(const flesh_scene *scene, flesh_scene_sums *sums);

/* A rank's part of a scene's body. */
typedef struct flesh_scene_share flesh_scene_share;

/* Makes this rank's part of the scene's body and a system on it, with the effects and constraints of the scene in the
 * same order. Every rank has read the scene, whose own system stays that of the whole. Borrows both. Returns new.
 * Collective, and fails on all ranks or none: FLESH_ERR_ARGUMENT, with the place in the scene, for an effect that ranks
 * cannot share, or more ranks than tets; FLESH_ERR_MEMORY. */
int flesh_scene_share_create(const flesh_scene *scene, flesh_communicator *communicator, flesh_scene_share **share);
/* Frees the share and sets *share to NULL; NULL-safe. */
void flesh_scene_share_destroy(flesh_scene_share **share);

/* Return parts of the share, which keeps them. */
const flesh_rank_part *flesh_scene_share_part(const flesh_scene_share *share);
const flesh_body *flesh_scene_share_body(const flesh_scene_share *share);
const flesh_system *flesh_scene_share_system(const flesh_scene_share *share);
/* Returns the scene's probes, *count of them, prepared for flesh_probes_create on all ranks. */
const flesh_probe *flesh_scene_share_probes(const flesh_scene_share *share, int *count);
/* Fills in the part's values of the scene's start, as flesh_scene_start does for the whole. */
void flesh_scene_share_start(const flesh_scene_share *share, flesh_state *state);

#endif
