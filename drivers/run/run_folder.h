/* run_folder.h: the folder that `flesh run` has filled, or a scene that has not run yet, as a scene
 * and its frames. */
#ifndef FLESH_RUN_RUN_FOLDER_H
#define FLESH_RUN_RUN_FOLDER_H

#include "flesh/scene.h"
#include "scene/arena.h"

typedef struct flesh_run_frame {
  double time; /* s */
  int number;  /* as in the name of the file, the step that it was written after; 0 for a single frame */
  const char *file; /* in the folder; NULL: the scene's start, or the only state */
} flesh_run_frame;

typedef struct flesh_run_folder {
  flesh_arena memory; /* of frames and names */
  flesh_scene *scene;
  const char *folder; /* of the frames; NULL for a scene */
  int count;    /* of frames, at least 1 */
  flesh_run_frame *frames; /* [count], ascending */
  int few;                 /* it left no frames: they are its states */
  flesh_state state;       /* of the frame that was loaded last */
} flesh_run_folder;

/* `path`: a run's folder (scene.yaml, frames/frames.pvd; without frames its last state) or a scene
 * file. Zero-initialise before. FLESH_ERR_FILE or FLESH_ERR_ARGUMENT with one sentence. */
int flesh_run_folder_open(const char *path, flesh_run_folder *run);
void flesh_run_folder_close(flesh_run_folder *run); /* harmless after a failed open */

/* Makes the states of a run at `path` that left no frames its frames, numbered from 0, by time: the start, what `flesh
 * drift` keeps, and the end. */
int flesh_run_folder_take_states(flesh_run_folder *run, const char *path);

/* Loads frame k into run->state. */
int flesh_run_folder_load(flesh_run_folder *run, int k);
/* The frame of that number, or -1. */
int flesh_run_folder_find(const flesh_run_folder *run, int number);
/* Which numbers there are: "0, 5, 10 to 60". */
void flesh_run_folder_numbers(const flesh_run_folder *run, char text[64]);
/* The frame nearest in time. */
int flesh_run_folder_at(const flesh_run_folder *run, double time);

/* The last word of a path, new; NULL without memory. */
char *flesh_run_folder_name(const char *path);

#endif
