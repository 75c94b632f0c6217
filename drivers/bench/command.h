/* command.h: `flesh bench`. */
#ifndef FLESH_BENCH_COMMAND_H
#define FLESH_BENCH_COMMAND_H

int flesh_command_bench(int argc, char **argv);

#endif
