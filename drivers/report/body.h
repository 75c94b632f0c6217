/* body.h: writes a run's body and obstacles as numbers: their shape once, then one frame after another. report.h has
 * the format. */
#ifndef FLESH_REPORT_BODY_H
#define FLESH_REPORT_BODY_H

#include "report/report.h"
#include "picture/picture_panel.h"

enum { FLESH_REPORT_FIELDS = 3 }; /* J, stress and speed */

typedef struct flesh_report_body {
  int nodes, tets, frames;
  double quantum;                                              /* unit of positions, m */
  double low[FLESH_REPORT_FIELDS], steps[FLESH_REPORT_FIELDS]; /* least value and unit of each field */
  flesh_view view;
  flesh_arena memory;
  size_t total, flag_bytes;
  int *numbers[3];   /* [total] numbers of a frame; frame k is at k % 3 */
  uint8_t *flags[2]; /* [flag_bytes] a bit per tet: whether it is inverted; frame k is at k % 2 */
  double *J;         /* [tets] workspace */
} flesh_report_body;

/* Opens the body. `frames` [FLESH_REPORT_FIELDS]: the ranges of the fields' colours. FLESH_ERR_MEMORY. The caller frees
 * `memory`. */
int flesh_report_body_open(const flesh_picture_panel *panel, const flesh_picture_frame *frames,
                           flesh_report_body *body);

/* Write the mesh at rest, or the obstacles, of the first panel; *made (new) says where they are in `numbers`. */
int flesh_report_body_mesh(const flesh_report_body *body, const flesh_picture_panel *panel,
                           FILE *numbers, json_t **made);
int flesh_report_body_obstacles(const flesh_report_body *body, const flesh_picture_panel *panel,
                                FILE *numbers, json_t **made);
/* Writes the next frame. */
int flesh_report_body_frame(flesh_report_body *body, const flesh_picture_panel *panel,
                            FILE *numbers);

#endif
