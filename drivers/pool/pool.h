/* pool.h: cases that are done by number, each in a process of its own, so that a crash or a hang in one is an answer too:
 * some at a time here, and on the ranks that a launcher of MPI has started, each of which takes the next case as soon as
 * it is free. */
#ifndef FLESH_POOL_POOL_H
#define FLESH_POOL_POOL_H

#include "pool/pool_cases.h"

typedef struct flesh_ranks flesh_ranks; /* run/ranks.h */

typedef struct flesh_pool flesh_pool;

/* How many at a time on each rank: as many as `given`, or, for 0, the processors of this machine, one where there are
 * ranks. */
int flesh_pool_jobs(const flesh_ranks *ranks, int given);
/* At a time on all ranks together, of so many. */
int flesh_pool_places(const flesh_ranks *ranks, int jobs, int count);

/* For `count` cases, `jobs` at a time on each rank. Borrows `cases`. Returns new. Errors: FLESH_ERR_MEMORY. */
int flesh_pool_open(flesh_ranks *ranks, int jobs, int count, const flesh_pool_cases *cases, flesh_pool **pool);
/* Ends what still runs. NULL-safe; sets *pool to NULL. */
void flesh_pool_close(flesh_pool **pool);

/* Whether there is a place for one more. */
int flesh_pool_has_room(const flesh_pool *pool);
/* Starts the case where there is a place. Where no more processes can be had, there are fewer places from then on, and
 * *started is 0; an error where there is none left. Errors: FLESH_ERR_FILE, FLESH_ERR_MEMORY. */
int flesh_pool_start(flesh_pool *pool, int number, int *started);
/* Waits until a case has ended, a signal has come or a moment has passed. A signal (interrupt.h; on any rank) is passed
 * on to all that run, once; what has not ended 2 s later is killed. Errors: FLESH_ERR_MEMORY. */
int flesh_pool_wait(flesh_pool *pool, flesh_pool_end *end);
/* A command whose cases all ranks do. `name` is the command's, `status` what came of its plans, which every rank has made
 * for itself: the worst of all is told by one rank and ends all. Then the first rank calls lead(data), which hands out
 * cases by a pool and returns the exit code; the others do what they are given until they get that code. Returns it. */
int flesh_pool_lead(flesh_ranks *ranks, const char *name, int status, int jobs, const flesh_pool_cases *cases,
                    int (*lead)(void *data), void *data);

/* Idle ranks of a run with more ranks than there is work for. An idle rank stands by until it is dismissed, and returns
 * the exit code; a signal to it counts as one to the first rank, which listens. */
int flesh_pool_stand_by(void);
void flesh_pool_listen(const flesh_ranks *ranks);
void flesh_pool_dismiss(const flesh_ranks *ranks, int code);

#endif
