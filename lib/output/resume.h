/* resume.h: reopens files that a run has begun, to continue from a checkpoint: data after it are removed, and missing
 * data before it are an error. Counterparts of the functions in flesh/observer.h and flesh/probe.h; also the figures of
 * a run's probes. */
#ifndef FLESH_OUTPUT_RESUME_H
#define FLESH_OUTPUT_RESUME_H

#include "flesh/observer.h"
#include "flesh/probe.h"

/* Return the number of bytes of all whole rows so far. */
long flesh_history_length(const flesh_history *history);
long flesh_probes_length(const flesh_probes *probes);

/* Opens a history with the first `length` bytes of the file. FLESH_ERR_FILE if it has fewer; FLESH_ERR_MEMORY. */
int flesh_history_resume(const char *path, const flesh_system *system, long length, flesh_history **history);
/* Gives probes made by flesh_probes_open the file, with its first `length` bytes. The probes are closed if that fails:
 * FLESH_ERR_FILE if it has fewer. */
int flesh_probes_resume(flesh_probes **probes, const char *path, long length);
/* Makes probes without a file, for their figures. Every rank calls this and the following. */
int flesh_probes_open(const flesh_body *body, const flesh_system *system, flesh_method method, int count,
                      const flesh_probe *probes, flesh_probes **result);
/* Adds columns named "..._smooth" of what tets give at points in ten-node tets, smoothed over the tets around; not on
 * ranks, and before the file. The probes are closed if this or the next fails: FLESH_ERR_MEMORY, FLESH_ERR_FILE. */
int flesh_probes_smooth(flesh_probes **probes);
/* Gives the probes a new file with a header. */
int flesh_probes_begin(flesh_probes **probes, const char *path);

/* Part of a column's name in probes.csv after the probe's name, such as "position_x", and the column's unit. */
typedef struct flesh_probe_column {
  const char *name, *unit;
} flesh_probe_column;
enum { FLESH_PROBE_COLUMNS = 29, FLESH_PROBE_FIGURES = 3 };
/* Lists the columns of a probe, which need not be prepared, in their order. Returns their number. */
int flesh_probe_columns(const flesh_probe *probe, flesh_probe_column columns[FLESH_PROBE_COLUMNS]);
/* Records the values of each row, on the rank that writes, in [FLESH_PROBE_FIGURES] of every column: the last, the
 * smallest and the largest. All begin as NaN, which counts as no value. Borrows the figures. */
void flesh_probes_note(flesh_probes *probes, double *figures);
/* Returns the forces of the record that was observed last. */
struct flesh_node_forces *flesh_probes_forces(flesh_probes *probes);
/* Adds to by_x [3*n] the derivative of a column of the first probe by x; the probe has one quantity, which comes from
 * tets. */
void flesh_probes_differentiate(const flesh_probes *probes, const flesh_state *state, int column, double *by_x);

/* Opens frames and keeps those up to step `last`. FLESH_ERR_FILE if one of these is missing; FLESH_ERR_MEMORY. */
int flesh_frames_resume(const char *directory, const flesh_mesh *mesh, int every, int last, flesh_frames **frames);
/* Continues the frames of the skin, which flesh_skin_frames_open has made without files, after step `last`. A point
 * cache, which appears only when it is closed, is made again from the body's frames in `body_frames`. FLESH_ERR_FILE if
 * a frame is missing, FLESH_ERR_MEMORY; the skin's frames are then abandoned. */
int flesh_skin_frames_resume(flesh_skin_frames **frames, int last, const char *body_frames, const flesh_mesh *mesh);
int flesh_skin_frames_open(const char *directory, const flesh_skin *skin, const flesh_surface *surface,
                           unsigned formats, int every, flesh_skin_frames **frames);

#endif
