/* run_folder.h: a folder that `flesh run` has filled, or a scene that has not run yet, as a scene with frames. */
#ifndef FLESH_RUN_RUN_FOLDER_H
#define FLESH_RUN_RUN_FOLDER_H

#include "flesh/scene.h"
#include "scene/arena.h"

typedef struct flesh_run_frame {
  double time; /* s */
  int number;  /* number in the file's name, that of the step after which it was written; 0 for a single frame */
  const char *file; /* in the folder; NULL: the scene's start, or the only state */
} flesh_run_frame;

typedef struct flesh_run_folder {
  flesh_arena memory; /* owns frames and names */
  flesh_scene *scene;
  const char *folder; /* folder of the frames; NULL for a scene */
  int count;    /* number of frames, at least 1 */
  flesh_run_frame *frames; /* [count], ascending */
  int has_states;          /* the run left no frames; its states are the frames */
  flesh_state state;       /* the frame that was loaded last */
} flesh_run_folder;

/* Opens `path`: a run's folder (scene.yaml, frames/frames.pvd; without frames its last state) or a scene file.
 * Zero-initialise the struct before. FLESH_ERR_FILE or FLESH_ERR_ARGUMENT with one sentence. */
int flesh_run_folder_open(const char *path, flesh_run_folder *run);
void flesh_run_folder_close(flesh_run_folder *run); /* harmless after a failed open */

/* Makes frames, numbered from 0 by time, from the states of a run at `path` that left no frames: the start, the states
 * that `flesh drift` keeps, and the end. */
int flesh_run_folder_take_states(flesh_run_folder *run, const char *path);

/* Loads frame k into run->state. */
int flesh_run_folder_load(flesh_run_folder *run, int k);
/* Returns the index of the frame nearest in time. */
int flesh_run_folder_at(const flesh_run_folder *run, double time);

/* Sets *name to the last word of a path, and returns its length. */
size_t flesh_run_folder_name(const char *path, const char **name);

#endif
