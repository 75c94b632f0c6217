/* part_frames.h: frames (flesh/observer.h) of a body of which each rank has a part: a .vtu of each part, a .pvtu that
 * joins them, and the .pvd of all. The fields are set on all ranks alike; each rank observes its own records, and the
 * first lists a frame once all have written their parts: FLESH_ERR_FILE on all ranks or none. */
#ifndef FLESH_OUTPUT_PART_FRAMES_H
#define FLESH_OUTPUT_PART_FRAMES_H

#include "base/team.h"
#include "flesh/observer.h"

/* Makes the frames of the part `mesh` of rank `rank` of `ranks`; `team` has the numbers of its nodes and tets in the
 * whole. The folder exists and has the frames.pvd of flesh_frames_create, which removes older frames. Borrows mesh and
 * team (NULL: the mesh is the whole). Returns new. FLESH_ERR_MEMORY. */
int flesh_part_frames_create(const char *directory, const flesh_mesh *mesh, const flesh_team *team, int rank, int ranks,
                             int every, flesh_frames **frames);
/* Lets frames that were just created continue after step `last`, after flesh_frames_resume has cleared their folder.
 * FLESH_ERR_FILE if the first rank misses a frame up to `last`; the frames are then closed. */
int flesh_part_frames_resume(flesh_frames **frames, int last);
/* Waits until this rank's parts of frames after step `settled` are on the disk. FLESH_ERR_FILE. */
int flesh_part_frames_sync(flesh_frames *frames, int settled);

#endif
