// TEST quick needs=drivers
/* test_interrupt.c: signals are remembered, and nothing else in the program changes. */
#include "cli/interrupt.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include "test.h"

/* Standard error is a file: asking whether it is a terminal sets errno. */
static void signals_leave_errno_alone(void)
{
  const int file = open("/dev/null", O_WRONLY), before = dup(STDERR_FILENO);
  CHECK(file >= 0 && before >= 0 && dup2(file, STDERR_FILENO) >= 0);
  flesh_interrupt_watch();
  CHECK(flesh_interrupt_signal() == 0);
  errno = ENOSPC;
  raise(SIGTERM);
  CHECK(errno == ENOSPC);
  CHECK(flesh_interrupt_signal() == SIGTERM && flesh_interrupt_exit_code() == 128 + SIGTERM);
  dup2(before, STDERR_FILENO);
  close(before);
  close(file);
}

int main(int argc, char **argv) { return RUN_TESTS(argc, argv, TEST(signals_leave_errno_alone)); }
