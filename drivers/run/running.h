/* running.h: a run that is being made: shared by its loop (runner.c), its files (runner_outputs.c), its ranks
 * (runner_ranks.c) and its checkpoints (runner_checkpoint.c), and by nothing else. */
#ifndef FLESH_RUN_RUNNING_H
#define FLESH_RUN_RUNNING_H


#include "flesh/probe.h"
#include "output/part_frames.h"
#include "run/runner_options.h"
#include "system/proximity.h"

typedef struct flesh_running {
  const flesh_scene *scene;
  const flesh_runner_options *options;
  flesh_history *history;
  flesh_probes *probes; /* NULL without any */
  flesh_frames *frames;
  flesh_surface *surface; /* of the skin, with the next two; NULL without one */
  flesh_skin *skin;
  flesh_skin_frames *skin_frames;
  flesh_integrator *integrator;
  flesh_state state; /* of the whole; on ranks but the first t alone */
  /* On ranks, with the next four: this one's part of the state. */
  flesh_state own;
  flesh_state stage; /* of the whole, on the first, as is what follows */
  double *J_mean, *J_min; /* [tets] one piece; and what the whole's effects know of nodes near each other */
  flesh_proximity proximity;
  int observer_count;
  const flesh_observer *observers; /* of the whole, on the first */
  flesh_frames *part_frames; /* of a split mesh, of which each rank writes its part; NULL: none */
  json_t *ranks; /* what result.json says of them */
  double started; /* monotonic seconds */
  double set_up;  /* s that the command has taken before */
  double last_progress;
  double last_step, next_word; /* monotonic seconds: the last step's end; when a long one is spoken of */
  int step;                    /* the last one taken */
  double start_t;
  flesh_run_trace trace;
  int progress; /* show a line */
  int running; /* result.json says so */
  json_t *program, *inputs, *resumed, *warning; /* where the run has gone on from; what the scene that it began with warns of */
  flesh_figures *figures; /* borrowed */
  double cpu_before, cpu_begin; /* s, of the run's parts before this one; of the process before its steps */
  struct {
    int on;             /* checkpoints are written */
    flesh_checkpoint_times times;
    int step;           /* of the last one; -1: none yet */
    int fits;           /* of the one that the run goes on from: every rank has found its own piece */
    double at;          /* monotonic seconds: when it was written */
    double asked;       /* when the run was first asked to end; 0: it was not */
    char digest[FLESH_DIGEST_SIZE];
  } checkpoint;
} flesh_running;

/* out/name, for the next few calls (cli/path.h). */
const char *flesh_running_path(const flesh_running *running, const char *name);
/* The outcome (taken) with everything else that result.json has. */
json_t *flesh_running_result(flesh_running *running, json_t *outcome, const flesh_figures *figures);

/* Everything that can fail for want of a writable place fails here, before any solve. */
int flesh_running_open(flesh_running *running, flesh_figures *figures);
/* Opens the files of a run that goes on, as they were at the checkpoint. */
int flesh_running_reopen(flesh_running *running, flesh_figures *figures, const flesh_checkpoint_head *head);

/* The file of probes, if there are any; every rank calls it, and the first writes. */
int flesh_running_open_probes(flesh_running *running);

/* Memory of this rank's part of the run, with its start. */
int flesh_running_share(flesh_running *running);
/* Whether the mesh is split, so that no rank has the whole. */
int flesh_running_is_split(const flesh_running *running);
/* The system that is observed: the whole's, or of a split mesh this rank's part of it. */
const flesh_system *flesh_running_system(const flesh_running *running);
/* Opens the files that each rank writes: probes and, of a split mesh, its part of frames; the first has made the
 * folder. Every rank calls it. */
int flesh_running_open_parts(flesh_running *running);
/* Waits until what this rank has written of frames since the last checkpoint is on the disk. */
int flesh_running_sync_parts(flesh_running *running);
/* The last state, row by row in the order of the whole, of which the first rank has some at a time. Every rank calls it. */
int flesh_running_keep_parts(flesh_running *running);
/* Starts contact's memory of the whole at the first rank's state. Status. */
int flesh_running_begin_whole(flesh_running *running);
/* Has the first rank's observers observe the whole. */
int flesh_running_observe_ranks(void *running, const flesh_step_record *record);

/* Everything but the files is as at the checkpoint of options->resume, which is refused where a file that the scene names
 * has changed. *head is the checkpoint's. Every rank calls it. */
int flesh_running_restore(flesh_running *running, flesh_figures *figures, flesh_checkpoint_head *head);
/* Writes a checkpoint where one is due; ends the run behind it where that was asked for. The last observer, and of each
 * rank. */
int flesh_running_observe_checkpoint(void *running, const flesh_step_record *record);
/* Why the run should end: FLESH_OK, FLESH_ERR_INTERRUPTED, FLESH_ERR_BUDGET. */
int flesh_running_asked_to_end(flesh_running *running);
/* The run is complete, and all its files are on the disk: it needs no checkpoint any more. */
int flesh_running_drop_checkpoint(flesh_running *running);

#endif
