/* sweep.h: scripted sweeps: the content of a spec, the cases that follow from it, and the database of their results. */
#ifndef FLESH_SWEEP_SWEEP_H
#define FLESH_SWEEP_SWEEP_H

#include "scene/node.h"
#include "study/settings.h"
#include "study/study.h"

/* Columns that advance together. The groups are crossed; the last one changes fastest. */
typedef struct flesh_sweep_group {
  int count, first, columns;
} flesh_sweep_group;

typedef struct flesh_sweep {
  flesh_arena arena;
  const char *path;         /* of the spec */
  const char *out;          /* folder of the results */
  int is_dry;               /* only the plan is printed */
  char *text;               /* text of the spec; freed by flesh_sweep_close */
  const char *title, *scene; /* scene: path of the file */
  const flesh_node *scene_node, *given; /* given: the mapping `set` */
  flesh_objects axes, derived; /* of flesh_sweep_axis; of flesh_study_derived, columns of the view `results` */
  flesh_settings set;       /* constants of all cases */
  int column_count, group_count;
  flesh_study_column columns[FLESH_STUDY_COLUMNS + 1]; /* what varies, each with the values [count] of its group; the key
                                                        * "scene" chooses the scene itself */
  flesh_sweep_group groups[FLESH_STUDY_COLUMNS + 1];
  int repeats;        /* >= 1; if above 1 there is a column `repeat` */
  int seed;           /* -1: that of the scene */
  int keep;           /* whether each case keeps a folder of results */
  double max_seconds; /* of each case; 0: no limit */
  int case_count;
  char fingerprint[65]; /* of the scene and the spec, without derived columns and, if no folders are kept, without axes' values */
} flesh_sweep;

/* Reads and checks a spec: every value of every axis is tried on the scene's keys. FLESH_ERR_ARGUMENT with
 * "file:line:column: ...", or FLESH_ERR_FILE. Zero-initialise the struct before; close it in any case. */
int flesh_sweep_read(const char *path, flesh_sweep *sweep);
void flesh_sweep_close(flesh_sweep *sweep);
extern const flesh_settings_part flesh_sweep_keys[]; /* for the help */

/* Expands samples: `count` points of `dimensions` numbers in (0, 1) by `sequence`, an index into flesh_sweep_sequences;
 * points [count * dimensions]. Seed 0 gives the sequence as it is; other seeds shift it as a whole, modulo 1, by random
 * numbers (Cranley & Patterson 1976). "random" gives plain random numbers of the seed. */
extern const char *const flesh_sweep_sequences[];
int flesh_sweep_sample(int sequence, int dimensions, int count, int skip, int seed, double *points);

/* Returns the sweep as a study, which borrows it. */
flesh_study flesh_sweep_study(flesh_sweep *sweep);

int flesh_sweep_export(int argc, char **argv);
int flesh_sweep_plot(int argc, char **argv);
int flesh_sweep_merge(int argc, char **argv);

/* An axis as in the spec, for the modules that read specs. */
typedef struct flesh_sweep_axis {
  char *key, *name;
  const flesh_node *values;
  double from, to;
  int count, spacing;
  flesh_objects zip;
  struct flesh_sweep_axis_sample {
    int sequence, count, seed, skip;
    flesh_objects axes;
  } sample;
} flesh_sweep_axis;

extern const flesh_key flesh_sweep_table[]; /* into flesh_sweep */

#endif
