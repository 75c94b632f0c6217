/* skin_frames.h: frames of the skin of states that no run makes now. */
#ifndef FLESH_OUTPUT_SKIN_FRAMES_H
#define FLESH_OUTPUT_SKIN_FRAMES_H

#include "flesh/observer.h"

/* Adds a state from elsewhere as frame number `number`. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY,
 * FLESH_ERR_FILE. */
int flesh_skin_frames_add(flesh_skin_frames *frames, int number, const flesh_state *state);

/* Removes what an earlier run left under these names in `directory`. */
void flesh_skin_frames_remove(const char *directory);

/* Closes without the point cache. NULL-safe. */
void flesh_skin_frames_abandon(flesh_skin_frames **frames);

#endif
