/* vtu.h: VTK files of tet meshes (.vtu, appended raw binary) and collections of them over time
 * (.pvd). */
#ifndef FLESH_IO_VTU_H
#define FLESH_IO_VTU_H

/* Values per point or per cell: `doubles` or `integers` [count * components], the other NULL. */
typedef struct flesh_vtu_array {
  const char *name;
  int components;
  const double *doubles;
  const int *integers;
} flesh_vtu_array;

/* What a .vtu holds; everything borrowed. */
typedef struct flesh_vtu {
  int points, tets;
  const double *positions; /* [3*points], m */
  const int *tet_nodes;    /* [4*tets] */
  int point_array_count, cell_array_count;
  const flesh_vtu_array *point_arrays, *cell_arrays;
} flesh_vtu;

/* Whole or not at all; FLESH_ERR_FILE with path and reason. */
int flesh_vtu_write(const char *path, const flesh_vtu *content);

/* A .pvd that lists `files` [count] (relative to the .pvd) at `times` [count], s. Whole or not at
 * all. */
int flesh_pvd_write(const char *path, int count, const double *times, const char *const *files);

#endif
