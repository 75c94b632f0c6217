/* fail_allocation.c: when preloaded into a program, lets the FLESH_FAIL_AT-th allocation fail, counted from 1, and with
 * FLESH_FAIL_ON=1 all later ones. FLESH_FAIL_SIZE: lets all allocations of this many bytes fail. FLESH_FAIL_OWN=1: only
 * allocations by the program itself count and fail, none by shared libraries. FLESH_FAIL_COUNT names a file that gets
 * the number of allocations of the process at its end. A crash prints the frames that led to it as `frame:
 * LIBRARY(SYMBOL+OFFSET)`, the innermost first, and ends the process by its signal. FLESH_FAIL_EACH=1: for each line
 * "AT ON" from descriptor 3 a separate process runs the program, with stdout.txt and stderr.txt; its exit code, or 128
 * plus its signal, is written to descriptor 4. The libraries are loaded only once. */
#define _GNU_SOURCE
#include <errno.h>
#include <execinfo.h>
#include <link.h>
#include <signal.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

/* glibc's own functions, under their exported names. */
extern void *__libc_malloc(size_t size);
extern void *__libc_calloc(size_t count, size_t size);
extern void *__libc_realloc(void *old, size_t size);
extern void *__libc_memalign(size_t alignment, size_t size);

static long count, at;
static int on, counting, own;
static size_t of_size;
static uintptr_t program, program_end; /* its instructions */

/* The first object is the program. */
static int find_program(struct dl_phdr_info *object, size_t size, void *data)
{
  (void)size, (void)data;
  for (int k = 0; k < object->dlpi_phnum; k++) {
    if (object->dlpi_phdr[k].p_type != PT_LOAD || !(object->dlpi_phdr[k].p_flags & PF_X)) continue;
    program = object->dlpi_addr + object->dlpi_phdr[k].p_vaddr;
    program_end = program + object->dlpi_phdr[k].p_memsz;
  }
  return 1;
}

static int fails(size_t size, void *caller)
{
  if (!counting || (own && ((uintptr_t)caller < program || (uintptr_t)caller >= program_end))) return 0;
  long number = __atomic_add_fetch(&count, 1, __ATOMIC_RELAXED);
  if ((!at || (on ? number < at : number != at)) && (!of_size || size != of_size)) return 0;
  errno = ENOMEM;
  return 1;
}

#define CALLER __builtin_return_address(0)

void *malloc(size_t size) { return fails(size, CALLER) ? NULL : __libc_malloc(size); }
void *calloc(size_t n, size_t size) { return fails(n * size, CALLER) ? NULL : __libc_calloc(n, size); }
void *realloc(void *old, size_t size) { return fails(size, CALLER) ? NULL : __libc_realloc(old, size); }
void *aligned_alloc(size_t alignment, size_t size) { return fails(size, CALLER) ? NULL : __libc_memalign(alignment, size); }
void *memalign(size_t alignment, size_t size) { return fails(size, CALLER) ? NULL : __libc_memalign(alignment, size); }
int posix_memalign(void **memory, size_t alignment, size_t size)
{
  if (fails(size, CALLER)) return ENOMEM;
  *memory = __libc_memalign(alignment, size);
  return *memory ? 0 : ENOMEM;
}

static void crashed(int signal_number)
{
  void *frames[40];
  counting = 0;
  int depth = backtrace(frames, 40);
  char **names = backtrace_symbols(frames, depth);
  for (int k = 2; names && k < depth; k++) dprintf(STDERR_FILENO, "frame: %s\n", names[k]); /* 0, 1: this handler */
  signal(signal_number, SIG_DFL);
  raise(signal_number);
}

static void write_to(const char *path, int descriptor)
{
  const int file = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0666);
  if (file < 0 || dup2(file, descriptor) < 0) _exit(127);
  close(file);
}

/* Returns in each process that runs the program. */
static void run_each(void)
{
  enum { ASKED = 3, ANSWER = 4, SECONDS = 1800 };
  FILE *asked = fdopen(ASKED, "r");
  int ended = 0;
  while (asked && fscanf(asked, "%ld %d", &at, &on) == 2) {
    const pid_t process = fork();
    if (!process) {
      close(ASKED), close(ANSWER);
      write_to("stdout.txt", STDOUT_FILENO), write_to("stderr.txt", STDERR_FILENO);
      alarm(SECONDS);
      return;
    }
    if (process < 0 || waitpid(process, &ended, 0) != process) break;
    dprintf(ANSWER, "%d\n", WIFEXITED(ended) ? WEXITSTATUS(ended) : 128 + WTERMSIG(ended));
  }
  _exit(0);
}

/* Runs after the other libraries' initialisers, which do not belong to the program. */
__attribute__((constructor)) static void begin(void)
{
  static char stack[1 << 16];
  const int deadly[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};
  const char *number = getenv("FLESH_FAIL_AT"), *further = getenv("FLESH_FAIL_ON"),
             *size = getenv("FLESH_FAIL_SIZE"), *ours = getenv("FLESH_FAIL_OWN");
  void *warm[2];
  backtrace(warm, 2); /* loads what it needs while memory is available */
  sigaltstack(&(stack_t){.ss_sp = stack, .ss_size = sizeof stack}, NULL);
  for (size_t k = 0; k < sizeof deadly / sizeof *deadly; k++)
    sigaction(deadly[k], &(struct sigaction){.sa_handler = crashed, .sa_flags = (int)(SA_ONSTACK | SA_RESETHAND)},
              NULL);
  at = number ? atol(number) : 0;
  on = further && *further == '1';
  of_size = size ? strtoul(size, NULL, 10) : 0;
  own = ours && *ours == '1';
  dl_iterate_phdr(find_program, NULL);
  if (getenv("FLESH_FAIL_EACH")) run_each();
  counting = 1;
}

__attribute__((destructor)) static void end(void)
{
  const char *path = getenv("FLESH_FAIL_COUNT");
  counting = 0;
  FILE *stream = path ? fopen(path, "w") : NULL;
  if (stream) fprintf(stream, "%ld\n", count), fclose(stream);
}
