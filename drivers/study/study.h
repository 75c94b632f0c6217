/* study.h: a study: cases that differ in the values of named columns, each done in a process of its own, whose records go
 * to a database. Killed at any moment, it goes on from there; it may be shared out as shards, extended by cases, joined and
 * asked by SQL. What a case is and what is made of its record is for each command to say, by a flesh_study. */
#ifndef FLESH_STUDY_STUDY_H
#define FLESH_STUDY_STUDY_H

#include <jansson.h>
#include <sqlite3.h>
#include <stddef.h>

#include "cli/options.h"
#include "cli/overrides.h"
#include "flesh/scene.h"
#include "pool/pool.h"
#include "scene/node.h"

/* Numbers of a struct by name: how figures go into the record of a case, and come back from it. */
typedef struct flesh_study_field {
  const char *name;
  enum { FLESH_FIELD_INT, FLESH_FIELD_LONG, FLESH_FIELD_DOUBLE } kind;
  size_t offset;
} flesh_study_field;

/* New object; NaN becomes null. A NULL name ends the fields. */
json_t *flesh_fields_json(const flesh_study_field *fields, const void *from);
/* Fills the struct; -1, and the rest is left, where the object has not one of them. */
int flesh_fields_read(const flesh_study_field *fields, const json_t *object, void *to);
/* New array of their names. */
json_t *flesh_fields_names(const flesh_study_field *fields);

/* How a case ended with this flesh_status, in the column `status`; `otherwise`: where it is none of those that all tell. */
const char *flesh_fields_status(int status, const char *otherwise);
/* New record of a case that has ended, with these figures, which it takes. `message` may be empty. */
json_t *flesh_fields_record(const char *status, int exit_code, const char *message, json_t *figures);
/* Takes the record of a case into figures of these fields and into `message`. *crashed_by is 0 or, where its process
 * reported nothing, the signal that ended it, -1 for another end; the figures are then as they were. FLESH_ERR_FILE: the
 * record is not whole; `study` names the database. */
enum { FLESH_STUDY_MESSAGE = 400 };
int flesh_fields_take(const flesh_study_field *fields, const char *study, const json_t *record, void *figures,
                      char message[FLESH_STUDY_MESSAGE], int *crashed_by);

enum { FLESH_STUDY_COLUMNS = 64 };

typedef struct flesh_study_column {
  const char *name, *key;  /* of the database; what it sets, for people */
  const flesh_node *place; /* in a spec, for sentences; NULL: none */
  int hidden;              /* its value stands in the column `scene` that every case has */
  /* A sweep's own; NULL: none. */
  const char **values;      /* as YAML texts, as they go to --set */
  const flesh_node **nodes; /* of the values in the spec; NULL where they were computed */
} flesh_study_column;

/* A column of the view `results` by an expression of SQL. */
typedef struct flesh_study_derived {
  const char *name, *expression;
  const flesh_node *node;
} flesh_study_derived;

/* A case. */
typedef struct flesh_study_case {
  const char *values[FLESH_STUDY_COLUMNS];      /* of the columns, as YAML; numbers become numbers of the database */
  const flesh_node *nodes[FLESH_STUDY_COLUMNS]; /* of the values in a spec; NULL: none */
  int repeat;                                   /* from 1 */
  const char *scene;                            /* NULL: none */
  flesh_overrides overrides;                    /* as for --set; owned */
  void *owned;                                  /* where texts of values stand; NULL: nowhere of the case's own */
} flesh_study_case;
void flesh_study_case_free(flesh_study_case *made);

