/* runs.h: what is told of a run, alone or within a comparison. */
#ifndef FLESH_REPORT_RUNS_H
#define FLESH_REPORT_RUNS_H

#include <jansson.h>

/* How the run ended, in words; `result`: of result.json, NULL without. */
void flesh_report_judge_run(json_t *part, const char *name, const json_t *result);

/* The letter of its first material's energy; "" without. */
const char *flesh_report_energy(const json_t *result);

/* folder/file as a folded table and a series of the plot; a note where it cannot be read. */
int flesh_report_add_history(json_t *part, json_t *plot, const char *folder, const char *file,
                             const char *name, const char *colour);

#endif
