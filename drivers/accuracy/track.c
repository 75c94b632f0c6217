/* track.c: states of a run at the times of comparison, and differences of two runs. */
#include "accuracy/track.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/file.h"
#include "base/scan.h"
#include "parallel/body_figures.h"

int flesh_accuracy_room(int unknowns)
{
  const double bytes = 1 << 30, tracks = 7, of_a_time = 2.0 * sizeof(double) * unknowns;
  return (int)fmin(fmax(bytes / (tracks * of_a_time), 64), 4096);
}

void flesh_accuracy_grid_make(double start, double end, double longest, int room, flesh_accuracy_grid *grid)
{
  double steps = ceil((end - start) / longest - 1e-6), interval = longest;
  while (longest / interval * steps < FLESH_ACCURACY_TIMES && 2 * longest / interval * steps < room) interval /= 2;
  if (steps >= room) interval = longest * ceil(steps / (room - 1));
  int intervals = (int)ceil((end - start) / interval - 1e-6);
  *grid = (flesh_accuracy_grid){start, end, longest, interval, intervals + 1};
}

/* Returns the count of numbers in a track; its arrays form one, in the order of its members. */
static size_t length_of(const flesh_accuracy_track *track)
{
  return (size_t)track->times * (2 * (size_t)track->unknowns + 3);
}

int flesh_accuracy_track_open(int times, int unknowns, flesh_accuracy_track *track)
{
  const size_t all = (size_t)times * (size_t)unknowns;
  *track = (flesh_accuracy_track){.times = times, .unknowns = unknowns};
  if (!(track->t = calloc(length_of(track) + 1, sizeof(double)))) {
    flesh_accuracy_track_close(track);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d states of %d unknowns", times, unknowns);
  }
  track->x = track->t + times, track->v = track->x + all;
  track->energy = track->v + all, track->volume = track->energy + times;
  return FLESH_OK;
}

void flesh_accuracy_track_close(flesh_accuracy_track *track)
{
  free(track->t);
  *track = (flesh_accuracy_track){0};
}

void flesh_accuracy_track_copy(const flesh_accuracy_track *from, flesh_accuracy_track *to)
{
  memcpy(to->t, from->t, length_of(from) * sizeof(double));
}

void flesh_accuracy_extrapolate(const flesh_accuracy_track *finer, const flesh_accuracy_track *coarser, double factor,
                                flesh_accuracy_track *to)
{
  memcpy(to->t, finer->t, (size_t)to->times * sizeof *to->t);
  for (double *x = to->x; x < to->energy; x++) { /* velocities stand behind positions */
    const ptrdiff_t d = x - to->x;
    *x = finer->x[d] + factor * (finer->x[d] - coarser->x[d]);
  }
}

static const char magic[16] = "flesh states 1\n";

int flesh_accuracy_track_write(const char *path, const flesh_accuracy_track *track)
{
  flesh_file file;
  int status = flesh_file_open(path, &file);
  if (status) return status;
  const int32_t counts[2] = {track->times, track->unknowns};
  fwrite(magic, 1, sizeof magic, file.stream);
  fwrite(counts, sizeof counts[0], 2, file.stream);
  fwrite(track->t, sizeof(double), length_of(track), file.stream);
  return flesh_file_commit(&file); /* reports what was not written */
}

int flesh_accuracy_track_read(const char *path, flesh_accuracy_track *track)
{
  char head[16];
  int32_t counts[2];
  *track = (flesh_accuracy_track){0};
  FILE *stream;
  const int opened = flesh_regular_open(path, &stream);
  if (opened) return opened;
  int whole = fread(head, 1, sizeof head, stream) == sizeof head && !memcmp(head, magic, 16) &&
              fread(counts, sizeof counts[0], 2, stream) == 2 && counts[0] > 0 && counts[1] > 0 &&
              counts[0] <= 1 << 20 && counts[1] <= 1 << 30;
  int status = whole ? flesh_accuracy_track_open(counts[0], counts[1], track) : FLESH_OK;
  if (whole && !status)
    whole = fread(track->t, sizeof(double), length_of(track), stream) == length_of(track) && getc(stream) == EOF;
  fclose(stream);
  if (!whole) {
    flesh_accuracy_track_close(track);
    return flesh_fail(FLESH_ERR_FILE, "%s: holds no complete state of a run", path);
  }
  return status;
}

int flesh_accuracy_track_evaluate(const flesh_system *system, flesh_accuracy_track *track)
{
  int effects = flesh_system_effect_count(system);
  double *zeros = calloc((size_t)track->unknowns + (size_t)effects, sizeof(double));
  double *energies = zeros ? zeros + track->unknowns : NULL;
  int status = zeros ? FLESH_OK : flesh_no_memory();
  for (int k = 0; k < track->times && !status; k++) {
    const double *x = track->x + (size_t)k * (size_t)track->unknowns;
    const double *v = track->v + (size_t)k * (size_t)track->unknowns;
    const flesh_point point = flesh_point_at(track->t[k], x, v, zeros);
    status = flesh_system_energies(system, &point, energies);
    double sum = status > 0 ? NAN : 0; /* a state with J <= 0 may have no energy */
    if (status > 0) status = FLESH_OK;
    for (int e = 0; e < effects; e++) sum += energies[e];
    track->energy[k] = sum;
    track->volume[k] = flesh_mesh_volume(flesh_system_mesh(system), x);
  }
  free(zeros);
  return status;
}

