/* running.h: a run in progress: shared by its loop (running.c), its files (runner_outputs.c), its ranks (runner_ranks.c)
 * and its checkpoints (runner_checkpoint.c), and used by nothing else. */
#ifndef FLESH_RUN_RUNNING_H
#define FLESH_RUN_RUNNING_H

#include "flesh/probe.h"
#include "output/part_frames.h"
#include "run/runner.h"
#include "system/proximity.h"

typedef struct flesh_running {
  const flesh_scene *scene;
  const flesh_runner_options *options;
  flesh_history *history;
  flesh_probes *probes; /* NULL without any */
  flesh_frames *frames;
  flesh_surface *surface; /* surface of the skin; NULL, as the next two, if there is none */
  flesh_skin *skin;
  flesh_skin_frames *skin_frames;
  flesh_integrator *integrator;
  flesh_state state; /* of the whole; on ranks other than the first only t */
  /* On ranks only, as all members up to `ranks`: this rank's part of the state. */
  flesh_state own;
  flesh_state stage; /* of the whole, on the first rank, as the members below */
  double *J_mean, *J_min; /* [tets] allocated together */
  flesh_proximity proximity; /* what the whole's effects know of nodes near each other */
  int observer_count;
  const flesh_observer *observers; /* of the whole, on the first rank */
  flesh_frames *part_frames; /* of a split mesh, of which each rank writes its part; NULL if there are none */
  json_t *ranks; /* the ranks' figures for result.json */
  double started; /* monotonic seconds */
  double set_up;  /* s that the command has taken before the run */
  double last_progress;
  double last_step, next_report; /* monotonic seconds: end of the last step; when a long step is reported next */
  int step;                    /* number of the last accepted step */
  double start_t;
  flesh_run_trace trace;
  int progress; /* a line of progress is shown */
  int running; /* result.json has the status "running" */
  json_t *program, *inputs, *resumed, *warning; /* places where it was resumed; warning of the scene as it began */
  flesh_figures *figures; /* borrowed */
  double cpu_before, cpu_begin; /* s, of the run's earlier parts; of the process before its first step */
  struct {
    int on;             /* checkpoints are written */
    int step;           /* of the last checkpoint; -1: none yet */
    int fits;           /* every rank has found its own piece in the checkpoint from which the run resumes */
    double at;          /* monotonic seconds at which the last checkpoint was written */
    double asked;       /* monotonic seconds at which the run was first asked to end; 0: it was not */
    char digest[FLESH_DIGEST_SIZE];
  } checkpoint;
} flesh_running;

/* Returns the path out/name, valid for the next few calls (cli/path.h). */
const char *flesh_running_path(const flesh_running *running, const char *name);
/* Returns the object of result.json: the outcome (taken) and everything else. */
json_t *flesh_running_result(flesh_running *running, json_t *outcome);

/* Prepares the run's output before anything is written. Claims options->out (NULL: no folder) and checks that neither
 * the run's files nor `save_state`, the copy of its state, would replace a file that the run reads or, in the folder,
 * one that no run has written. FLESH_ERR_ARGUMENT, FLESH_ERR_FILE. */
int flesh_running_claim(const flesh_running *running, flesh_folder_claim *claim);
/* Creates the files of a run, or reopens those of a resumed run as they were at the checkpoint. Failures for want of a
 * writable place happen here, before any solve. */
int flesh_running_open(flesh_running *running);

/* Opens the file of probes, if there are any; every rank calls it, and the first writes. */
int flesh_running_open_probes(flesh_running *running);
/* Adds the fields that the scene asks for to the frames of a body: the whole, or a rank's part. */
int flesh_running_set_fields(const flesh_running *running, flesh_frames *frames, const flesh_body *body,
                             const flesh_system *system);

/* Allocates this rank's part of the run, and sets it to the start. */
int flesh_running_share(flesh_running *running);
/* Returns whether the mesh is split, so that no rank has the whole. */
int flesh_running_is_split(const flesh_running *running);
/* Returns the system that is observed: the whole's, or on a split mesh this rank's part of it. */
const flesh_system *flesh_running_system(const flesh_running *running);
/* Opens the files for which every rank is needed: probes and, on a split mesh, each rank's part of the frames. The
 * first rank has made the folder. Every rank calls it. */
int flesh_running_open_parts(flesh_running *running);
/* Waits until the frames that this rank has written since the last checkpoint are on the disk. */
int flesh_running_sync_parts(flesh_running *running);
/* Writes the last state of a split mesh in the order of the whole's nodes; the first rank holds a block of rows at a
 * time. Every rank calls it. */
int flesh_running_keep_parts(flesh_running *running);
/* Initialises the whole's contact memory with the first rank's state. Returns a status. */
int flesh_running_begin_whole(flesh_running *running);
/* Calls the first rank's observers for the whole. */
int flesh_running_observe_ranks(void *running, const flesh_step_record *record);

/* Restores everything but the files from the checkpoint of options->resume; fails if a file that the scene names has
 * changed. Every rank calls it. */
int flesh_running_restore(flesh_running *running);
/* Writes a checkpoint if one is due, and ends the run after it if the run was asked to end. The last observer on every
 * rank. */
int flesh_running_observe_checkpoint(void *running, const flesh_step_record *record);
/* Returns why the run should end, or FLESH_OK: FLESH_ERR_INTERRUPTED, FLESH_ERR_BUDGET. */
int flesh_running_asked_to_end(flesh_running *running);
/* Removes the checkpoint of a complete run, after all its files are on the disk. */
int flesh_running_drop_checkpoint(flesh_running *running);

#endif
