/* lead.c: a study as a command. */
#include "study/lead.h"

#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/folder.h"
#include "cli/output.h"
#include "run/ranks.h"

int flesh_study_open(flesh_study_options *options, const flesh_usage *usage, int argc, char **argv, int *count)
{
  int status = flesh_ranks_open(&options->ranks);
  if (!status) status = flesh_overrides_open(&options->overrides, argc);
  options->argc = argc;
  options->argv = calloc((size_t)argc + 1, sizeof *argv);
  if (options->argv) memcpy(options->argv, argv, sizeof *argv * (size_t)argc);
  else if (!status) status = flesh_no_memory();
  return status ? flesh_command_fail(usage->command, status)
                : flesh_ranks_read_options(options->ranks, usage, argc, argv, count);
}

void flesh_study_close(flesh_study_options *options)
{
  flesh_ranks_close(&options->ranks);
  flesh_overrides_close(&options->overrides);
  free(options->argv);
}

typedef struct leader {
  const char *name, *out;
  int (*compare)(void *plan);
  void *plan;
} leader;

/* On the first rank; the exit code. */
static int lead(void *data)
{
  const leader *l = data;
  flesh_folder_claim claim = {.descriptor = -1};
  int status = flesh_output_claim(l->out, l->name, &claim);
  if (!status) status = l->compare(l->plan);
  flesh_folder_claim_release(&claim);
  return status ? flesh_command_fail(l->name, status) : 0;
}

int flesh_study_lead(const flesh_study *study, flesh_study_options *options, int status, int (*compare)(void *plan),
                     void *plan)
{
  int shard, shards;
  if (!status) status = flesh_study_read_shard(options->shard, &shard, &shards);
  options->jobs = flesh_pool_jobs(options->ranks, options->jobs);
  const flesh_study_work given = {study, NULL};
  const flesh_pool_cases cases = flesh_study_pool_cases(&given);
  leader l = {study->name, options->out, compare, plan};
  return flesh_pool_lead(options->ranks, study->name, status, options->jobs, &cases, lead, &l);
}