/* Finds as many events as a run is likely to have; further ones are kinks that the uncertainty of a reference
 * covers. */
static int find_breaks(const flesh_system *system, double start, double end, flesh_accuracy_measure *measure)
{
  enum { MOST = 10000 };
  measure->breaks = malloc(sizeof(double) * MOST);
  if (!measure->breaks) return flesh_no_memory();
  for (double t = start; measure->break_count < MOST;) {
    double next = flesh_system_next_event(system, t);
    if (!(next > t && next < end)) break;
    measure->breaks[measure->break_count++] = t = next;
  }
  return FLESH_OK;
}

int flesh_accuracy_measure_open(const flesh_scene *scene, flesh_accuracy_measure *measure)
{
  const flesh_mesh *mesh = flesh_scene_mesh(scene);
  size_t nodes = (size_t)flesh_mesh_node_count(mesh);
  *measure = (flesh_accuracy_measure){.nodes = (int)nodes, .mass = calloc(10 * nodes, sizeof(double))};
  if (!measure->mass) return flesh_no_memory();
  measure->start = measure->mass + nodes;
  measure->rest = measure->start + 3 * nodes;
  flesh_state state = {.t = 0, .x = measure->start, .v = measure->rest + 3 * nodes};
  flesh_scene_start(scene, &state);
  measure->start_t = state.t;
  memcpy(measure->rest, flesh_mesh_positions(mesh), 3 * nodes * sizeof(double));
  int status = find_breaks(flesh_scene_system(scene), state.t, flesh_scene_times(scene)->end, measure);
  if (status) {
    flesh_accuracy_measure_close(measure);
    return status;
  }
  flesh_mesh_lumped_mass(mesh, flesh_scene_body(scene)->density, measure->mass);
  measure->rest_volume = flesh_mesh_volume(mesh, flesh_mesh_positions(mesh));
  return FLESH_OK;
}

void flesh_accuracy_measure_close(flesh_accuracy_measure *measure)
{
  free(measure->mass);
  free(measure->breaks);
  *measure = (flesh_accuracy_measure){0};
}

/* Returns the mass-weighted RMS of |a-b| over the nodes; *largest is the largest distance, and *node its node. */
static double distance(const flesh_accuracy_measure *measure, const double *a, const double *b,
                       double *largest, int *node)
{
  double sum = 0, mass = 0, most = -1;
  *node = 0;
  for (int i = 0; i < measure->nodes; i++) {
    double d2 = 0;
    for (int c = 0; c < 3; c++) d2 += (a[3 * i + c] - b[3 * i + c]) * (a[3 * i + c] - b[3 * i + c]);
    sum += measure->mass[i] * d2;
    mass += measure->mass[i];
    if (measure->mass[i] > 0 && d2 > most) most = d2, *node = i;
  }
  *largest = sqrt(fmax(most, 0));
  return sqrt(sum / mass);
}

/* Finds the period from the times at which the tip passes its mean place, two of which are half a period apart. Swings
 * below a tenth of the largest are ignored. */
static double find_period(const flesh_accuracy_track *track, int dof)
{
  double mean = 0, reach = 0, first = NAN, last = NAN, side = 0, crossing = NAN;
  int crossings = 0, times = track->times;
  const double *x = track->x + dof;
  const size_t n = (size_t)track->unknowns;
  for (int k = 0; k < times; k++) mean += x[(size_t)k * n] / times;
  for (int k = 0; k < times; k++) reach = fmax(reach, fabs(x[(size_t)k * n] - mean));
  double previous = x[0] - mean, t = track->t[0];
  if (fabs(previous) > 0.1 * reach) side = copysign(1, previous);
  for (int k = 1; k < times; k++) {
    double now = x[(size_t)k * n] - mean;
    if (now * previous < 0) crossing = t + (track->t[k] - t) * previous / (previous - now);
    if (fabs(now) > 0.1 * reach) {
      if (side != 0 && now * side < 0) {
        if (isnan(first)) first = crossing;
        last = crossing;
        crossings++;
      }
      side = copysign(1, now);
    }
    t = track->t[k];
    if (now != 0) previous = now;
  }
  return crossings >= 2 ? 2 * (last - first) / (crossings - 1) : NAN;
}

