/* usage.c: the exit codes in words. */
#include "shared/usage.h"

const char flesh_exit_codes_text[] =
    "Exit codes:\n"
    "  0        fine\n"
    "  1        out of memory or an internal failure\n"
    "  2        bad usage or scene\n"
    "  3        bad or unwritable file, or bad mesh\n"
    "  4        a solve failed\n"
    "  5        the time integrator failed\n"
    "  6        the budget (--max-seconds) is spent\n"
    "  7        a number became non-finite\n"
    "  8        the energy grew although nothing put it in (time.max_energy_gain)\n"
    "  130/143  interrupted by SIGINT/SIGTERM (129: SIGHUP); what was done is kept and valid\n";
