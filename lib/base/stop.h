/* stop.h: long work outside of steps, such as setting up a scene, asks the caller whether to go on. */
#ifndef FLESH_BASE_STOP_H
#define FLESH_BASE_STOP_H

#include <stddef.h>

#include "flesh/status.h"

/* Sets the function that the calling thread asks; a negative status from it ends the work. NULL: none is asked. Borrows
 * `data`. */
void flesh_stop_set(int (*stop)(void *data), void *data);

/* Work between begin and end asks `stop`; other work, such as steps, does not. flesh_stop_end returns the last
 * answer. */
void flesh_stop_begin(void);
int flesh_stop_end(void);

/* Returns the answer of `stop`, or FLESH_OK outside of begin and end. After a negative answer `stop` is not called
 * again. */
int flesh_stop_ask(void);

/* Asks in every 4096th turn k of a loop, so that short loops do not ask. */
static inline int flesh_stop_ask_at(size_t k) { return k % 4096 == 4095 ? flesh_stop_ask() : FLESH_OK; }
/* Asks before a loop that has at least 4096 turns. */
static inline int flesh_stop_ask_before(size_t turns) { return turns >= 4096 ? flesh_stop_ask() : FLESH_OK; }

#endif