/* Cases have numbers from 0. */
typedef struct flesh_study {
  const char *name;        /* the database is DIR/<name>.db */
  const char *text, *path; /* of the spec; NULL: none */
  const char *fingerprint; /* of what all cases have in common: a study goes on, or is joined, with its like */
  const char *different;   /* what is said where it is another: "the scene has changed since; undo that" */
  const flesh_study_column *columns; /* one without a name ends them */
  int repeats; /* above 1 there is a column `repeat` */
  int derived_count;
  const flesh_study_derived *derived;
  int case_count;
  double max_seconds; /* after which a case's process is ended; 0: never */
  double budget;      /* that cases stop at by themselves, for the words; 0: none */
  const char *again;  /* condition in SQL on the table `cases`: which of those done --resume does again; NULL: none */
  const char *table, *words; /* names of the results that are told of; NULL: <name>.csv, verdict.txt */
  const char *results[5]; /* SQL that makes tables and words of the cases (results.h); NULL ends it */
  /* New object of what that SQL knows of a case beside its row, in the table facts (number, data) of all cases; NULL: none.
   * What it returns NULL for has none. */
  json_t *(*facts)(const void *data, int number);
  /* Makes the mesh of the case's body, new, for pictures that this SQL asks for (bodies.h), and says how it is seen; NULL: there
   * are none. */
  int (*body)(const void *data, int number, flesh_mesh **mesh, flesh_camera *camera);
  int asks;           /* an existing database is gone on with only by --resume, and else refused instead of begun anew */
  const void *data;   /* of the calls below */

  /* Values of the case, to be freed; FLESH_ERR_MEMORY, and nothing made. */
  int (*make)(const void *data, int number, flesh_study_case *made);
  /* The names of the figures in the order of their columns: of these fields or, where they are NULL, a new array of such
   * as "J_min", "energies.gravity" or probes."tip.position_z".max. */
  const flesh_study_field *fields;
  json_t *(*figures)(const void *data);
  /* Does the case in this process, and returns its record: {"status", "exit_code", "message", "result": {"figures": ...}},
   * and "rows" of a table. The status is "interrupted" where a signal ended it. */
  json_t *(*work)(const void *data, int number, const char *folder);
  /* New path of the folder that the case fills, which has its log too; NULL where it keeps nothing. The member is NULL
   * where cases look after their folders, and speak. */
  char *(*folder)(const void *data, int number);
  /* Takes a record into memory, just after it was written or when it was written before; an error ends the study. NULL:
   * nobody asks. A record without a result is of a process that has crashed. */
  int (*take)(void *data, int number, const json_t *record);
  /* Title of the case, for the line of progress, which says how it ended as well; NULL: none. */
  void (*title)(const void *data, int number, char *text, size_t size);
  void *taker; /* data of take */
} flesh_study;

/* The database of a study. */
typedef struct flesh_study_store {
  sqlite3 *database;
  char *path;
  char worker[200]; /* this process in the tables; empty until it works */
  int lock;         /* file whose lock says that this process lives; -1: none */
  char *lock_path;
  int shard, shards; /* of this database: 1/1 when it is whole */
  int first, end;    /* numbers of the cases that are claimed: from the first to before the end */
  sqlite3_stmt *claim, *finish, *row;
} flesh_study_store;

/* Begins or goes on. */
typedef struct flesh_study_options {
  flesh_ranks *ranks; /* NULL: none */
  const char *out;    /* folder of the database */
  const char *shard;  /* "2/8", counted from 1; NULL: all */
  int jobs;           /* at a time on each rank */
  int resume, quiet;
  int argc;
  char **argv; /* the command line, for the provenance */
  flesh_overrides overrides; /* --set */
} flesh_study_options;

/* Reads "2/8". FLESH_ERR_ARGUMENT. */
int flesh_study_read_shard(const char *text, int *shard, int *shards);

/* Tries tables, views and derived columns without a file. */
int flesh_study_store_check(const flesh_study *study);
/* Makes the database or goes on with it. Cases that it has not are added. */
int flesh_study_store_open(const flesh_study *study, const flesh_study_options *options, flesh_study_store *store);
/* Opens one that is there, to read from. */
int flesh_study_store_read(const char *path, flesh_study_store *store);
void flesh_study_store_close(flesh_study_store *store);
/* Adds a case of a number beyond study->case_count, in every shard, to this study's. */
int flesh_study_store_want(flesh_study_store *store, const flesh_study *study, int number);
/* Plans the case, with -1 every one, again where the condition in SQL on `cases` holds, unless it runs. */
int flesh_study_store_redo(flesh_study_store *store, const char *condition, int number);
/* The next case for this process, -1 when none is left to be begun. */
int flesh_study_store_claim(flesh_study_store *store, int *number);
/* Writes the case's row, and in the same transaction claims the next (*next, may be NULL). `record` is borrowed. */
int flesh_study_store_finish(flesh_study_store *store, int number, const json_t *record, double seconds, int *next);
/* Gives a case back that was not finished. */
int flesh_study_store_release(flesh_study_store *store, int number);
/* Cases claimed by processes that have ended become planned again; *count of them, and *running of living ones. */
int flesh_study_store_recover(flesh_study_store *store, int *count, int *running);
/* How many cases of this study have a status: "planned", "running", "complete", NULL for all. */
int flesh_study_store_count(flesh_study_store *store, const char *status);
/* Gives the records of all cases that are done to study->take. */
int flesh_study_store_load(flesh_study_store *store, const flesh_study *study);
/* Fails, with the first one's sentence, when there are cases of a condition in SQL on `cases`: FLESH_ERR_ARGUMENT when
 * `all` are of it, or with all = 0 FLESH_ERR_FILE for any: "3 of 4 cases <words>; the first: ...". */