void flesh_accuracy_measure_scale(const flesh_accuracy_measure *measure, const flesh_mesh *mesh,
                                  const flesh_accuracy_track *track, flesh_accuracy_scale *scale)
{
  *scale = (flesh_accuracy_scale){.length = flesh_body_longest_side(mesh, NULL), .period = NAN};
  int when = 0;
  for (int k = 0; k < track->times; k++) {
    const size_t at = (size_t)k * (size_t)track->unknowns;
    double largest, kinetic = 0;
    int node;
    scale->motion =
        fmax(scale->motion, distance(measure, track->x + at, measure->start, &largest, &node));
    if (largest > scale->tip_motion) scale->tip_motion = largest, scale->tip = node, when = k;
    for (int d = 0; d < track->unknowns; d++)
      kinetic += measure->mass[d / 3] * track->v[at + (size_t)d] * track->v[at + (size_t)d] / 2;
    scale->energy = fmax(scale->energy, kinetic);
  }
  const double *x = track->x + (size_t)when * (size_t)track->unknowns + 3 * scale->tip;
  double most = -1;
  for (int c = 0; c < 3; c++)
    if (fabs(x[c] - measure->start[3 * scale->tip + c]) > most)
      most = fabs(x[c] - measure->start[3 * scale->tip + c]), scale->tip_axis = c;
  int dof = 3 * scale->tip + scale->tip_axis;
  if (most > 0) scale->period = find_period(track, dof);
}

/* Keeps the larger absolute value; a NaN stays. */
static void grow(double *most, double value)
{
  if (!isnan(*most) && !(fabs(value) <= fabs(*most))) *most = value;
}

void flesh_accuracy_compare_times(const flesh_accuracy_measure *measure, const flesh_accuracy_scale *scale,
                                  const flesh_accuracy_track *track, int k, const flesh_accuracy_track *reference, int at,
                                  flesh_accuracy_errors *errors)
{
  const double *x = track->x + (size_t)k * (size_t)track->unknowns;
  const double *true_x = reference->x + (size_t)at * (size_t)reference->unknowns;
  double largest, tip2 = 0;
  int node;
  double rms = distance(measure, x, true_x, &largest, &node);
  for (int c = 3 * scale->tip; c < 3 * scale->tip + 3; c++) tip2 += (x[c] - true_x[c]) * (x[c] - true_x[c]);
  grow(&errors->position_rms, rms);
  grow(&errors->position_max, largest);
  grow(&errors->tip, sqrt(tip2));
  grow(&errors->volume, fabs(track->volume[k] - reference->volume[at]) / measure->rest_volume);
  grow(&errors->energy, (track->energy[k] - reference->energy[at]) / scale->energy);
}

void flesh_accuracy_compare(const flesh_accuracy_measure *measure,
                            const flesh_accuracy_scale *scale, const flesh_accuracy_track *track,
                            const flesh_accuracy_track *reference, flesh_accuracy_errors *errors)
{
  *errors = (flesh_accuracy_errors){0};
  for (int k = 0; k < track->times; k++) flesh_accuracy_compare_times(measure, scale, track, k, reference, k, errors);
}

double flesh_accuracy_apart_from(const flesh_accuracy_measure *measure, const flesh_accuracy_track *track, int times,
                                 const double *x)
{
  double apart = 0, largest;
  int node;
  for (int k = 0; k < times; k++)
    grow(&apart, distance(measure, track->x + (size_t)k * (size_t)track->unknowns, x, &largest, &node));
  return apart;
}

double flesh_accuracy_apart(const flesh_accuracy_measure *measure, const flesh_accuracy_track *a,
                            const flesh_accuracy_track *b)
{
  const flesh_accuracy_scale unit = {.energy = 1};
  flesh_accuracy_errors errors;
  flesh_accuracy_compare(measure, &unit, a, b, &errors);
  return errors.position_rms;
}

void flesh_accuracy_widen(double estimate, const flesh_accuracy_errors *doubt, flesh_accuracy_errors *u)
{
  double factor = u->position_rms > 0 ? fmax(1, estimate / u->position_rms) : 1;
  u->position_rms = fmax(u->position_rms, estimate) + doubt->position_rms;
  u->position_max = factor * u->position_max + doubt->position_max;
  u->tip = factor * u->tip + doubt->tip;
  u->volume = factor * u->volume + doubt->volume;
  u->energy = factor * fabs(u->energy) + fabs(doubt->energy);
}

/* Returns |f0-f1|/|f1-f2| for errors proportional to h^p. */
static double ratio(const double h[3], double p)
{
  return (pow(h[0], p) - pow(h[1], p)) / (pow(h[1], p) - pow(h[2], p));
}

double flesh_accuracy_order(const double h[3], double first, double second)
{
  double low = 0.5, high = 4;
  const double wanted = first / second;
  if (!(second > 0) || !(first > 0) || !isfinite(wanted) || wanted < ratio(h, low)) return NAN;
  if (wanted > ratio(h, high)) return high;
  for (int k = 0; k < 60; k++) {
    const double middle = (low + high) / 2;
    if (ratio(h, middle) < wanted) low = middle;
    else high = middle;
  }
  return (low + high) / 2;
}
