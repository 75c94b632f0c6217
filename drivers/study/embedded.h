/* embedded.h: files that the program has itself (embed.py). */
#ifndef FLESH_STUDY_EMBEDDED_H
#define FLESH_STUDY_EMBEDDED_H

#include <string.h>

/* A NULL name ends a table of them. */
typedef struct flesh_embedded {
  const char *name, *text; /* the former without folder and suffix: "battery" */
} flesh_embedded;

extern const flesh_embedded flesh_own_files[];   /* of data/hardcases and data/studies; what a run writes; help of commands */
extern const flesh_embedded flesh_completions[]; /* scripts of shells, with lines for what they complete */

/* The text of that name, which must be there. */
static inline const char *flesh_embedded_text(const flesh_embedded *files, const char *name)
{
  while (strcmp(files->name, name)) files++;
  return files->text;
}
static inline const char *flesh_own_text(const char *name) { return flesh_embedded_text(flesh_own_files, name); }

#endif
