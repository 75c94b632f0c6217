/* sweep.h: scripted sweeps: what a spec says, the cases that follow from it, and the database they go to. */
#ifndef FLESH_SWEEP_SWEEP_H
#define FLESH_SWEEP_SWEEP_H

#include <jansson.h>
#include <sqlite3.h>
#include <string.h>

#include "base/key.h"
#include "scene/node.h"
#include "pool/pool.h"

typedef enum flesh_sweep_command {
  FLESH_SWEEP_RUN,
  FLESH_SWEEP_DRIFT,
  FLESH_SWEEP_ACCURACY,
  FLESH_SWEEP_HARDCASES
} flesh_sweep_command;
extern const char *const flesh_sweep_commands[]; /* their names; NULL ends the list */

/* A parameter that varies: a column of the database. Its values are YAML texts as they go to --set. */
typedef struct flesh_sweep_column {
  const char *name;         /* of the column */
  const char *key;          /* of the scene; "scene" chooses the scene itself */
  const flesh_node *place;  /* of its axis in the spec, for sentences */
  const char **values;      /* [count of its group] */
  const flesh_node **nodes; /* [count] of the values in the spec; NULL where they were computed */
} flesh_sweep_column;

/* An axis over scenes whose values stand in the column `scene` that every case has. */
static inline int flesh_sweep_is_scene(const flesh_sweep_column *column)
{
  return !strcmp(column->key, "scene") && !strcmp(column->name, "scene");
}

/* Columns that advance together; the groups are crossed, the last one fastest. */
typedef struct flesh_sweep_group {
  int count, first, columns;
} flesh_sweep_group;

enum { FLESH_SWEEP_COLUMNS = 64 };

typedef struct flesh_sweep {
  flesh_arena arena;
  const char *path;         /* of the spec */
  char *text;               /* the spec as it stands; freed by flesh_sweep_close */
  int command;              /* flesh_sweep_command */
  const char *scene;        /* path */
  const flesh_node *scene_node;
  int set_count;            /* constants of all cases, "key=value" */
  const char **set;
  const flesh_node **set_nodes;
  int argument_count; /* further words of the command line of drift, accuracy and hardcases */
  const char **arguments;
  int column_count, group_count;
  flesh_sweep_column columns[FLESH_SWEEP_COLUMNS];
  flesh_sweep_group groups[FLESH_SWEEP_COLUMNS];
  int derived_count; /* columns of the view `results` by SQL expressions */
  struct flesh_sweep_derived {
    const char *name, *expression;
    const flesh_node *node;
  } *derived;
  int repeats;        /* >= 1; above 1 there is a column `repeat` */
  int seed;           /* -1: the scene's own */
  int keep;           /* whether each case keeps a folder of results */
  double max_seconds; /* of each case; 0: no limit */
  int case_count;
  char fingerprint[65]; /* of the spec and the scenes it names */
} flesh_sweep;

/* Reads and checks a spec: every value of every axis is tried on the scene's keys. FLESH_ERR_ARGUMENT with
 * "file:line:column: ..." or FLESH_ERR_FILE. Zero-initialise; close in any case. */
int flesh_sweep_read(const char *path, flesh_sweep *sweep);
void flesh_sweep_close(flesh_sweep *sweep);
/* The table of the spec's keys in words, for the help. */
void flesh_sweep_describe_keys(FILE *stream);

/* Expands samples: `count` points of `dimensions` numbers in (0, 1) by `sequence`, an index into
 * flesh_sweep_sequences; points [count * dimensions]. Seed 0: the sequence as it is; others shift it as a whole, modulo
 * 1, by random numbers (Cranley & Patterson 1976). "random" is plain random numbers of the seed. */
extern const char *const flesh_sweep_sequences[];
int flesh_sweep_sample(int sequence, int dimensions, int count, int skip, int seed, double *points);

