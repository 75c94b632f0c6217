/* output.h: a file that appears whole or not at all. */
#ifndef FLESH_MESH_OUTPUT_H
#define FLESH_MESH_OUTPUT_H

#include <stdio.h>

/* Written under a temporary name beside `path`, renamed at the end. */
typedef struct flesh_output {
  FILE *file;
  const char *path; /* borrowed */
  char *temporary;
} flesh_output;

/* FLESH_ERR_FILE when the file cannot be made, or `path` is there and is no regular file. */
int flesh_output_open(const char *path, flesh_output *output);
/* Closes; FLESH_ERR_FILE when anything written got lost. */
int flesh_output_close(flesh_output *output);
/* Gives the closed file its name. */
int flesh_output_commit(flesh_output *output);
/* Removes what has not been committed; safe after any of the above, also when they failed. */
void flesh_output_discard(flesh_output *output);

#endif
