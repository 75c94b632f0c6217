/* body.h: a run's body and obstacles in numbers: their shape once, then a frame after the other.
 * report.h has the format. */
#ifndef FLESH_REPORT_BODY_H
#define FLESH_REPORT_BODY_H

#include "report/report.h"
#include "picture/picture_panel.h"

enum { FLESH_REPORT_FIELDS = 3 }; /* J, stress and speed */

typedef struct flesh_report_body {
  int nodes, tets, frames;
  int obstacle_count;
  double quantum;                                              /* m, of positions */
  double low[FLESH_REPORT_FIELDS], steps[FLESH_REPORT_FIELDS]; /* of the fields */
  flesh_view view;
  flesh_arena memory;
  size_t total, flag_bytes;
  int *numbers[3];   /* [total] of a frame, frame k's in the place k % 3 */
  uint8_t *flags[2]; /* [flag_bytes] a bit per tet: it is inverted; frame k's in the place k % 2 */
  double *J;         /* [tets] room */
} flesh_report_body;

/* `frames` [FLESH_REPORT_FIELDS]: the limits of the fields' colours. FLESH_ERR_MEMORY. The caller frees `memory`. */
int flesh_report_body_open(const flesh_picture_panel *panel, const flesh_picture_frame *frames,
                           flesh_report_body *body);

/* Adds the mesh at rest, or the obstacles, as the first panel has them; *made tells where (new). */
int flesh_report_body_mesh(const flesh_report_body *body, const flesh_picture_panel *panel,
                           FILE *numbers, json_t **made);
int flesh_report_body_obstacles(const flesh_report_body *body, const flesh_picture_panel *panel,
                                FILE *numbers, json_t **made);
/* Adds the next frame. */
int flesh_report_body_frame(flesh_report_body *body, const flesh_picture_panel *panel,
                            FILE *numbers);

#endif
