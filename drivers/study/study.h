/* study.h: a study: cases that differ in the values of named columns, each run in a process of its own, whose records
 * go to a database. A study that is killed at any moment can be resumed; studies can be split into shards, extended by
 * cases, joined and queried by SQL. Each command defines by a flesh_study what a case is and how its record is used. */
#ifndef FLESH_STUDY_STUDY_H
#define FLESH_STUDY_STUDY_H

#include <jansson.h>
#include <sqlite3.h>
#include <stddef.h>

#include "cli/options.h"
#include "cli/overrides.h"
#include "flesh/scene.h"
#include "pool/pool.h"
#include "run/runner.h"
#include "scene/node.h"

/* Named numbers of a struct: how figures are written to the record of a case, and read from it. */
typedef struct flesh_study_field {
  const char *name;
  enum { FLESH_FIELD_INT, FLESH_FIELD_LONG, FLESH_FIELD_DOUBLE } kind;
  size_t offset;
} flesh_study_field;

/* Returns the numbers as a new object; NaN becomes null. A NULL name ends the fields. */
json_t *flesh_fields_json(const flesh_study_field *fields, const void *from);
/* Fills the struct from an object. Returns -1 at a field that the object lacks, and leaves the rest unchanged. */
int flesh_fields_read(const flesh_study_field *fields, const json_t *object, void *to);
/* Returns a new array of the fields' names. */
json_t *flesh_fields_names(const flesh_study_field *fields);

/* Returns the word for a flesh_status in the column `status`; `otherwise` for statuses that have no common word. */
const char *flesh_fields_status(int status, const char *otherwise);
/* Returns the new record of a case that has ended. It takes `figures`, NULL: none; `message` may be empty. */
json_t *flesh_fields_record(const char *status, int exit_code, const char *message, json_t *figures);
/* Runs a scene and returns its record, whose result is that of result.json with all figures of the run; *outcome says how
 * the run ended. */
json_t *flesh_study_run_scene(const flesh_scene *scene, const flesh_runner_options *options, flesh_outcome *outcome);
/* Reads the record of a case into figures of these fields and into `message`. If the case's process reported nothing,
 * *crashed_by is the signal that ended it, or -1 if it ended otherwise, and the figures are unchanged; else *crashed_by
 * is 0. FLESH_ERR_FILE: the record is incomplete; `study` names the database. */
enum { FLESH_STUDY_MESSAGE = 400 };
int flesh_fields_take(const flesh_study_field *fields, const char *study, const json_t *record, void *figures,
                      char message[FLESH_STUDY_MESSAGE], int *crashed_by);

enum { FLESH_STUDY_COLUMNS = 64 };

typedef struct flesh_study_column {
  const char *name, *key;  /* column in the database; the key that it sets, for people */
  const flesh_node *place; /* place in a spec, for error messages; NULL: none */
  int hidden;              /* its value stands in the column `scene` that every case has */
  int is_digest;           /* its value tells people nothing */
  /* Members for a sweep; NULL for other studies. */
  int count;                /* of its values */
  const char **values;      /* YAML texts, as --set takes them */
  const flesh_node **nodes; /* nodes of the values in the spec; NULL for computed values */
} flesh_study_column;

/* A column of the view `results` that an expression in SQL defines. */
typedef struct flesh_study_derived {
  const char *name, *expression;
  const flesh_node *node;
} flesh_study_derived;

/* A case. */
typedef struct flesh_study_case {
  const char *values[FLESH_STUDY_COLUMNS];      /* of the columns, as YAML; numbers become numbers of the database */
  const flesh_node *nodes[FLESH_STUDY_COLUMNS]; /* nodes of the values in a spec; NULL: none */
  int repeat;                                   /* counted from 1 */
  const char *scene;                            /* NULL: none */
  flesh_overrides overrides;                    /* as for --set; owned */
  flesh_arena arena;                            /* for texts of values; owned */
} flesh_study_case;
void flesh_study_case_free(flesh_study_case *made);
/* Returns a number in as few digits as read back as it, in the case's arena; NULL when out of memory. */
const char *flesh_study_case_number(flesh_study_case *made, double number);

