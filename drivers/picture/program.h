/* program.h: other programs that draw: how they run, and whether what they leave is whole. */
#ifndef FLESH_PICTURE_PROGRAM_H
#define FLESH_PICTURE_PROGRAM_H

/* A shell returns this, too, where a program is not installed. */
enum { FLESH_PROGRAM_MISSING = 127 };

/* Runs words[0] with the other words, NULL-ended, in the folder; what it writes to stderr goes into the file `log`.
 * Returns its exit code; -1: it could not be started, or a signal ended it. */
int flesh_program_run(const char *folder, const char *log, const char *const *words);

/* Whether a picture that is named .svg, .pdf or .png begins as such a file does and has its end. */
int flesh_picture_is_whole(const char *path);

#endif
