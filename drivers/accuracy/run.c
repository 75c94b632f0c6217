/* run.c: runs the rows one at a time on each rank, each in a process of its own, and makes tables, words and pictures. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "accuracy/accuracy.h"
#include "base/confine.h"
#include "base/error.h"
#include "base/folder.h"
#include "base/file.h"
#include "cli/interrupt.h"
#include "study/lead.h"

/* Whether a row from `first` to before `end` is not done. */
static int is_open(const flesh_accuracy_plan *plan, int first, int end)
{
  for (; first < end; first++)
    if (!plan->rows[first].done) return 1;
  return 0;
}

/* The other prices, from row `first` on; that they cannot be measured is told, and is no failure. */
static int run_prices(flesh_accuracy_plan *plan, const flesh_study *study, flesh_study_store *store,
                      const flesh_accuracy_work *given, flesh_accuracy_track *tight)
{
  if (!is_open(plan, store->first, store->end)) return FLESH_OK;
  const int made = flesh_accuracy_make_tight(plan, given->reference, tight);
  if (made == FLESH_ERR_INTERRUPTED || flesh_interrupt_signal()) return FLESH_ERR_INTERRUPTED;
  if (made == FLESH_ERR_FILE) return made;
  if (!made) return flesh_study_run(study, store, &plan->options);
  fprintf(stderr, "flesh accuracy: %s\n", flesh_error_text());
  return FLESH_OK;
}

static int run_all(flesh_accuracy_plan *plan, flesh_study_store *store, const flesh_accuracy_track *reference)
{
  char path[1400], words[1024];
  flesh_accuracy_track tight = {0};
  const flesh_accuracy_work given = {plan, reference, &tight};
  const flesh_study study = flesh_accuracy_study(&given, plan);
  int work_rows = 0, done = 0;
  while (work_rows < plan->row_count && plan->rows[work_rows].group == FLESH_ACCURACY_WORK) work_rows++;
  store->end = work_rows;
  int status = flesh_study_run(&study, store, &plan->options);
  store->first = work_rows, store->end = plan->row_count;
  if (!status) status = run_prices(plan, &study, store, &given, &tight);
  snprintf(words, sizeof words, "%s", flesh_error_text());
  const int viewed = flesh_study_store_make_views(store);
  flesh_accuracy_tight_path(plan, path);
  flesh_path_unlink(path);
  flesh_accuracy_track_close(&tight);
  for (int k = 0; k < plan->row_count; k++) done += plan->rows[k].done;
  if (status == FLESH_ERR_INTERRUPTED || (!status && flesh_interrupt_signal()))
    return flesh_fail(FLESH_ERR_INTERRUPTED, "interrupted after %d of %d runs; --resume goes on with the others", done,
                      plan->row_count);
  return status ? flesh_fail(status, "%s", words) : viewed;
}

/* The rows, in the database that is open. */
static int run_rows(flesh_accuracy_plan *plan, flesh_study_store *store)
{
  flesh_accuracy_track reference = {0};
  int had = 0;
  for (int k = 0; k < plan->row_count; k++) had += plan->rows[k].done;
  printf("%d runs", plan->row_count);
  if (had) printf(", %d of them done before", had);
  printf(", compared at every step of theirs\n");
  fflush(stdout);
  int status = flesh_accuracy_make_reference(plan, &reference);
  if (!status) status = flesh_accuracy_keep(plan);
  if (!status) status = run_all(plan, store, &reference);
  flesh_accuracy_track_close(&reference);
  return status;
}

int flesh_accuracy_run(flesh_accuracy_plan *plan)
{
  char path[1400];
  flesh_study_store store = {.lock = -1};
  const flesh_accuracy_work given = {plan, NULL, NULL};
  snprintf(path, sizeof path, "%.1300s/steps", plan->out);
  int status = flesh_folder_make(path);
  if (!status) status = flesh_accuracy_load(plan);
  if (status) return status;
  const flesh_study study = flesh_accuracy_study(&given, plan);
  status = flesh_study_store_open(&study, &plan->options, &store);
  if (!status) status = flesh_study_store_load(&store, &study);
  const int opened = !status;
  if (!status) status = run_rows(plan, &store);
  flesh_study_store_close(&store);
  if (status && (!opened || !*plan->reference.first)) return status;
  flesh_accuracy_find_fronts(plan);
  const flesh_study_results results = {flesh_accuracy_write_csv, flesh_accuracy_write_verdict, flesh_accuracy_draw};
  return flesh_study_conclude(&study, plan->out, &results, plan, status);
}
