/* usage.c: the exit codes in words. */
#include "cli/usage.h"

#include <stddef.h>

const flesh_exit_row flesh_exit_rows[] = {
    {"0", "fine", 0},
    {"1", "out of memory or an internal failure", 0},
    {"2", "bad usage or scene", 0},
    {"3", "bad or unwritable file, or bad mesh", 0},
    {"4", "a solve failed", FLESH_EXITS_OF_SOLVES},
    {"5", "the time integrator failed", FLESH_EXITS_OF_SOLVES},
    {"6", "the budget (--max-seconds) is spent", FLESH_EXITS_OF_BUDGETS},
    {"7", "a number became non-finite", FLESH_EXITS_OF_SOLVES},
    {"8", "the energy grew although nothing put it in (time.max_energy_gain)", FLESH_EXITS_OF_SOLVES},
    {"130/143", "interrupted by SIGINT/SIGTERM (129: SIGHUP); what was done is kept and valid", FLESH_EXITS_OF_INTERRUPTS},
    {NULL, NULL, 0}};
