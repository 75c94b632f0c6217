/* skin_frames.h: frames of the skin for states that do not come from the current run. */
#ifndef FLESH_OUTPUT_SKIN_FRAMES_H
#define FLESH_OUTPUT_SKIN_FRAMES_H

#include "flesh/observer.h"

/* Adds a state as frame number `number`. FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY, FLESH_ERR_FILE. */
int flesh_skin_frames_add(flesh_skin_frames *frames, int number, const flesh_state *state);

/* Removes files of these names that an earlier run left in `directory`. */
void flesh_skin_frames_remove(const char *directory);

/* Closes the frames without writing the point cache. NULL-safe. */
void flesh_skin_frames_abandon(flesh_skin_frames **frames);

#endif
