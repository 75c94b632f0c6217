/* track.h: a run as it was at given times and between them, and how far two of them differ. */
#ifndef FLESH_ACCURACY_TRACK_H
#define FLESH_ACCURACY_TRACK_H

#include "flesh/observer.h"
#include "flesh/scene.h"

/* The times of a track: start + k every interval for k = 0, 1, ..., and the end. Where runs are long the interval is a
 * multiple of the longest step, else a 2^n-th of it. */
typedef struct flesh_accuracy_grid {
  double start, end, longest, interval;
  int count;
} flesh_accuracy_grid;

/* At least so many where there is room for them. */
enum { FLESH_ACCURACY_TIMES = 512 };
/* For runs whose longest step is `longest`, `room` times at most. */
void flesh_accuracy_grid_make(double start, double end, double longest, int room, flesh_accuracy_grid *grid);
/* How many times of a track of so many unknowns there is room for: a reference takes seven tracks in a gigabyte. */
int flesh_accuracy_room(int unknowns);

/* States at the times; all arrays belong to it, and are one in this order. */
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
  double *mass;   /* [nodes] lumped; the next two arrays follow it */
  double *start;  /* [3*nodes] positions at the start */
  double *rest;   /* [3*nodes] of the mesh */
  double start_t; /* s */
  double rest_volume;
  int break_count;
  double *breaks; /* [break_count] times in order at which the motion has a kink: the scene's events */
} flesh_accuracy_measure;

int flesh_accuracy_measure_open(const flesh_scene *scene, flesh_accuracy_measure *measure);
void flesh_accuracy_measure_close(flesh_accuracy_measure *measure);

/* Measures the scale of the motion of `track`, the reference. */
void flesh_accuracy_measure_scale(const flesh_accuracy_measure *measure, const flesh_mesh *mesh,
                                  const flesh_accuracy_track *track, flesh_accuracy_scale *scale);

typedef struct flesh_accuracy_errors {
  double position_rms; /* largest over time of the mass-weighted RMS distance of the nodes [m] */
  double position_max; /* largest distance of a node at any time [m] */
  double tip;          /* largest distance of the node that moves most [m] */
  double volume;       /* largest difference of volume, over the rest volume */
  double energy;       /* difference of the energies where it is largest, signed, over the largest
                          kinetic energy of the reference */
} flesh_accuracy_errors;

/* Keeps the larger of *errors and the differences between a track at its time k and the reference at time `at`. */
void flesh_accuracy_compare_times(const flesh_accuracy_measure *measure, const flesh_accuracy_scale *scale,
                                  const flesh_accuracy_track *track, int k, const flesh_accuracy_track *reference, int at,
                                  flesh_accuracy_errors *errors);
/* Compares two tracks of the same times. */
void flesh_accuracy_compare(const flesh_accuracy_measure *measure,
                            const flesh_accuracy_scale *scale, const flesh_accuracy_track *track,
                            const flesh_accuracy_track *reference, flesh_accuracy_errors *errors);

/* Largest over time of the mass-weighted RMS distance of two tracks of the same times [m]. */
double flesh_accuracy_apart(const flesh_accuracy_measure *measure, const flesh_accuracy_track *a,
                            const flesh_accuracy_track *b);
/* Largest of such distances between the track's first `times` and positions x [unknowns] that stay [m]. */
double flesh_accuracy_apart_from(const flesh_accuracy_measure *measure, const flesh_accuracy_track *track, int times,
                                 const double *x);

/* The track's state at a time from its first to its last: x, v [unknowns]. 0 where it is not known: between two of its times
 * with a break between them. */
int flesh_accuracy_track_at(const flesh_accuracy_track *track, const flesh_accuracy_measure *measure, double t, double *x,
                            double *v);
/* How well it is known between its times: from what half of them, and a quarter, leave out. */
int flesh_accuracy_track_doubt(const flesh_system *system, const flesh_accuracy_measure *measure,
                               const flesh_accuracy_scale *scale, const flesh_accuracy_track *track,
                               flesh_accuracy_errors *doubt);

/* The uncertainty of a reference that differs from another by `u`, changed by `estimate` (rms) when it was refined
 * last, and is known between its times but for `doubt`: two methods may agree and err alike, so none is known better
 * than to its own last change. */
void flesh_accuracy_widen(double estimate, const flesh_accuracy_errors *doubt, flesh_accuracy_errors *u);

/* The order p at which differences |f0-f1| and |f1-f2| of sizes h0 > h1 > h2 fall, f = limit + c h^p; within 0.5 to 4,
 * NaN where they do not fall. */
double flesh_accuracy_order(const double h[3], double first, double second);

/* The cost of an integration. */
typedef struct flesh_accuracy_cost {
  long steps, rejected, residuals, assemblies, newton, linear;
  double cpu_s, wall_s;
  double gain; /* of flesh_energy_balance */
} flesh_accuracy_cost;

/* The watcher of a run; the time it takes is not counted. A negative status ends the run with it. */
typedef struct flesh_accuracy_watch {
  int (*see)(void *data, const flesh_state *state);
  void *data;
  int own_steps; /* also after every step that an adaptive method takes, not only where it is asked */
} flesh_accuracy_watch;

/* Integrates the scene as it stands from start to end in steps of time.step, with no more known than the time between
 * steps.
 * `steps_file` (may be NULL): the adaptive method's own steps, as CSV `t,h,order`. Stops with FLESH_ERR_INTERRUPTED
 * after a signal and FLESH_ERR_BUDGET after `max_seconds` (0: never). */
int flesh_accuracy_integrate(const flesh_scene *scene, const flesh_accuracy_grid *grid, double max_seconds,
                             const char *steps_file, const flesh_accuracy_watch *watch, flesh_accuracy_cost *cost);

/* A watch that keeps the states at the grid's times, of a run that steps onto them. */
typedef struct flesh_accuracy_keeper {
  const flesh_accuracy_grid *grid;
  flesh_accuracy_track *track; /* of grid->count times */
  int next;
} flesh_accuracy_keeper;
int flesh_accuracy_keep_state(void *keeper, const flesh_state *state);

#endif
