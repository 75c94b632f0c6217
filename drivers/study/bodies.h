/* bodies.h: draws the bodies of a study's cases, as two tables ask for that its SQL makes:
 *   pictures (picture, columns, width, height, edges, low, high, view, shows_scale): a picture PICTURE.png for each row, with
 *     `columns` panels in a row, the width and height of a panel in pixels (height 0: fitted), `edges` 1 to draw the edges of
 *     triangles, `low` and `high` J at the ends of the colours, `view` the visible height in m (NULL: fitted), and
 *     `shows_scale` 1 if titles say by how much their bodies are shown smaller
 *   panels (picture, position, number, title, subtitle, held, file, fallback): a panel for each row, in the order of
 *     `position`:
 *     the body of case `number` (NULL: only words) from the first that exists of the state files `file` and `fallback`
 *     below the study's folder; at rest if the row names none. With `held` NULL a body is shown where it is, unless it has
 *     gone far; else bodies fill their panels, centred on their place at rest (1) or on their own middle (0). */
#ifndef FLESH_STUDY_BODIES_H
#define FLESH_STUDY_BODIES_H

#include "picture/plot.h"
#include "study/study.h"

/* Draws the pictures into the folder `out`, with the meshes from study->body. Failures are noted in *outcome. */
void flesh_study_draw_bodies(const flesh_study *study, sqlite3 *database, const char *out, flesh_plot_outcome *outcome);

/* Returns whether a body at x [3*nodes] is within twice its size of its place at rest, so that a picture can show it
 * there. */
int flesh_study_is_near(const flesh_mesh_info *info, const double *x);

#endif
