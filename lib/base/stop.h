/* stop.h: what takes long without a step, such as a scene that is set up, asks the caller whether to go on. */
#ifndef FLESH_BASE_STOP_H
#define FLESH_BASE_STOP_H

#include <stddef.h>

#include "flesh/status.h"

/* `stop` of the calling thread: a negative status ends what asks. NULL: nobody is asked. `data` is borrowed. */
void flesh_stop_set(int (*stop)(void *data), void *data);

/* From here to the end `stop` is asked; elsewhere, as within steps, it is not. Returns at the end what it said. */
void flesh_stop_begin(void);
int flesh_stop_end(void);

/* Returns what `stop` says, FLESH_OK where it is not asked; once it has said no, it is not asked again. */
int flesh_stop_ask(void);

/* Asks in a loop's k-th turn, of which one in 4096 asks: what is small is not asked for. */
static inline int flesh_stop_ask_at(size_t k) { return k % 4096 == 4095 ? flesh_stop_ask() : FLESH_OK; }
/* Asks before a loop of so many turns. */
static inline int flesh_stop_ask_before(size_t turns) { return turns >= 4096 ? flesh_stop_ask() : FLESH_OK; }

#endif
