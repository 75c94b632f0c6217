/* checkpoint.h: the file from which a run goes on: what it was told, where it stands, and what its integrator
 * remembers. */
#ifndef FLESH_SHARED_CHECKPOINT_H
#define FLESH_SHARED_CHECKPOINT_H

#include <stddef.h>
#include <stdint.h>

#include "shared/result.h"
#include "shared/run_trace.h"

#define FLESH_CHECKPOINT_NAME "checkpoint.bin"

/* When checkpoints are written: every so many seconds, or steps; both 0: never. */
typedef struct flesh_checkpoint_times {
  double seconds;
  int steps;
} flesh_checkpoint_times;

/* "60s" or "100steps". FLESH_ERR_ARGUMENT. */
int flesh_checkpoint_times_read(const char *text, flesh_checkpoint_times *times);

/* The numbers that stand for themselves. */
typedef struct flesh_checkpoint_head {
  flesh_checkpoint_times times;
  int no_frames, step;
  int exact;                   /* going on from here gives the same bits */
  double max_seconds, start_t; /* s; of the budget and of the run's begin */
  double wall_s, cpu_s;        /* s, spent so far */
  int64_t history, probes;     /* bytes of their files; probes -1: there are none */
} flesh_checkpoint_head;

/* What else it holds of a run; all borrowed. */
typedef struct flesh_checkpoint_parts {
  const flesh_scene *scene;
  flesh_integrator *integrator;
  flesh_state *state;
  flesh_figures *figures;
  flesh_run_trace *trace;
} flesh_checkpoint_parts;

/* Written to the disk whole or not at all, as folder/checkpoint.bin. `scene_digest`: SHA-256 of the folder's scene.yaml;
 * `notes`: text. */
int flesh_checkpoint_write(const char *folder, const flesh_checkpoint_head *head, const char *scene_digest,
                           const char *notes, const flesh_checkpoint_parts *parts);
/* SHA-256 of a folder's scene.yaml as text; "" where there is none. */
enum { FLESH_DIGEST_SIZE = 65 };
void flesh_checkpoint_digest(const char *folder, char digest[FLESH_DIGEST_SIZE]);

/* A folder's checkpoint as it was read. */
typedef struct flesh_checkpoint {
  flesh_checkpoint_head head;
  char *notes;
  char *file;         /* its bytes */
  size_t parts, size; /* where those of the parts begin, and how many bytes there are */
} flesh_checkpoint;

/* Zero-initialise before; closed by the caller, also where it fails. FLESH_ERR_FILE with a sentence: there is none, or it
 * is damaged. FLESH_ERR_ARGUMENT: it was written by another flesh, or scene.yaml is another one. */
int flesh_checkpoint_open(const char *folder, flesh_checkpoint *checkpoint);
void flesh_checkpoint_close(flesh_checkpoint *checkpoint);
/* Gives the parts back what they were. Status also of flesh_integrator_load. */
int flesh_checkpoint_restore(const char *folder, flesh_checkpoint *checkpoint, const flesh_checkpoint_parts *parts);

#endif
