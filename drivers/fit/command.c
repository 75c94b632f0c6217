/* command.c: `flesh fit SPEC`: fits parameters of scenes to measurements. */
#include "commands.h"

#include <gsl/gsl_errno.h>
#include <stdlib.h>

#include "base/confine.h"
#include "base/error.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "fit/fit.h"
#include "run/ranks.h"
#include "study/embedded.h"
#include "study/study.h"

/* Fails if a file that is to be written would replace an input. */
static int spare_inputs(const flesh_fit *fit)
{
  static const char *const names[] = {"result.json", "fit.csv", "map.csv", "tets.csv", "map.vtu",
                                      "fit.dat", "fit.gp", "fit.png", "fit.db", NULL};
  static const char *const folders[] = {"runs", "scenes", NULL};
  flesh_inputs inputs = {0};
  flesh_inputs_add(&inputs, fit->path);
  for (int e = 0; e < fit->experiment_count; e++) {
    flesh_inputs_add(&inputs, fit->experiments[e].scene);
    for (int k = 0; k < fit->experiments[e].measured_count; k++) flesh_inputs_add(&inputs, fit->experiments[e].measured[k].path);
  }
  return flesh_inputs_spare_in(&inputs, fit->options.out, names, folders);
}

/* Searches, and writes what is found. */
static int find(flesh_fit *fit)
{
  flesh_fit_found found = {0};
  flesh_fit_statistics statistics = {0};
  int status = FLESH_OK;
  for (int e = 0; e < fit->experiment_count && !status; e++) status = flesh_fit_try(fit, &fit->experiments[e]);
  if (!status) status = flesh_fit_runs_open(fit);
  if (status) return status;
  gsl_set_error_handler_off();
  status = flesh_fit_search(fit, &found);
  if (status) flesh_fit_write_ended(fit, status);
  else status = flesh_fit_find_statistics(fit, &found, &statistics);
  if (!status) status = flesh_fit_write(fit, &found, &statistics);
  json_decref(statistics.sentences);
  if (!status && !found.converged)
    status = flesh_fail(FLESH_ERR_SOLVE, "%s; %s/result.json has it so far", found.words, fit->options.out);
  return status;
}

static int read_and_find(const char *path, flesh_fit *fit)
{
  flesh_folder_claim claim = {.descriptor = -1};
  flesh_interrupt_watch();
  int status = flesh_fit_read(path, fit);
  if (!status) status = flesh_confine(fit->options.out);
  if (!status) status = flesh_output_claim(fit->options.out, "fit", &claim);
  if (!status) status = spare_inputs(fit);
  if (!status) status = find(fit);
  const int code = status ? flesh_command_fail("fit", status) : 0;
  flesh_folder_claim_release(&claim);
  flesh_fit_close(fit);
  return code;
}

int flesh_command_fit(int argc, char **argv)
{
  flesh_fit fit = {.options = {.out = "out/fit"}, .store = {.lock = -1}};
  int count, code = flesh_ranks_refuse("fit");
  if (code) return code;
  const flesh_option rows[] = {
      {"out", "DIR", FLESH_OPTION_TEXT, &fit.options.out, "folder of the results (default out/fit)"},
      {"resume", NULL, FLESH_OPTION_SWITCH, &fit.options.resume, "go on with DIR/fit.db, or begin"},
      {"quiet", NULL, FLESH_OPTION_SWITCH, &fit.options.quiet, "print errors only"},
      {0}};
  char *text = flesh_settings_help(flesh_own_text("fit_help"), flesh_fit_keys, "");
  const flesh_usage usage = {"fit", "SPEC", "Fits parameters of scenes to measurements.", text, 1, 1, rows, NULL,
                             FLESH_EXITS_OF_SOLVES | FLESH_EXITS_OF_INTERRUPTS};
  code = flesh_study_open(&fit.options, &usage, argc, argv, &count);
  if (code == FLESH_OPTIONS_GO_ON) code = read_and_find(argv[1], &fit);
  flesh_study_close(&fit.options);
  free(text);
  return code;
}