int flesh_study_store_judge(flesh_study_store *store, const char *condition, int all, const char *words);
/* Makes the view `results` anew from what the cases' results hold. */
int flesh_study_store_make_views(flesh_study_store *store);
/* FLESH_ERR_FILE with SQLite's words. */
int flesh_study_store_fail(const flesh_study_store *store, const char *doing);
/* Writes SQLite's words on the last call into `text`, which it returns. Where they say that there is no such column, it adds
 * the column of `table`, a name or a select in brackets, that is most like it. */
enum { FLESH_STUDY_WORDS = 1024 };
const char *flesh_study_store_words(const flesh_study_store *store, const char *table, char text[FLESH_STUDY_WORDS]);
/* Executes statements, which sqlite3_mprintf makes of the format, and returns the number that a query gives, 0 for none. */
int flesh_study_store_execute(flesh_study_store *store, const char *format, ...);
int flesh_study_store_number(flesh_study_store *store, const char *format, ...);

/* Runs what is planned of the store's cases. FLESH_ERR_INTERRUPTED when a signal ended it: what is done stands. */
int flesh_study_run(const flesh_study *study, flesh_study_store *store, const flesh_study_options *options);
/* The data of the processes of the cases, on every rank; `store` NULL: another rank has it. */
typedef struct flesh_study_work {
  const flesh_study *study;
  flesh_study_store *store;
} flesh_study_work;
flesh_pool_cases flesh_study_pool_cases(const flesh_study_work *given);
/* Makes the views and the results of an open database and says where they are. `ran` is the status of the cases, which is
 * returned where it is none: after an interruption there are no pictures, after another failure there are tables alone. */
int flesh_study_conclude(const flesh_study *study, flesh_study_store *store, const flesh_study_options *options, int ran);
/* Opens, takes what is done, runs the rest, and concludes. FLESH_ERR_FILE also when a case could not write or read its
 * files: it says nothing of what it was for. */
int flesh_study_do(const flesh_study *study, const flesh_study_options *options);

/* Rows of an option table that every study has; `name` and `further` are texts. */
#define FLESH_STUDY_OPTION_ROWS(options, name, further)                                                                \
  {"out", "DIR", FLESH_OPTION_TEXT, &(options)->out, "folder of the results (default out/" name ")"},                  \
      {"resume", NULL, FLESH_OPTION_SWITCH, &(options)->resume, "begin DIR/" name ".db or go on with it, " further},  \
      {"shard", "I/N", FLESH_OPTION_TEXT, &(options)->shard, "only every N-th case from the I-th on, counted from 1"}
#define FLESH_STUDY_OPTION_JOBS(options)                                                                               \
  {"jobs", "N", FLESH_OPTION_COUNT, &(options)->jobs,                                                                  \
   "cases at a time, on each rank (default: the processors; on several ranks 1)"}

#define FLESH_STUDY_OPTION_SET(options, doc)                                                                          \
  {"set", "KEY=VALUE", FLESH_OPTION_LIST, &(options)->overrides.texts, doc}

/* Joins the ranks, keeps the words, as reading permutes them, and reads the command line: flesh_ranks_read_options, or the
 * exit code of what failed. To be closed in any case. */
int flesh_study_open(flesh_study_options *options, const flesh_usage *usage, int argc, char **argv, int *count);
void flesh_study_close(flesh_study_options *options);

/* Does the study on all ranks: the first one calls compare(plan), which does the cases and makes what follows from them,
 * with the folder of the results claimed; the others do what cases they are given. `status` is what came of the plan,
 * which every rank has made. Returns the exit code. */
int flesh_study_lead(const flesh_study *study, flesh_study_options *options, int status, int (*compare)(void *plan),
                     void *plan);

#endif
