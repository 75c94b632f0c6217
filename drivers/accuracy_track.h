/* accuracy_track.h: a run as it was at given times, and how far two of them differ. */
#ifndef FLESH_DRIVERS_ACCURACY_TRACK_H
#define FLESH_DRIVERS_ACCURACY_TRACK_H

#include "flesh/observer.h"
#include "flesh/scene.h"

/* The times of comparison: start + k every interval for k = 1, 2, ..., and the end. Every run steps
 * onto them: steps divide the interval. */
typedef struct flesh_accuracy_grid {
  double start, end, interval;
  int every, count;
} flesh_accuracy_grid;

enum { FLESH_ACCURACY_TIMES = 100 }; /* at most */
void flesh_accuracy_grid_make(double start, double end, double interval, flesh_accuracy_grid *grid);

/* States at the times; all arrays belong to it. */
typedef struct flesh_accuracy_track {
  int times, unknowns;
  double *t;               /* [times] */
  double *x, *v;           /* [times][unknowns] */
  double *energy, *volume; /* [times] J, m^3 */
} flesh_accuracy_track;

int flesh_accuracy_track_open(int times, int unknowns, flesh_accuracy_track *track);
void flesh_accuracy_track_close(flesh_accuracy_track *track);
void flesh_accuracy_track_copy(const flesh_accuracy_track *from, flesh_accuracy_track *to);
/* Whole or not at all; reading opens it. FLESH_ERR_FILE. */
int flesh_accuracy_track_write(const char *path, const flesh_accuracy_track *track);
int flesh_accuracy_track_read(const char *path, flesh_accuracy_track *track);
/* Energies and volumes of its states. */
int flesh_accuracy_track_evaluate(const flesh_system *system, flesh_accuracy_track *track);

/* The size of the motion, from the reference. */
typedef struct flesh_accuracy_scale {
  double length;     /* longest side of the body at rest [m] */
  double motion;     /* largest mass-weighted RMS distance from the start [m] */
  int tip;           /* node that moves most */
  int tip_axis;      /* along which */
  double tip_motion; /* how far [m] */
  double energy;     /* largest kinetic energy [J] */
  double period;     /* of the dominant motion [s]; NaN: the run is too short to show one */
} flesh_accuracy_scale;

/* How differences are measured. */
typedef struct flesh_accuracy_measure {
  int nodes;
  double *mass;  /* [nodes] lumped */
  double *start; /* [3*nodes] positions at the start */
  double *rest;  /* [3*nodes] of the mesh */
  double rest_volume;
} flesh_accuracy_measure;

int flesh_accuracy_measure_open(const flesh_scene *scene, flesh_accuracy_measure *measure);
void flesh_accuracy_measure_close(flesh_accuracy_measure *measure);

/* Of the motion of `track`, the reference. */
void flesh_accuracy_measure_scale(const flesh_accuracy_measure *measure, const flesh_mesh *mesh,
                                  const flesh_accuracy_grid *grid,
                                  const flesh_accuracy_track *track, flesh_accuracy_scale *scale);

typedef struct flesh_accuracy_errors {
  double position_rms; /* largest over time of the mass-weighted RMS distance of the nodes [m] */
  double position_max; /* largest distance of a node at any time [m] */
  double tip;          /* largest distance of the node that moves most [m] */
  double volume;       /* largest difference of volume, over the rest volume */
  double energy;       /* difference of the energies where it is largest, signed, over the largest
                          kinetic energy of the reference */
} flesh_accuracy_errors;

void flesh_accuracy_compare(const flesh_accuracy_measure *measure,
                            const flesh_accuracy_scale *scale, const flesh_accuracy_track *track,
                            const flesh_accuracy_track *reference, flesh_accuracy_errors *errors);

/* The uncertainty of a reference that differs from another by `u` and changed by `estimate` (rms)
 * when it was refined last: two methods may agree and err alike, so none is known better than to
 * its own last change. */
void flesh_accuracy_widen(double estimate, flesh_accuracy_errors *u);

/* What an integration cost. */
typedef struct flesh_accuracy_cost {
  long steps, rejected, residuals, assemblies, newton, linear;
  double cpu_s, wall_s;
} flesh_accuracy_cost;

/* Integrates the scene as it stands over the grid into `track`, without any output, told nothing
 * but the time between steps. `steps_file` (may be NULL): the adaptive method's own steps, as CSV
 * `t,h,order`. Stops with FLESH_ERR_INTERRUPTED after a signal and FLESH_ERR_BUDGET after
 * `max_seconds` (0: never). */
int flesh_accuracy_integrate(const flesh_scene *scene, const flesh_accuracy_grid *grid,
                             double max_seconds, const char *steps_file,
                             flesh_accuracy_track *track, flesh_accuracy_cost *cost);

#endif
