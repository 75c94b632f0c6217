/* bodies.h: pictures of the bodies of a study's cases, as two tables say that its SQL makes:
 *   pictures (picture, columns, width, height, edges, low, high, view, told): PICTURE.png, its panels in a row, the size of a
 *     panel in pixels (height 0: fitted), 1 for the edges of triangles, the ends of J's colours and the height that is seen in
 *     m (NULL: fitted), and 1 where a title says by how much its body is shown smaller
 *   panels (picture, place, number, title, subtitle, held, file, otherwise): in the order of `place` the bodies of the cases
 *     of these numbers (NULL: words alone) in the first of two state files below the study's folder that is there, at rest
 *     where it names none. A body of `held` NULL is seen where it is, unless it has gone far; other bodies fill their panels,
 *     about where they rest (1) or about their middle (0). */
#ifndef FLESH_STUDY_BODIES_H
#define FLESH_STUDY_BODIES_H

#include "picture/plot.h"
#include "study/study.h"

/* Draws them into the folder `out`, the meshes by study->body. Notes what fails. */
void flesh_study_draw_bodies(const flesh_study *study, sqlite3 *database, const char *out, flesh_plot_outcome *outcome);

/* Whether a body at x [3*nodes] is within twice its size of where it rests, so that a picture can show it there. */
int flesh_study_is_near(const flesh_mesh_info *info, const double *x);

#endif
