/* checkpoint.h: the file from which a run goes on: what it was told, where it stands, and in a piece for each rank that it
 * had, or one of a process by itself, the state and what the integrator remembers. Any number of ranks reads it. */
#ifndef FLESH_RUN_CHECKPOINT_H
#define FLESH_RUN_CHECKPOINT_H

#include <stdint.h>

#include "base/file.h"
#include "flesh/ranks.h"
#include "run/result.h"

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
  int exact;                   /* going on from here by as many ranks gives the same bits */
  int pieces;                  /* as many as there were ranks; 1: a process by itself */
  double max_seconds, start_t; /* s; of the budget and of the run's begin */
  double wall_s, cpu_s;        /* s, spent so far */
  int64_t history, probes;     /* bytes of their files; probes -1: there are none */
} flesh_checkpoint_head;

/* The parts of a checkpoint that belong to the run as a whole; all borrowed. */
typedef struct flesh_checkpoint_parts {
  const flesh_scene *scene;
  flesh_figures *figures;
  flesh_run_trace *trace;
} flesh_checkpoint_parts;

/* The part of a checkpoint that belongs to one rank, or to a process by itself; all borrowed. */
typedef struct flesh_checkpoint_piece {
  const flesh_rank_part *part;   /* NULL: the whole */
  int nodes;
  flesh_state *state;            /* with room for everything where it is restored */
  flesh_integrator *integrator;  /* NULL where it is restored: the state alone is wanted */
} flesh_checkpoint_piece;

/* A piece as bytes, whose number is a multiple of 8; new, freed by the caller. FLESH_ERR_MEMORY. */
int flesh_checkpoint_pack(const flesh_checkpoint_piece *piece, uint8_t **bytes, size_t *size);
/* Opens folder/checkpoint.bin to be written to the disk whole or not at all: flesh_checkpoint_add for each piece, by rising
 * rank, then flesh_sync_commit, or flesh_file_abandon. `scene_digest`: SHA-256 of the folder's scene.yaml; `notes`:
 * text. */
int flesh_checkpoint_begin(const char *folder, const flesh_checkpoint_head *head, const char *scene_digest,
                           const char *notes, const flesh_checkpoint_parts *parts, flesh_file *file);
void flesh_checkpoint_add(flesh_file *file, size_t size, const uint8_t *bytes);
/* SHA-256 of a folder's scene.yaml as text; "" where there is none. */
enum { FLESH_DIGEST_SIZE = 65 };
void flesh_checkpoint_digest(const char *folder, char digest[FLESH_DIGEST_SIZE]);

/* A folder's checkpoint as it was read, but for its pieces. */
typedef struct flesh_checkpoint {
  flesh_checkpoint_head head;
  char *notes;
  uint8_t *main;      /* the bytes of all but the pieces */
  size_t parts, size; /* where in these those of the parts begin, and how many there are */
  long *places;       /* [pieces] in the file */
} flesh_checkpoint;

/* Zero-initialise before; closed by the caller, also where it fails. FLESH_ERR_FILE with a sentence: there is none, or it
 * is damaged. FLESH_ERR_ARGUMENT: it was written by another flesh, or scene.yaml is another one. */
int flesh_checkpoint_open(const char *folder, flesh_checkpoint *checkpoint);
void flesh_checkpoint_close(flesh_checkpoint *checkpoint);
/* Gives the parts back what they were. */
int flesh_checkpoint_restore(const char *folder, flesh_checkpoint *checkpoint, const flesh_checkpoint_parts *parts);
/* Whether the piece of this `rank` of as many `ranks` has this one's nodes: then it has the same bits to go on with. */
int flesh_checkpoint_fits(const char *folder, const flesh_checkpoint *checkpoint, int rank, int ranks,
                          const flesh_checkpoint_piece *piece, int *fits);
/* Gives a piece back what it was, from that of the rank; of a rank of -1 what all pieces have of its nodes, by whomever they
 * were written. Status also of flesh_integrator_load. */
int flesh_checkpoint_unpack(const char *folder, const flesh_checkpoint *checkpoint, int rank,
                            const flesh_checkpoint_piece *piece);
/* For these two: the bytes of a piece, new; and that the checkpoint is damaged, FLESH_ERR_FILE. */
int flesh_checkpoint_read_piece(const char *folder, const flesh_checkpoint *checkpoint, int piece, uint8_t **bytes,
                                size_t *size);
int flesh_checkpoint_refuse(const char *folder);

#endif
