/* results.h: the documentation of the files that a run writes. */
#ifndef FLESH_SCHEMA_RESULTS_H
#define FLESH_SCHEMA_RESULTS_H

/* Prints "result.json", "history.csv", "probes.csv" or "frames" as a table in Markdown, or all of them for "results".
 * Returns 0, having printed nothing, for any other name. */
int flesh_results_print(const char *section);

#endif
