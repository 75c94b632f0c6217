/* vtu_read.h: reads back the frames that flesh has written (.vtu with raw appended data, .pvtu of those, .pvd). */
#ifndef FLESH_OUTPUT_VTU_READ_H
#define FLESH_OUTPUT_VTU_READ_H

#include "output/vtu.h"

/* Fills targets[k] [3*points] with the vectors of doubles named names[k] ("Points": the positions). The points of a
 * .pvtu's parts go to the places given by their numbers `node`, and all points must occur. FLESH_ERR_FILE for a file
 * that is not flesh's, or has another number of points. */
int flesh_vtu_read(const char *path, int points, int count, const char *const *names,
                   double *const *targets);

/* Fills the zeroed *pvd. FLESH_ERR_FILE; flesh_pvd_clear frees it. */
int flesh_pvd_read(const char *path, flesh_pvd *pvd);
/* Reads a .pvd of frames named <words>_<step>.vtu, one every `every` steps, and drops those after step `last`.
 * FLESH_ERR_FILE also if one up to `last` is missing. */
int flesh_pvd_resume(const char *path, int every, int last, flesh_pvd *pvd);

#endif
