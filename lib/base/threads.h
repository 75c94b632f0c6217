/* threads.h: what the library asks of its threads beside flesh/threads.h. */
#ifndef FLESH_BASE_THREADS_H
#define FLESH_BASE_THREADS_H

#include "flesh/threads.h"

/* How many processors this process may use. */
int flesh_threads_available(void);

#endif
