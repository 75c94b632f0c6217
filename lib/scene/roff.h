/* roff.h: plain text for manual pages. */
#ifndef FLESH_SCENE_ROFF_H
#define FLESH_SCENE_ROFF_H

#include "scene/arena.h"

/* Appends text that troff prints as `words`: its special characters are escaped, and hyphens and quotes can be copied
 * from the page as they are. */
void flesh_roff_print(flesh_text *text, const char *words);

#endif
