/* states.h: the states that a run's folder holds, as frames: those of its frames, else what there
 * is of start, events and end. */
#ifndef FLESH_REPORT_STATES_H
#define FLESH_REPORT_STATES_H

#include "picture/picture_panel.h"
#include "run/run_folder.h"

enum { FLESH_REPORT_FEW = 4 };

typedef struct flesh_report_states {
  flesh_run_folder run;
  int count;
  int few;                             /* the run left no frames: `names` are its states */
  const char *names[FLESH_REPORT_FEW]; /* of files in the folder; NULL: the scene's start */
  double times[FLESH_REPORT_FEW];      /* s, ascending */
  const char *folder;                  /* borrowed */
} flesh_report_states;

/* Zero-initialise before. Errors as those of flesh_run_folder_open. */
int flesh_report_states_open(const char *folder, flesh_report_states *states);
void flesh_report_states_close(flesh_report_states *states); /* harmless after a failed open */
/* Frame k as a panel that borrows the state, until the next load. */
int flesh_report_states_load(flesh_report_states *states, int k, flesh_picture_panel *panel);
/* The number of frame k: the step that it was written after; k itself where there are no frames. */
int flesh_report_states_number(const flesh_report_states *states, int k);

#endif