/* One case of a sweep, numbered from 1. */
typedef struct flesh_sweep_case {
  int id;
  const char *scene;
  int count;                                 /* of all overrides in their order */
  const char **overrides;                    /* owned */
  const char *values[FLESH_SWEEP_COLUMNS];   /* of the columns */
  const flesh_node *nodes[FLESH_SWEEP_COLUMNS]; /* of the values in the spec; NULL where computed */
  int repeat;                                /* from 1 */
} flesh_sweep_case;
/* FLESH_ERR_MEMORY, and nothing made. */
int flesh_sweep_case_make(const flesh_sweep *sweep, int id, flesh_sweep_case *made);
void flesh_sweep_case_free(flesh_sweep_case *made);

/* Whether some case of the shard can be built: tries them in their order, before anything is written. The first one's
 * sentence when all are refused. Without an answer (memory, a signal) FLESH_OK. */
int flesh_sweep_case_try(const flesh_sweep *sweep, int shard, int shards);

/* Runs the case in this process; `folder` NULL: nothing is kept. Returns what the database is to know: {"status",
 * "exit_code", "message", "result": {...}} or, of the other commands, also "rows": [...]. */
json_t *flesh_sweep_case_run(const flesh_sweep *sweep, const flesh_sweep_case *c, const char *folder);

/* The database. */
typedef struct flesh_sweep_store {
  sqlite3 *database;
  char *path;
  char worker[200]; /* this process in the tables; empty until it works */
  int lock;         /* file whose lock says that this process lives; -1: none */
  char *lock_path;
  int shard, shards; /* of this database: 1/1 when it is whole */
  sqlite3_stmt *claim, *begin, *finish, *row;
} flesh_sweep_store;

extern const char flesh_sweep_schema_text[]; /* the tables, for the help */

/* Tries tables, views and derived columns without a file. */
int flesh_sweep_store_check(const flesh_sweep *sweep);
/* Makes or, with `resume`, goes on with the database of the sweep. */
int flesh_sweep_store_open(const char *path, const flesh_sweep *sweep, int shard, int shards, int resume,
                           int argc, char **argv, flesh_sweep_store *store);
/* Opens one that is there, to read from. */
int flesh_sweep_store_read(const char *path, flesh_sweep_store *store);
void flesh_sweep_store_close(flesh_sweep_store *store);
/* The next case for this process, 0 when none is left to be begun. */
int flesh_sweep_store_claim(flesh_sweep_store *store, int *id);
/* Writes the case's row, and in the same transaction claims the next (*next, may be NULL). `record` is borrowed. */
int flesh_sweep_store_finish(flesh_sweep_store *store, int id, const json_t *record, double seconds, int *next);
/* Gives a case back that was not finished. */
int flesh_sweep_store_release(flesh_sweep_store *store, int id);
/* Cases claimed by processes that have ended become planned again; *count of them, and *running of living ones. */
int flesh_sweep_store_recover(flesh_sweep_store *store, int *count, int *running);
/* How many cases have a status: "planned", "running", "complete", NULL for all. */
int flesh_sweep_store_count(flesh_sweep_store *store, const char *status);
/* FLESH_ERR_ARGUMENT with the first one's sentence when all cases are refused. */
int flesh_sweep_store_judge(flesh_sweep_store *store);
/* Makes the view `results` anew from what the cases' results hold. */
int flesh_sweep_store_make_views(flesh_sweep_store *store);
/* FLESH_ERR_FILE with SQLite's words. */
int flesh_sweep_store_fail(const flesh_sweep_store *store, const char *doing);
int flesh_sweep_store_execute(flesh_sweep_store *store, const char *sql);

/* Runs what is planned, `jobs` at a time on each rank. */
typedef struct flesh_sweep_run_options {
  flesh_ranks *ranks; /* NULL: none */
  int jobs, quiet;
  const char *out;
} flesh_sweep_run_options;
/* The data that the processes of the cases need. */
typedef struct flesh_sweep_work {
  const flesh_sweep *sweep;
  const char *out;
  flesh_sweep_store *store; /* NULL: another rank has it */
} flesh_sweep_work;
flesh_pool_cases flesh_sweep_pool_cases(const flesh_sweep_work *given);
int flesh_sweep_run(const flesh_sweep_work *given, flesh_sweep_store *store, const flesh_sweep_run_options *options);

int flesh_sweep_export(int argc, char **argv);
int flesh_sweep_plot(int argc, char **argv);
int flesh_sweep_merge(int argc, char **argv);

#endif