/* A study; its cases are numbered from 0. */
typedef struct flesh_study {
  const char *name;        /* the database is DIR/<name>.db */
  const char *text, *path; /* of the spec; NULL: none */
  const char *fingerprint; /* of what all cases have in common; a study is resumed, or joined, only if it agrees */
  const char *different;   /* said if the fingerprint differs: "the scene has changed since; undo that" */
  const flesh_study_column *columns; /* ended by a column without a name */
  int repeats; /* if above 1 there is a column `repeat` */
  int derived_count;
  const flesh_study_derived *derived;
  int case_count;
  double max_seconds; /* a case's process is killed after this time; 0: never */
  double budget;      /* seconds after which cases stop by themselves, for messages; 0: none */
  const char *again;  /* condition in SQL on the table `cases`: finished cases that --resume runs again; NULL: none */
  const char *table, *words; /* names of the results that are printed; NULL: <name>.csv, verdict.txt */
  const char *results[5]; /* SQL that makes tables and texts from the cases (results.h); ended by NULL */
  /* Returns a new object of facts about a case that are not in its row, for the SQL's table facts (number, data); NULL
   * for a case without facts. The member is NULL if there are none at all. */
  json_t *(*facts)(const void *data, int number);
  /* Makes the mesh of the case's body, new, for the pictures that the SQL asks for (bodies.h), and sets the camera. The
   * member is NULL if there are no pictures. */
  int (*body)(const void *data, int number, flesh_mesh **mesh, flesh_camera *camera);
  int asks;           /* several processes may work on the database: its folder is not claimed, and if it exists, the study
                         needs --resume, where others start again. Whether cases could use their files is their affair */
  void *data;         /* passed to the functions below */

  /* Makes the values of a case, which the caller frees; one that is NULL is one for which there was no memory. An error
   * has nothing made. */
  int (*make)(const void *data, int number, flesh_study_case *made);
  /* The names of the figures in the order of their columns: those of `fields` or, if that is NULL, of what `figures`
   * returns, new: an array of names, such as "J_min", "energies.gravity" or probes."tip.position_z".max, or an object like
   * that in a record, whose values do not count. */
  const flesh_study_field *fields;
  json_t *(*figures)(const void *data);
  /* Runs the case in this process and returns its record: {"status", "exit_code", "message", "result": {"figures":
   * ...}}, and "rows" of a table. The status is "interrupted" if a signal ended it. */
  json_t *(*work)(const void *data, int number, const char *folder);
  /* Returns the path of the folder that the case fills, with its log, as new text; NULL if it keeps nothing. The member
   * is NULL if cases handle their folders and their output themselves. */
  char *(*folder)(const void *data, int number);
  /* Stores a record in memory, just after it was written, or when it is read back from an earlier run; an error ends
   * the study. The member may be NULL. A record without a result comes from a process that crashed. */
  int (*take)(void *data, int number, const json_t *record);
} flesh_study;

/* An open database of a study. */
typedef struct flesh_study_store {
  sqlite3 *database;
  char *path;
  char worker[200]; /* name of this process in the tables; empty until it works */
  int lock;         /* file whose lock shows that this process lives; -1: none */
  char *lock_path;
  int shard, shards; /* of this database; 1/1 if it is whole */
  int first, end;    /* numbers of the cases that may be claimed: from `first` to before `end` */
} flesh_study_store;

/* How a study is started or resumed. */
typedef struct flesh_study_options {
  flesh_ranks *ranks; /* NULL: none */
  const char *out;    /* folder of the database */
  const char *shard;  /* "2/8", counted from 1; NULL: all cases */
  int jobs;           /* number of cases at a time on each rank */
  int resume, quiet;
  int argc;
  char **argv; /* command line, for the provenance */
  flesh_overrides overrides; /* --set */
} flesh_study_options;

/* Reads a shard such as "2/8". FLESH_ERR_ARGUMENT. */
int flesh_study_read_shard(const char *text, int *shard, int *shards);

/* Checks tables, views and derived columns, in memory. */
int flesh_study_store_check(const flesh_study *study);
/* Creates the database or continues with it. Cases that it lacks are added. */
int flesh_study_store_open(const flesh_study *study, const flesh_study_options *options, flesh_study_store *store);
/* Opens an existing database to read it. */
int flesh_study_store_read(const char *path, flesh_study_store *store);
void flesh_study_store_close(flesh_study_store *store);
/* Adds to this study a case with a number beyond study->case_count, whatever the shard. */
int flesh_study_store_want(flesh_study_store *store, const flesh_study *study, int number);
/* Plans the case `number`, or every case if it is -1, again if the condition in SQL on `cases` holds and the case is
 * not running. */
int flesh_study_store_redo(flesh_study_store *store, const char *condition, int number);
/* Claims the next case for this process; *number is -1 if none is left to start. */
int flesh_study_store_claim(flesh_study_store *store, int *number);
/* Writes the case's row and, in the same transaction, claims the next case (*next, may be NULL). `record` is
 * borrowed. */
