/* embedded.h: files that are embedded in the program (embed.py). */
#ifndef FLESH_STUDY_EMBEDDED_H
#define FLESH_STUDY_EMBEDDED_H

#include <string.h>

/* An embedded file; a NULL name ends a table of them. */
typedef struct flesh_embedded {
  const char *name, *text; /* `name`: without folder and suffix, as "battery" */
} flesh_embedded;

extern const flesh_embedded flesh_own_files[];   /* of data/hardcases and data/studies; what a run writes; help of commands */
extern const flesh_embedded flesh_completions[]; /* completion scripts of shells, with lines that stand for what they complete */

/* Returns the text of that name, which must exist. */
static inline const char *flesh_embedded_text(const flesh_embedded *files, const char *name)
{
  while (strcmp(files->name, name)) files++;
  return files->text;
}
static inline const char *flesh_own_text(const char *name) { return flesh_embedded_text(flesh_own_files, name); }

#endif
