/* resume.h: files that a run has begun, opened again where it goes on: what stands behind that place goes, what is
 * missing before it is refused. The counterparts of flesh/observer.h's and flesh/probe.h's functions; and the figures of
 * a run's probes. */
#ifndef FLESH_OUTPUT_RESUME_H
#define FLESH_OUTPUT_RESUME_H

#include "flesh/observer.h"
#include "flesh/probe.h"

/* Bytes of the whole rows so far. */
long flesh_history_length(const flesh_history *history);
long flesh_probes_length(const flesh_probes *probes);

/* With the first `length` bytes of what is there. FLESH_ERR_FILE where that is less. */
int flesh_history_resume(const char *path, const flesh_system *system, long length, flesh_history **history);
/* Probes that flesh_probes_open has made without a file; they are closed when it fails. */
int flesh_probes_resume(flesh_probes **probes, const char *path, long length);
/* Without a file, for what is noted of them. Every rank calls it. */
int flesh_probes_open(const flesh_body *body, const flesh_system *system, flesh_method method, int count,
                      const flesh_probe *probes, flesh_probes **result);

/* A column of probes.csv behind the probe's name, as "position_x", and its unit. */
typedef struct flesh_probe_column {
  const char *name, *unit;
} flesh_probe_column;
enum { FLESH_PROBE_COLUMNS = 29, FLESH_PROBE_FIGURES = 3 };
/* The columns of a probe, which need not be prepared, in their order. Returns how many there are. */
int flesh_probe_columns(const flesh_probe *probe, flesh_probe_column columns[FLESH_PROBE_COLUMNS]);
/* Has each row's values noted on the rank that writes, in [FLESH_PROBE_FIGURES] of every column: the last, the smallest and
 * the largest one; NaN, which they are at first, counts as none. Borrows the figures. */
void flesh_probes_note(flesh_probes *probes, double *figures);
/* The forces of the record that was observed last. */
struct flesh_node_forces *flesh_probes_forces(flesh_probes *probes);
/* by_x [3*n] += the derivative by x of the first probe's column, of its one quantity, which is one of tets. */
void flesh_probes_differentiate(const flesh_probes *probes, const flesh_state *state, int column, double *by_x);

/* With the frames up to step `last`. FLESH_ERR_FILE where one of these is missing. */
int flesh_frames_resume(const char *directory, const flesh_mesh *mesh, int every, int last, flesh_frames **frames);
/* Goes on with the frames of the skin, which flesh_skin_frames_open has made without files, up to step `last`. A point
 * cache, which appears only when it is closed, is made again from the body's frames in `body_frames`. The skin's frames
 * are abandoned when it fails: FLESH_ERR_FILE where a frame is missing. */
int flesh_skin_frames_resume(flesh_skin_frames **frames, int last, const char *body_frames, const flesh_mesh *mesh);
int flesh_skin_frames_open(const char *directory, const flesh_skin *skin, const flesh_surface *surface,
                           unsigned formats, int every, flesh_skin_frames **frames);

#endif
