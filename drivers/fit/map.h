/* map.h: a constant of the material of each tet as what is fitted: thousands of parameters, held together by a penalty for
 * differences between tets that share a face. */
#ifndef FLESH_FIT_MAP_H
#define FLESH_FIT_MAP_H

#include "fit/fit.h"
#include "scene/fibres.h"

/* In the order of their names. */
enum { FLESH_FIT_QUADRATIC, FLESH_FIT_VARIATION };

/* The search goes on in z: q = log(value) or value / scale, where there are no bounds; else q between them, by the logistic
 * function of z. */
struct flesh_fit_map {
  char *key; /* a constant's name */
  double start, from, to; /* NaN: no bounds */
  int spacing;
  flesh_tet_selection tets_chosen;
  int penalty;
  double edge;   /* of q between neighbours, from which on variation counts differences by their size */
  double weight; /* of the penalty; NaN: such that the residuals are the deviations */
  const flesh_node *place;
  const char *unit;
  double scale;
  int count, *tets; /* [count] rising */
  int tet_count;    /* of the mesh */
  int face_count, *faces; /* [2 * face_count] neighbours, as indices into tets */
  double *face_weights;   /* [face_count] area over the distance of the centres, over the cube root of the volume */
};

/* Reads the chosen tets and their neighbours, and whether experiments can have a map. FLESH_ERR_ARGUMENT. */
int flesh_fit_map_prepare(flesh_fit *fit);
extern const flesh_key flesh_fit_map_table[];

/* q of a value, a value of z, and dq/dz. */
double flesh_fit_map_q(const flesh_fit_map *map, double p);
double flesh_fit_map_z(const flesh_fit_map *map, double p);
double flesh_fit_map_p(const flesh_fit_map *map, double z);
double flesh_fit_map_slope(const flesh_fit_map *map, double z);
/* dp/dq. */
double flesh_fit_map_size(const flesh_fit_map *map, double p);

/* Writes a scene's map of values p [count] to a path. */
int flesh_fit_map_write(const flesh_fit *fit, const char *path, const double *p);

/* The measured numbers, linearised at values p of the map: products of its derivatives by q. */
typedef struct flesh_fit_linear flesh_fit_linear;
/* Makes the runs at p again whose equilibria are not kept. Returns new. FLESH_ERR_SOLVE where a run fails; FLESH_ERR_MEMORY. */
int flesh_fit_linear_create(flesh_fit *fit, const double *p, flesh_fit_linear **linear);
void flesh_fit_linear_destroy(flesh_fit_linear **linear);
/* y [measured numbers] = J u, each over its deviation, u [count]. */
int flesh_fit_linear_times(flesh_fit_linear *linear, const double *u, double *y);
/* u [count] = J^T y. */
int flesh_fit_linear_times_transposed(flesh_fit_linear *linear, const double *y, double *u);

/* The residual of a face's penalty at a difference d of q, without its weight, and its derivative by d. */
double flesh_fit_map_bend(const flesh_fit_map *map, double d, double *slope);

/* A search with one weight. */
typedef struct flesh_fit_stage {
  double weight, squares, penalty; /* sum of squares of the measured numbers' residuals; of the penalty, with the weight */
  int iterations, converged;
} flesh_fit_stage;

enum { FLESH_FIT_STAGES = 40 };

typedef struct flesh_fit_map_found {
  double *p, *values; /* [count], [measured numbers] */
  int stage_count, chosen; /* chosen: the stage whose map it is */
  flesh_fit_stage stages[FLESH_FIT_STAGES];
  char words[FLESH_FIT_WORDS];
  /* Found by the regularised Gauss-Newton matrix; NULL: there are too many tets. */
  double *deviations;  /* [count] of q */
  double *resolutions; /* [count] the share of a tet's value that the measurements say, the rest being its neighbours' */
  double determined;   /* the sum of those: how many numbers the measurements determine */
} flesh_fit_map_found;

/* A stage of an earlier run of the fit, with its map p [count], and whether it is there. FLESH_ERR_FILE. */
int flesh_fit_stage_read(flesh_fit *fit, int number, flesh_fit_stage *stage, double *p, int *there);
/* Writes one that began at that wall time, s. */
int flesh_fit_stage_write(flesh_fit *fit, int number, double began, const flesh_fit_stage *stage, const double *p);

/* Searches the map. FLESH_ERR_SOLVE where the start cannot be run. */
int flesh_fit_map_search(flesh_fit *fit, flesh_fit_map_found *found);
/* Fills in deviations, resolutions and determined. */
int flesh_fit_map_judge(flesh_fit *fit, flesh_fit_map_found *found);
int flesh_fit_map_report(flesh_fit *fit, const flesh_fit_map_found *found);
void flesh_fit_map_found_close(flesh_fit_map_found *found);

#endif
