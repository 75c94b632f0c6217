/* threads.h: functions of threads for the library only, beside flesh/threads.h. */
#ifndef FLESH_BASE_THREADS_H
#define FLESH_BASE_THREADS_H

#include "flesh/threads.h"

/* Returns the number of processors that this process may use. */
int flesh_threads_available(void);

#endif
