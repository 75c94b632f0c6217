/* program.h: runs other programs that draw, and checks that the pictures they write are complete. */
#ifndef FLESH_PICTURE_PROGRAM_H
#define FLESH_PICTURE_PROGRAM_H

/* Exit code if a program is not installed; a shell returns the same. */
enum { FLESH_PROGRAM_MISSING = 127 };

/* Runs words[0] with the other words (NULL ends them) in the folder; its stderr goes into the file `log`. Returns its
 * exit code, or -1 if it could not be started or a signal ended it. */
int flesh_program_run(const char *folder, const char *log, const char *const *words);

/* Returns whether a picture named .svg, .pdf or .png begins and ends as such a file must. */
int flesh_picture_is_whole(const char *path);

#endif
