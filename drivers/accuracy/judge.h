/* judge.h: the errors of a run, step by step while it goes. */
#ifndef FLESH_ACCURACY_JUDGE_H
#define FLESH_ACCURACY_JUDGE_H

#include "accuracy/accuracy.h"

/* Compares every state that it sees. */
typedef struct flesh_accuracy_judge {
  const flesh_accuracy_plan *plan;
  const flesh_accuracy_track *reference;
  const flesh_accuracy_track *tight; /* NULL for the methods' work */
  const flesh_system *system;        /* of the run's scene */
  flesh_scene *scene;                /* as it stands: of the reference */
  int finer_tip;                     /* -1; of a run on another mesh: its node nearest to the tip */
  flesh_accuracy_errors errors;      /* largest so far, against the reference; of another mesh against `tight` */
  flesh_accuracy_errors difference;  /* against `tight` */
  flesh_accuracy_track now, then;    /* one state each: the run's and the reference's */
} flesh_accuracy_judge;

int flesh_accuracy_judge_open(const flesh_accuracy_plan *plan, const flesh_accuracy_track *reference,
                              const flesh_accuracy_track *tight, const flesh_scene *scene, int is_finer,
                              flesh_accuracy_judge *judge);
void flesh_accuracy_judge_close(flesh_accuracy_judge *judge);

/* flesh_accuracy_watch.see of a judge. */
int flesh_accuracy_judge_see(void *judge, const flesh_state *state);

#endif
