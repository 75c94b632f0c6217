/* interrupt.c: remembers the first signal. */
#include "interrupt.h"

#include <signal.h>
#include <unistd.h>

static volatile sig_atomic_t remembered;

static void remember(int signal_number)
{
  static const char text[] = "\nflesh: stopping in order; once more to stop at once\n";
  remembered = signal_number;
  if (isatty(STDERR_FILENO) && write(STDERR_FILENO, text, sizeof text - 1) < 0) return;
}

void flesh_interrupt_watch(void)
{
  struct sigaction action = {.sa_handler = remember, .sa_flags = (int)SA_RESETHAND | SA_RESTART};
  sigaction(SIGINT, &action, NULL);
  sigaction(SIGTERM, &action, NULL);
  struct sigaction hangup;
  if (!sigaction(SIGHUP, NULL, &hangup) && hangup.sa_handler != SIG_IGN) /* not under nohup */
    sigaction(SIGHUP, &action, NULL);
}

int flesh_interrupt_signal(void) { return remembered; }

const char *flesh_interrupt_name(void)
{
  return remembered == SIGTERM ? "SIGTERM" : remembered == SIGHUP ? "SIGHUP" : "SIGINT";
}

int flesh_interrupt_exit_code(void) { return 128 + (remembered ? remembered : SIGINT); }
