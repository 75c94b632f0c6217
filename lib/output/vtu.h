/* vtu.h: VTK files of tet meshes and of polygons (.vtu, appended raw binary), and collections of
 * them over time (.pvd). */
#ifndef FLESH_OUTPUT_VTU_H
#define FLESH_OUTPUT_VTU_H

#include <stddef.h>

/* Values per point or per cell: `doubles` or `integers` [count * components], the other NULL. */
typedef struct flesh_vtu_array {
  const char *name;
  int components;
  const double *doubles;
  const int *integers;
  const char *unit; /* NULL: none; VTK's key UNITS_LABEL */
  /* Names of components / groups components, which come again in every group, with the group's number behind them:
   * XX_1, XX_2 ...; NULL: the number alone, or nothing for a single group. */
  const char *const *component_names;
  int groups; /* 0: 1 */
} flesh_vtu_array;

/* The contents of a .vtu; everything borrowed. */
typedef struct flesh_vtu {
  int points, tets;
  const double *positions; /* [3*points], m */
  const int *tet_nodes;    /* [4*tets] */
  const int *edge_nodes;   /* [6*tets] of quadratic tets, -1 of others, or NULL */
  /* Polygons instead of tets (tet_nodes NULL): polygon c has the points corners[starts[c]] up to
   * corners[starts[c+1]-1]. */
  int polygons;
  const int *starts, *corners;
  int point_array_count, cell_array_count;
  const flesh_vtu_array *point_arrays, *cell_arrays;
} flesh_vtu;

/* Bytes of the length that stands before every array: 4, or 8 where an array takes 4 GiB. */
size_t flesh_vtu_length_size(const flesh_vtu *content);

/* Whole or not at all; FLESH_ERR_FILE with path and reason. */
int flesh_vtu_write(const char *path, const flesh_vtu *content);

/* A .pvtu of the files <stem>_00000.vtu to that of parts - 1, beside it, which all have the arrays of `content`; nothing
 * else of that is looked at. As above. */
int flesh_pvtu_write(const char *path, const flesh_vtu *content, const char *stem, int parts);

/* The frames of a .pvd so far: zero-initialise, name the next one, and add it when it is written. */
enum { FLESH_PVD_NAME_SIZE = 32 };
typedef struct flesh_pvd {
  int count, capacity;
  double *times; /* [capacity] */
  char (*names)[FLESH_PVD_NAME_SIZE];
  const char **files; /* [capacity] pointers to the names */
} flesh_pvd;

/* Makes room for a frame and returns in *name where its name goes, FLESH_PVD_NAME_SIZE long.
 * FLESH_ERR_MEMORY. */
int flesh_pvd_next(flesh_pvd *pvd, char **name);
/* Counts the frame of that name, at `time` s, and writes the .pvd anew. */
int flesh_pvd_add(flesh_pvd *pvd, const char *path, double time);
void flesh_pvd_clear(flesh_pvd *pvd);

/* A .pvd that lists `files` [count] (relative to the .pvd) at `times` [count], s. Whole or not at
 * all. */
int flesh_pvd_write(const char *path, int count, const double *times, const char *const *files);

#endif
