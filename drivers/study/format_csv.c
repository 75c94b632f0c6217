/* format_csv.c: writes tables as CSV. */
#include "study/csv.h"
#include "study/formats.h"

const flesh_format flesh_format_csv = {.begin = "", .between = ",", .end = "\n", .text = flesh_csv_print, .missing = ""};
