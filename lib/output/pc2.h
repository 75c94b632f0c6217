/* pc2.h: point caches (PC2, as Blender and 3ds Max read them): the positions of fixed points in evenly spaced samples.
 * A header of 32 bytes, all little endian: "POINTCACHE2\0", int32 version 1, int32 points, float32 start frame, float32
 * frames per sample, int32 samples; then for each sample float32 x y z of every point. */
#ifndef FLESH_OUTPUT_PC2_H
#define FLESH_OUTPUT_PC2_H

#include "base/file.h"

typedef struct flesh_pc2 {
  flesh_file file;
  int points, samples;
} flesh_pc2;

int flesh_pc2_open(const char *path, int points, flesh_pc2 *cache);
/* Adds a sample, positions [3*points]. FLESH_ERR_FILE, also when the header cannot count another sample. */
int flesh_pc2_add(flesh_pc2 *cache, const double *positions);
/* Completes the header; only then does the file appear under its name. */
int flesh_pc2_commit(flesh_pc2 *cache);
void flesh_pc2_abandon(flesh_pc2 *cache); /* harmless after commit or a failed open */

#endif
