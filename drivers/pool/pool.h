/* pool.h: does numbered cases, each in a process of its own, so that a crash or a hang is a result, too: some at a time
 * on this rank, and some on the other ranks that a launcher of MPI has started, each of which takes the next case as
 * soon as it is free. */
#ifndef FLESH_POOL_POOL_H
#define FLESH_POOL_POOL_H

#include "pool/pool_cases.h"

typedef struct flesh_ranks flesh_ranks; /* run/ranks.h */

typedef struct flesh_pool flesh_pool;

/* Returns the number of cases at a time on each rank: `given`, or if that is 0, the number of this machine's
 * processors, or 1 if there are several ranks. */
int flesh_pool_jobs(const flesh_ranks *ranks, int given);
/* Returns the number of cases at a time on all ranks together, at most `count`. */
int flesh_pool_slots(const flesh_ranks *ranks, int jobs, int count);

/* Makes a pool for `count` cases, `jobs` at a time on each rank. Borrows `cases`; *pool is new. FLESH_ERR_MEMORY. */
int flesh_pool_open(flesh_ranks *ranks, int jobs, int count, const flesh_pool_cases *cases, flesh_pool **pool);
/* Kills the cases that still run. NULL-safe; sets *pool to NULL. */
void flesh_pool_close(flesh_pool **pool);

/* Returns whether another case can be started. */
int flesh_pool_has_room(const flesh_pool *pool);
/* Starts a case; there must be room. If no more processes can be had, *started is 0 and there are fewer slots from
 * then on; if no slot is left, that is an error. FLESH_ERR_FILE, FLESH_ERR_MEMORY. */
int flesh_pool_start(flesh_pool *pool, int number, int *started);
/* Waits until a case has ended, a signal has come or a moment has passed. A signal (interrupt.h; on any rank) is passed
 * on once to all running cases, and those that have not ended after 2 s are killed. FLESH_ERR_MEMORY. */
int flesh_pool_wait(flesh_pool *pool, flesh_pool_end *end);
/* Runs a command whose cases are done by all ranks, and returns its exit code. `name`: the command's. `status`: that of
 * the plans, which every rank has made for itself; if any is an error, the worst is reported by one rank and ends all.
 * Otherwise the first rank calls lead(data), which hands out cases by a pool and returns the exit code; the others do
 * the cases that they are given until they get that code. */
int flesh_pool_lead(flesh_ranks *ranks, const char *name, int status, int jobs, const flesh_pool_cases *cases,
                    int (*lead)(void *data), void *data);

/* Idle ranks of a run that has more ranks than work for them. flesh_pool_stand_by waits on an idle rank until that is
 * dismissed, and returns the exit code; a signal to an idle rank counts as one to the first rank, which calls
 * flesh_pool_listen. */
int flesh_pool_stand_by(void);
void flesh_pool_listen(const flesh_ranks *ranks);
void flesh_pool_dismiss(const flesh_ranks *ranks, int code);

#endif
