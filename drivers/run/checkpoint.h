/* checkpoint.h: the file from which a run resumes: the options that it was given, where it stands and, in a piece for
 * each rank that it had (one piece for a process without ranks), the state and what the integrator remembers. Any
 * number of ranks can read it. */
#ifndef FLESH_RUN_CHECKPOINT_H
#define FLESH_RUN_CHECKPOINT_H

#include <stdint.h>

#include "base/file.h"
#include "flesh/ranks.h"
#include "run/result.h"

#define FLESH_CHECKPOINT_NAME "checkpoint.bin"

/* When checkpoints are written: every so many seconds or every so many steps; never if both are 0. */
typedef struct flesh_checkpoint_times {
  double seconds;
  int steps;
} flesh_checkpoint_times;

/* Reads "60s" or "100steps". FLESH_ERR_ARGUMENT for other texts. */
int flesh_checkpoint_times_read(const char *text, flesh_checkpoint_times *times);

/* The scalar values of a checkpoint. */
typedef struct flesh_checkpoint_head {
  flesh_checkpoint_times times;
  int no_frames, step;
  int exact;                   /* resuming on the same number of ranks gives the same bits */
  int pieces;                  /* number of ranks that the run had; 1: a process without ranks */
  double max_seconds, start_t; /* s; the run's budget, and the time at which it began */
  double wall_s, cpu_s;        /* s, spent so far */
  int64_t history, probes;     /* sizes of their files in bytes; probes is -1 if there is none */
} flesh_checkpoint_head;

/* The part of a checkpoint that belongs to one rank, or to a process without ranks; all borrowed. */
typedef struct flesh_checkpoint_piece {
  const flesh_rank_part *part;   /* NULL: the whole */
  int nodes;
  flesh_state *state;            /* has room for everything when it is restored */
  flesh_integrator *integrator;  /* NULL when it is restored: only the state is wanted */
} flesh_checkpoint_piece;

/* Packs a piece into new bytes, whose number is a multiple of 8; the caller frees them. FLESH_ERR_MEMORY. */
int flesh_checkpoint_pack(const flesh_checkpoint_piece *piece, uint8_t **bytes, size_t *size);
/* Opens folder/checkpoint.bin, which is written to the disk completely or not at all: call flesh_checkpoint_add for
 * each piece, by rising rank, then flesh_sync_commit, or flesh_file_abandon to give up. `scene_digest`: SHA-256 of the
 * folder's scene.yaml; `notes`: text. Figures and trace are only read. */
int flesh_checkpoint_begin(const char *folder, const flesh_checkpoint_head *head, const char *scene_digest,
                           const char *notes, flesh_figures *figures, flesh_run_trace *trace, flesh_file *file);
/* Writes the next piece to the flesh_file; flesh_ranks_gather_bytes calls it. Errors are reported when it is committed. */
int flesh_checkpoint_add(void *file, size_t size, const uint8_t *bytes);
/* Computes the SHA-256 of a folder's scene.yaml as text; "" if there is none. */
enum { FLESH_DIGEST_SIZE = 65 };
void flesh_checkpoint_digest(const char *folder, char digest[FLESH_DIGEST_SIZE]);

/* A folder's checkpoint: the open file, and its content without the pieces. */
typedef struct flesh_checkpoint {
  const char *folder; /* borrowed */
  FILE *file;
  long end; /* size of the file */
  flesh_checkpoint_head head;
  char *notes;
  uint8_t *main;      /* bytes of the file without the pieces */
  size_t figures, size; /* offset of the figures in `main`, and size of `main` */
  long *places;       /* [pieces] offsets of the pieces in the file */
} flesh_checkpoint;

/* Opens a folder's checkpoint. The struct is zero-initialised before and closed by the caller, even after a failure.
 * FLESH_ERR_FILE with a sentence: there is no checkpoint, or it is damaged. FLESH_ERR_ARGUMENT: another build of flesh
 * wrote it, or scene.yaml has changed. */
int flesh_checkpoint_open(const char *folder, flesh_checkpoint *checkpoint);
void flesh_checkpoint_close(flesh_checkpoint *checkpoint);
/* Restores the figures and the trace from the checkpoint. */
int flesh_checkpoint_restore(const flesh_checkpoint *checkpoint, flesh_figures *figures, flesh_run_trace *trace);
/* Finds whether the checkpoint has as many pieces as there are `ranks`, and the one of `rank` has the nodes and tets of
 * this piece; the run then resumes with the same bits. */
int flesh_checkpoint_fits(const flesh_checkpoint *checkpoint, int rank, int ranks, const flesh_checkpoint_piece *piece,
                          int *fits);
/* Restores a piece from the checkpoint's piece of `rank`; with rank -1 from the data that any rank's piece has of its
 * nodes. Fails also with the status of flesh_integrator_load. */
int flesh_checkpoint_unpack(const flesh_checkpoint *checkpoint, int rank, const flesh_checkpoint_piece *piece);

#endif