int flesh_study_store_finish(flesh_study_store *store, int number, const json_t *record, double seconds, int *next);
/* Releases a case that was not finished. */
int flesh_study_store_release(flesh_study_store *store, int number);
/* Makes cases planned again whose processes have ended; *count is their number, and *running that of the cases of
 * living processes. */
int flesh_study_store_recover(flesh_study_store *store, int *count, int *running);
/* Returns how many cases of this study have a status: "planned", "running", "complete"; NULL for all. */
int flesh_study_store_count(flesh_study_store *store, const char *status);
/* Passes the records of all cases that are done to study->take. */
int flesh_study_store_load(flesh_study_store *store, const flesh_study *study);
/* Fails with FLESH_ERR_FILE if cases could not write or read their files: "3 of 4 cases ...; the first: ...". */
int flesh_study_store_judge(flesh_study_store *store);
/* Makes the view `results` again from the columns that the cases' results have. */
int flesh_study_store_make_views(flesh_study_store *store);
/* Fails with FLESH_ERR_FILE and SQLite's message. */
int flesh_study_store_fail(const flesh_study_store *store, const char *doing);
/* Writes SQLite's message on the last call into `text`, which it returns. If a column does not exist, it adds the most
 * similar column of `table`, a name or a select in brackets. */
enum { FLESH_STUDY_WORDS = 1024 };
const char *flesh_study_store_words(const flesh_study_store *store, const char *table, char text[FLESH_STUDY_WORDS]);
/* Formats SQL with sqlite3_mprintf. The first executes the statements; the second returns the number that the query
 * gives, 0 if none. */
int flesh_study_store_execute(flesh_study_store *store, const char *format, ...);
int flesh_study_store_number(flesh_study_store *store, const char *format, ...);

/* Runs the planned cases of the store. FLESH_ERR_INTERRUPTED if a signal ended it; finished cases are kept. */
int flesh_study_run(const flesh_study *study, flesh_study_store *store, const flesh_study_options *options);
/* Makes the views and the results of an open database and prints where they are. `ran` is the status of the cases,
 * which is returned if it is an error: after an interruption no pictures are made, after another failure only
 * tables. */
int flesh_study_conclude(const flesh_study *study, flesh_study_store *store, const flesh_study_options *options, int ran);
/* Opens the database, passes on what is done, runs the rest, and concludes. FLESH_ERR_FILE also if a case could not
 * write or read its files, since such a case says nothing about the study's question. */
int flesh_study_do(const flesh_study *study, const flesh_study_options *options);

/* Rows of the option table that all studies have; `name` and `further` are texts. */
#define FLESH_STUDY_OPTION_ROWS(options, name, further)                                                                \
  {"out", "DIR", FLESH_OPTION_TEXT, &(options)->out, "folder of the results (default out/" name ")"},                  \
      {"resume", NULL, FLESH_OPTION_SWITCH, &(options)->resume, "begin DIR/" name ".db or go on with it, " further},  \
      {"shard", "I/N", FLESH_OPTION_TEXT, &(options)->shard, "only every N-th case from the I-th on, counted from 1"}
#define FLESH_STUDY_OPTION_JOBS(options)                                                                               \
  {"jobs", "N", FLESH_OPTION_COUNT, &(options)->jobs,                                                                  \
   "cases at a time, on each rank (default: the processors; on several ranks 1)"}

#define FLESH_STUDY_OPTION_SET(options, doc)                                                                          \
  {"set", "KEY=VALUE", FLESH_OPTION_LIST, &(options)->overrides.texts, doc}

/* Joins the ranks, copies argv, which reading permutes, and reads the command line with flesh_ranks_read_options.
 * Returns its code, or the exit code of what failed. flesh_study_close follows in any case. */
int flesh_study_open(flesh_study_options *options, const flesh_usage *usage, int argc, char **argv, int *count);
void flesh_study_close(flesh_study_options *options);

/* Runs the study on all ranks: the first one claims the folder of the results and calls `course`, NULL: flesh_study_do,
 * which runs the cases and makes the results; the others run the cases that they are given. `status`: of making the plan,
 * which every rank has done. Returns the exit code. */
typedef int flesh_study_course(const flesh_study *study, const flesh_study_options *options);
int flesh_study_lead(const flesh_study *study, flesh_study_options *options, int status, flesh_study_course *course);

#endif
