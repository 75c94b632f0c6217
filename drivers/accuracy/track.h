/* track.h: the states of a run at given times, interpolation between them, and differences of two runs. */
#ifndef FLESH_ACCURACY_TRACK_H
#define FLESH_ACCURACY_TRACK_H

#include "flesh/scene.h"

/* The times of a track: start + k * interval for k = 0, 1, ..., and the end. The interval is the longest step divided
 * by a power of two, or for long runs a multiple of that step. */
typedef struct flesh_accuracy_grid {
  double start, end, longest, interval;
  int count;
} flesh_accuracy_grid;

/* Least number of times, if there is room for them. */
enum { FLESH_ACCURACY_TIMES = 512 };
/* Makes the grid of a run whose longest step is `longest`, with at most `room` times. */
void flesh_accuracy_grid_make(double start, double end, double longest, int room, flesh_accuracy_grid *grid);
/* Returns how many times a track with that many unknowns may have: making a reference takes seven tracks, in a
 * gigabyte. */
int flesh_accuracy_room(int unknowns);

/* States at the times. The track owns its arrays, which are one array in this order. */
typedef struct flesh_accuracy_track {
  int times, unknowns;
  double *t;               /* [times] */
  double *x, *v;           /* [times][unknowns] */
  double *energy, *volume; /* [times] J, m^3 */
} flesh_accuracy_track;

int flesh_accuracy_track_open(int times, int unknowns, flesh_accuracy_track *track);
void flesh_accuracy_track_close(flesh_accuracy_track *track);
/* Computes to = finer + factor (finer - coarser) for positions and velocities; `to` may be either of them. */
void flesh_accuracy_extrapolate(const flesh_accuracy_track *finer, const flesh_accuracy_track *coarser, double factor,
                                flesh_accuracy_track *to);
void flesh_accuracy_track_copy(const flesh_accuracy_track *from, flesh_accuracy_track *to);
/* Write a file completely or not at all; read one, which opens the track. FLESH_ERR_FILE. */
int flesh_accuracy_track_write(const char *path, const flesh_accuracy_track *track);
int flesh_accuracy_track_read(const char *path, flesh_accuracy_track *track);
/* Computes energies and volumes of its states. */
int flesh_accuracy_track_evaluate(const flesh_system *system, flesh_accuracy_track *track);

/* The size of the motion, measured on the reference. */
typedef struct flesh_accuracy_scale {
  double length;     /* longest side of the body at rest [m] */
  double motion;     /* largest mass-weighted RMS distance from the start [m] */
  int tip;           /* node that moves farthest */
  int tip_axis;      /* axis along which it moves farthest */
  double tip_motion; /* how far [m] */
  double energy;     /* largest kinetic energy [J] */
  double period;     /* of the dominant motion [s]; NaN: the run is too short to show one */
} flesh_accuracy_scale;

/* Data for measuring differences. */
typedef struct flesh_accuracy_measure {
  int nodes;
  double *mass;   /* [nodes] lumped; the next two arrays stand behind it */
  double *start;  /* [3*nodes] positions at the start */
  double *rest;   /* [3*nodes] positions of the mesh */
  double start_t; /* s */
  double rest_volume;
  int break_count;
  double *breaks; /* [break_count] ascending times at which the motion has a kink: the scene's events */
} flesh_accuracy_measure;

int flesh_accuracy_measure_open(const flesh_scene *scene, flesh_accuracy_measure *measure);
void flesh_accuracy_measure_close(flesh_accuracy_measure *measure);

/* Measures the scale of the motion of `track`, the reference. */
void flesh_accuracy_measure_scale(const flesh_accuracy_measure *measure, const flesh_mesh *mesh,
                                  const flesh_accuracy_track *track, flesh_accuracy_scale *scale);

typedef struct flesh_accuracy_errors {
  double position_rms; /* largest over time of the mass-weighted RMS distance of the nodes [m] */
  double position_max; /* largest distance of a node at any time [m] */
  double tip;          /* largest distance at any time of the node that moves farthest [m] */
  double volume;       /* largest difference of volume, over the rest volume */
  double energy;       /* difference of energies, largest in size, with its sign, over the largest kinetic
                          energy of the reference */
} flesh_accuracy_errors;

