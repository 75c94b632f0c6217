/* frames.h: starts and ends of the battery's runs, drawn. */
#ifndef FLESH_HARDCASES_FRAMES_H
#define FLESH_HARDCASES_FRAMES_H

#include "hardcases/hardcases.h"

/* frames_GROUP.png: start, first step, a tenth of the time and end of the group's cases. */
int flesh_hardcases_draw_frames(const flesh_hardcases_plan *plan, const char *group);

/* sheet_SETTING.png of settings[first] and of those that differ from it in their body only, where there are several and
 * it is the first of them: the end of every case on every mesh. */
int flesh_hardcases_draw_sheet(const flesh_hardcases_plan *plan, int first);

#endif
