/* sentence.h: what came of a comparison, in a sentence from its table, and what its rows are called. */
#ifndef FLESH_REPORT_SENTENCE_H
#define FLESH_REPORT_SENTENCE_H

#include "report/part.h"

/* An energy with its constants, as in "D with raw constants". */
void flesh_report_name_energy(const json_t *rows, size_t k, char name[64]);
/* A case of hardcases.csv with what is not by default. */
void flesh_report_name_case(const json_t *rows, size_t k, char name[300]);

/* Which energy keeps the volume best and worst, in the rows of this Poisson's ratio for which `is_of` holds. */
void flesh_report_say_drift(json_t *part, const json_t *rows, double poisson,
                            int (*is_of)(const json_t *, size_t, double));
void flesh_report_say_accuracy(json_t *part, const json_t *rows);
void flesh_report_say_hardcases(json_t *part, const json_t *rows);

#endif