/* Raises *errors to the differences between a track at its time k and the reference at time `at`, where these are
 * larger. */
void flesh_accuracy_compare_times(const flesh_accuracy_measure *measure, const flesh_accuracy_scale *scale,
                                  const flesh_accuracy_track *track, int k, const flesh_accuracy_track *reference, int at,
                                  flesh_accuracy_errors *errors);
/* Compares two tracks with the same times. */
void flesh_accuracy_compare(const flesh_accuracy_measure *measure,
                            const flesh_accuracy_scale *scale, const flesh_accuracy_track *track,
                            const flesh_accuracy_track *reference, flesh_accuracy_errors *errors);

/* Returns the largest mass-weighted RMS distance at any time between two tracks with the same times [m]. */
double flesh_accuracy_apart(const flesh_accuracy_measure *measure, const flesh_accuracy_track *a,
                            const flesh_accuracy_track *b);
/* Returns the largest such distance between the track's first `times` and fixed positions x [unknowns] [m]. */
double flesh_accuracy_apart_from(const flesh_accuracy_measure *measure, const flesh_accuracy_track *track, int times,
                                 const double *x);

/* Interpolates the track's state x, v [unknowns] at a time from its first to its last. Returns 0 if it is not known:
 * between two of the track's times with a break between them. */
int flesh_accuracy_track_at(const flesh_accuracy_track *track, const flesh_accuracy_measure *measure, double t, double *x,
                            double *v);
/* Estimates the error of interpolation between its times: from what interpolation from half of them, and from a
 * quarter, misses at the times left out. */
int flesh_accuracy_track_doubt(const flesh_system *system, const flesh_accuracy_measure *measure,
                               const flesh_accuracy_scale *scale, const flesh_accuracy_track *track,
                               flesh_accuracy_errors *doubt);

/* Widens the uncertainty `u` of a reference, its difference from another one, by `estimate`, its RMS change at the last
 * refinement, and by `doubt` between its times. Two methods may agree and have the same error, so a reference is known
 * no better than to its own last change. */
void flesh_accuracy_widen(double estimate, const flesh_accuracy_errors *doubt, flesh_accuracy_errors *u);

/* Returns the order p with which differences |f0-f1| and |f1-f2| of sizes h0 > h1 > h2 decrease, f = limit + c h^p;
 * within 0.5 to 4, NaN if they do not decrease. */
double flesh_accuracy_order(const double h[3], double first, double second);

/* The cost of an integration. */
typedef struct flesh_accuracy_cost {
  flesh_solve_stats counts;
  int rejected; /* steps, by their error or because their solve failed */
  double cpu_s, wall_s;
  double gain; /* of flesh_energy_balance */
} flesh_accuracy_cost;

/* An observer of a run; the time that it takes is not counted. If it returns a negative status, the run ends with
 * it. */
typedef struct flesh_accuracy_watch {
  int (*see)(void *data, const flesh_state *state);
  void *data;
  int own_steps; /* observe also every step that an adaptive method chooses, not only the times at which it is asked */
} flesh_accuracy_watch;

/* Integrates the scene as it stands from start to end in steps of time.step; the integrator is told only the time
 * between steps. `steps_file` (may be NULL): the steps that the adaptive method chose, as CSV
 * `t,h,order,rejected,convergence_failures`. Stops with FLESH_ERR_INTERRUPTED after a signal and with FLESH_ERR_BUDGET
 * after `max_seconds` (0: never). */
int flesh_accuracy_integrate(const flesh_scene *scene, const flesh_accuracy_grid *grid, double max_seconds,
                             const char *steps_file, const flesh_accuracy_watch *watch, flesh_accuracy_cost *cost);

/* Integrates in the same way and keeps the states at the times of `keep`, at which the run's steps end, in the track. */
int flesh_accuracy_integrate_into(const flesh_scene *scene, const flesh_accuracy_grid *grid, double max_seconds,
                                  const flesh_accuracy_grid *keep, flesh_accuracy_track *track, flesh_accuracy_cost *cost);

#endif
