/* interrupt.c: remembers the first signal. */
#include "cli/interrupt.h"

#include <errno.h>
#include <signal.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/error.h"
#include "base/file.h"
#include "flesh/scene.h"

static volatile sig_atomic_t remembered;

/* The action of SIGHUP when the program was started. Libraries may change it before main begins: Debian's SUNDIALS 7
 * loads MPI and with it UCX, which prints a trace on SIGHUP. Functions in .preinit_array are called before those of any
 * library. */
static struct sigaction hangup;
static void note_hangup(void) { sigaction(SIGHUP, NULL, &hangup); }
__attribute__((section(".preinit_array"), used)) static void (*note_hangup_first)(void) = note_hangup;
__attribute__((constructor)) static void restore_hangup(void) { sigaction(SIGHUP, &hangup, NULL); }

static void remember(int signal_number)
{
  static const char text[] = "\nflesh: stopping in order; once more to stop at once\n";
  const int interrupted = errno; /* the interrupted code may be about to read it */
  remembered = signal_number;
  const ssize_t written = isatty(STDERR_FILENO) ? write(STDERR_FILENO, text, sizeof text - 1) : 0;
  (void)written; /* an error here cannot be reported */
  errno = interrupted;
}

void flesh_interrupt_watch(void)
{
  struct sigaction action = {.sa_handler = remember, .sa_flags = (int)SA_RESETHAND | SA_RESTART};
  sigaction(SIGINT, &action, NULL);
  sigaction(SIGTERM, &action, NULL);
  if (hangup.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, NULL); /* not under nohup */
  flesh_scene_set_stop(flesh_interrupt_asked, NULL);
}

static void tidy(int signal_number)
{
  flesh_file_drop_all();
  raise(signal_number); /* now with the system's default action */
}

void flesh_interrupt_tidy(void)
{
  const struct sigaction action = {.sa_handler = tidy, .sa_flags = (int)SA_RESETHAND};
  static const int signals[] = {SIGINT, SIGTERM, SIGHUP};
  for (int k = 0; k < 3; k++) {
    struct sigaction now;
    if (!sigaction(signals[k], NULL, &now) && now.sa_handler == SIG_DFL) sigaction(signals[k], &action, NULL);
  }
}

int flesh_interrupt_asked(void *deadline)
{
  if (remembered) return FLESH_ERR_INTERRUPTED;
  return deadline && flesh_wall_seconds() > *(double *)deadline ? FLESH_ERR_BUDGET : FLESH_OK;
}

void flesh_interrupt_adopt(int signal_number)
{
  if (!remembered) remembered = signal_number;
}

int flesh_interrupt_signal(void) { return remembered; }

int flesh_interrupt_check(void)
{
  return remembered ? flesh_fail(FLESH_ERR_INTERRUPTED, "interrupted by %s", flesh_interrupt_name()) : FLESH_OK;
}

const char *flesh_interrupt_name(void)
{
  return remembered == SIGTERM ? "SIGTERM" : remembered == SIGHUP ? "SIGHUP" : "SIGINT";
}

int flesh_interrupt_exit_code(void) { return 128 + (remembered ? remembered : SIGINT); }
