/* command_bench.h: `flesh bench`. */
#ifndef FLESH_DRIVERS_COMMAND_BENCH_H
#define FLESH_DRIVERS_COMMAND_BENCH_H

int flesh_command_bench(int argc, char **argv);

#endif
