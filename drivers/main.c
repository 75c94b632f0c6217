/* main.c: the `flesh` program: finds the command and runs it. */
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

#include "commands.h"
#include "cli/help.h"
#include "cli/interrupt.h"
#include "cli/json_memory.h"
#include "cli/options.h"
#include "run/provenance.h"

#define COMMAND(name, summary) {#name, summary, flesh_command_##name},
static const flesh_subcommand commands[] = {FLESH_COMMAND_LIST(COMMAND){0}};

/* Kernels have frames of up to 350 kB. A low limit of the stack is raised as far as it may be. */
static int ensure_stack(void)
{
  enum { LEAST = 1 << 20, USUAL = 8 << 20 };
  struct rlimit limit;
  if (getrlimit(RLIMIT_STACK, &limit) || limit.rlim_cur >= LEAST) return 0;
  const rlim_t allowed = limit.rlim_max;
  limit.rlim_cur = allowed < USUAL ? allowed : USUAL;
  if (limit.rlim_cur >= LEAST && !setrlimit(RLIMIT_STACK, &limit)) return 0;
  fprintf(stderr, "flesh: the stack is limited to %llu kB (ulimit -s); it must be at least %d kB\n",
          (unsigned long long)(allowed >> 10), LEAST >> 10);
  return 1;
}

/* A stream that is closed stays so: else the next file would take its number, and get what is printed. What is opened
 * here cannot be written, so that printing fails as before. */
static void reserve_streams(void)
{
  int opened;
  while ((opened = open("/dev/null", O_RDONLY | O_CLOEXEC)) >= 0 && opened <= STDERR_FILENO) continue;
  close(opened);
}

int main(int argc, char **argv)
{
  /* Writing to a closed pipe or beyond a file's allowed size then fails like any other write. */
  signal(SIGPIPE, SIG_IGN);
  signal(SIGXFSZ, SIG_IGN);
  reserve_streams();
  flesh_interrupt_tidy();
  flesh_json_watch();
  flesh_help_commands = commands;
  char help[] = "--help", *of_help[] = {argv[0], argc > 2 ? argv[2] : help, help, NULL};
  if (argc > 1 && !strcmp(argv[1], "help")) argv = of_help;
  int code = 0;
  if (argc > 1 && !strcmp(argv[1], "--version")) flesh_provenance_print_version();
  else if (ensure_stack()) return 1;
  else
    code = flesh_subcommand_run("", "Dynamics of soft, nearly incompressible bodies.\n",
                                "`flesh --version` prints the version.", commands, argv == of_help ? 3 : argc, argv);
  if ((fflush(stdout) || ferror(stdout)) && !code) {
    if (errno != EPIPE) fprintf(stderr, "flesh: standard output could not be written completely\n");
    code = 3;
  }
  return code;
}
