/* lead.h: a study as a command: its options, its ranks, and what is made of its cases. */
#ifndef FLESH_STUDY_LEAD_H
#define FLESH_STUDY_LEAD_H

#include "cli/options.h"
#include "study/study.h"

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
