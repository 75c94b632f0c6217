/* vtu.h: VTK files of tet meshes and of polygons (.vtu, appended raw binary), and collections of them over time
 * (.pvd). */
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
  /* Names of the components / groups components of a group; each group has them followed by its number: XX_1, XX_2 ...
   * NULL: only the number, or no names for a single group. */
  const char *const *component_names;
  int groups; /* 0 means 1 */
} flesh_vtu_array;

/* Content of a .vtu; everything is borrowed. */
typedef struct flesh_vtu {
  int points, tets;
  const double *positions; /* [3*points], m */
  const int *tet_nodes;    /* [4*tets] */
  const int *edge_nodes;   /* [6*tets], -1 for tets of four nodes; NULL: none has ten */
  /* Polygons instead of tets (tet_nodes NULL): the points of polygon c are corners[k] for starts[c] <= k <
   * starts[c+1]. */
  int polygons;
  const int *starts, *corners;
  int point_array_count, cell_array_count;
  const flesh_vtu_array *point_arrays, *cell_arrays;
} flesh_vtu;

/* Returns the bytes of the length before every array: 4, or 8 if an array takes 4 GiB. */
size_t flesh_vtu_length_size(const flesh_vtu *content);

/* Writes a .vtu, whole or not at all. FLESH_ERR_FILE with path and reason. */
int flesh_vtu_write(const char *path, const flesh_vtu *content);

/* Writes a .pvtu of the files <stem>_00000.vtu to <stem>_<parts - 1>.vtu beside it, which all have the arrays of
 * `content`; its other members are not used. Fails as flesh_vtu_write. */
int flesh_pvtu_write(const char *path, const flesh_vtu *content, const char *stem, int parts);

/* The frames of a .pvd so far: zero-initialise it, name the next frame by flesh_pvd_next, and add it when it is
 * written. */
enum { FLESH_PVD_NAME_SIZE = 32 };
typedef struct flesh_pvd {
  int count, capacity;
  double *times; /* [capacity] */
  char (*names)[FLESH_PVD_NAME_SIZE];
  const char **files; /* [capacity] pointers to the names */
} flesh_pvd;

/* Makes room for a frame; the caller writes its name at *name, at most FLESH_PVD_NAME_SIZE bytes. FLESH_ERR_MEMORY. */
int flesh_pvd_next(flesh_pvd *pvd, char **name);
/* Adds the named frame, at `time` s, and writes the .pvd again. FLESH_ERR_FILE. */
int flesh_pvd_add(flesh_pvd *pvd, const char *path, double time);
void flesh_pvd_clear(flesh_pvd *pvd);

/* Writes a .pvd that lists `files` [count] (relative to the .pvd) at `times` [count], s, whole or not at all.
 * FLESH_ERR_FILE. */
int flesh_pvd_write(const char *path, int count, const double *times, const char *const *files);

#endif
