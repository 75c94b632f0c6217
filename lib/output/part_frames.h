/* part_frames.h: frames of a body of which each rank has a part: a .vtu of each part, a .pvtu that joins them, and the
 * .pvd of all. */
#ifndef FLESH_OUTPUT_PART_FRAMES_H
#define FLESH_OUTPUT_PART_FRAMES_H

#include "base/team.h"
#include "flesh/observer.h"

typedef struct flesh_part_frames flesh_part_frames;

/* Makes the frames of the part `mesh` of rank `rank` of `ranks`, whose nodes and tets are numbered in the whole as
 * `team` says. The folder is there, with the frames.pvd of flesh_frames_create, which removes older frames. Borrows
 * mesh and team. Returns new. FLESH_ERR_MEMORY. */
int flesh_part_frames_create(const char *directory, const flesh_mesh *mesh, const flesh_team *team, int rank, int ranks,
                             int every, flesh_part_frames **frames);
/* Frames that were just created go on behind step `last`; flesh_frames_resume has cleared their folder. They are closed
 * when it fails: FLESH_ERR_FILE where the first rank misses a frame up to there. */
int flesh_part_frames_resume(flesh_part_frames **frames, int last);
/* Like flesh_frames_set_fields, for the part's body and system. Collective. */
int flesh_part_frames_set_fields(flesh_part_frames *frames, const flesh_body *body, const flesh_system *system,
                                 flesh_method method, unsigned fields, unsigned places);
/* Waits until this rank's parts of frames behind step `settled` are on the disk. FLESH_ERR_FILE. */
int flesh_part_frames_sync(flesh_part_frames *frames, int settled);
/* NULL-safe; sets *frames to NULL. */
void flesh_part_frames_close(flesh_part_frames **frames);

/* An observer of a rank's own records, on all ranks alike: the first lists a frame once all have written their parts.
 * FLESH_ERR_FILE on all ranks or none. */
int flesh_part_frames_observe(void *frames, const flesh_step_record *record);

#endif
