/* still.h: the time at which a report begins, and a picture of it for pages that cannot draw. */
#ifndef FLESH_REPORT_STILL_H
#define FLESH_REPORT_STILL_H

#include "report/report.h"
#include "picture/picture_panel.h"

/* How far a run's frames are from its first; zero-initialise, free with flesh_report_motion_close. */
typedef struct flesh_report_motion {
  int count;            /* of frames */
  double *times, *away; /* [count] s; m^2, sum over nodes */
  double *first;        /* [3*nodes] m, positions of the first frame */
} flesh_report_motion;

/* Adds the next of `taken` frames. FLESH_ERR_MEMORY. */
int flesh_report_motion_add(flesh_report_motion *motion, int taken, const flesh_picture_panel *panel);
void flesh_report_motion_close(flesh_report_motion *motion);

/* The time that is shown first: among those that most runs have, the one when the runs are farthest from where they
 * began, each measured by its own farthest frame. */
double flesh_report_find_start(int runs, const flesh_report_motion *motions);

/* The run's frame at t, or the last one before; its first where there is none. */
int flesh_report_frame_at(const flesh_report_motion *motion, double t);

/* Draws the runs [shown_count] side by side as a PNG into report->still. FLESH_ERR_MEMORY. */
int flesh_report_draw_still(flesh_report *report, const flesh_picture_panel *panels,
                            const flesh_picture_options *options, const flesh_picture_frame *frame);

#endif
