/* roff.h: plain text for manual pages. */
#ifndef FLESH_SCENE_ROFF_H
#define FLESH_SCENE_ROFF_H

#include "scene/arena.h"

/* Appends what troff prints as `words`: with its own signs escaped, and hyphens and quotes that can be copied as they
 * are. */
void flesh_roff_print(flesh_text *text, const char *words);

#endif
