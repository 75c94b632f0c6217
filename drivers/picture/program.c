/* program.c: runs other programs, and checks the two ends of a picture: a PNG (ISO/IEC 15948) has a signature first and
 * the chunk IEND last, an SVG the end tag of its root element last, a PDF (ISO 32000) %PDF- and %%EOF. */
#include "picture/program.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/confine.h"

int flesh_program_run(const char *folder, const char *log, const char *const *words)
{
  fflush(NULL);
  const pid_t child = fork();
  if (child < 0) return -1;
  if (!child) {
    prctl(PR_SET_PDEATHSIG, SIGKILL); /* ends with the parent, as nobody would use what it draws */
    const int nowhere = open("/dev/null", O_RDWR);
    const int said = flesh_path_open(log, O_WRONLY | O_CREAT | O_TRUNC | O_NONBLOCK, 0666);
    if (nowhere >= 0) dup2(nowhere, STDIN_FILENO), dup2(nowhere, STDOUT_FILENO);
    dup2(said >= 0 ? said : nowhere, STDERR_FILENO);
    if (chdir(folder)) _exit(1);
    execvp(words[0], (char *const *)words);
    _exit(FLESH_PROGRAM_MISSING);
  }
  int ended;
  while (waitpid(child, &ended, 0) < 0 && errno == EINTR) continue;
  return WIFEXITED(ended) ? WEXITSTATUS(ended) : -1;
}

/* Returns whether the file has this beginning and this end; line breaks may follow `end`. */
static int is_between(const char *path, const void *begin, size_t begin_size, const void *end, size_t end_size)
{
  char first[16], last[24];
  struct stat info;
  int file = flesh_path_open(path, O_RDONLY | O_NONBLOCK, 0);
  if (file < 0) return 0;
  int whole = !fstat(file, &info) && S_ISREG(info.st_mode) && info.st_size >= (off_t)(begin_size + end_size) &&
              pread(file, first, begin_size, 0) == (ssize_t)begin_size && !memcmp(first, begin, begin_size);
  for (int breaks = 0, found = 0; whole && !found; breaks++) {
    const off_t at = info.st_size - (off_t)end_size - breaks;
    found = at >= 0 && pread(file, last, end_size, at) == (ssize_t)end_size && !memcmp(last, end, end_size);
    whole = found || breaks < 3;
  }
  close(file);
  return whole;
}

int flesh_picture_is_whole(const char *path)
{
  static const unsigned char first[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  static const unsigned char last[12] = {0, 0, 0, 0, 'I', 'E', 'N', 'D', 0xae, 0x42, 0x60, 0x82};
  const char *suffix = strrchr(path, '.');
  if (suffix && !strcmp(suffix, ".svg")) return is_between(path, "<?xml", 5, "</svg>", 6);
  if (suffix && !strcmp(suffix, ".pdf")) return is_between(path, "%PDF-", 5, "%%EOF", 5);
  return is_between(path, first, sizeof first, last, sizeof last);
}
