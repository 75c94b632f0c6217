/* runner_checkpoint.c: writes a run's checkpoints, and resumes a run from one. */
#include <stdlib.h>

#include "base/confine.h"
#include "base/clock.h"
#include "base/error.h"
#include "base/sync.h"
#include "output/resume.h"
#include "cli/interrupt.h"
#include "cli/json_memory.h"
#include "run/provenance.h"
#include "pool/pool.h"
#include "run/running.h"

int flesh_running_asked_to_end(flesh_running *r)
{
  const char *more = r->checkpoint.on ? "; flesh run --resume goes on from its last checkpoint" : "";
  flesh_pool_listen(r->options->ranks);
  if (flesh_interrupt_signal())
    return flesh_fail(FLESH_ERR_INTERRUPTED, "interrupted by %s at t = %g s%s", flesh_interrupt_name(), r->state.t, more);
  if (r->options->max_seconds > 0 &&
      r->set_up + flesh_wall_seconds() - r->started > r->options->max_seconds)
    return flesh_fail(FLESH_ERR_BUDGET, "the budget of %g s is spent at t = %g s%s", r->options->max_seconds, r->state.t,
                      more);
  return FLESH_OK;
}

/* Returns as new text the parts of result.json that no other file has: inputs, resumptions and the scene's warning.
 * NULL when out of memory. */
static char *notes_of(const flesh_running *r)
{
  json_t *notes = json_object();
  json_object_set(notes, "inputs", r->inputs);
  json_object_set(notes, "resumed", r->resumed);
  json_object_set(notes, "warning", r->warning);
  char *text = json_dumps(notes, JSON_COMPACT);
  json_decref(notes);
  return text;
}

/* Waits until the files that a checkpoint refers to are on the disk. */
static int sync_files(flesh_running *r)
{
  int status = flesh_sync(flesh_running_path(r, "history.csv"));
  if (!status && r->checkpoint.step < 0) status = flesh_sync(flesh_running_path(r, "scene.yaml"));
  if (!status && r->probes) status = flesh_sync(flesh_running_path(r, "probes.csv"));
  if (!status && (r->frames || r->part_frames))
    status = flesh_sync_folder(flesh_running_path(r, "frames"), r->checkpoint.step);
  if (!status && r->skin_frames) status = flesh_sync_folder(flesh_running_path(r, "skin"), r->checkpoint.step);
  return status;
}

/* Returns the piece of the run that belongs to this rank, or all of it in a process without ranks. */
static flesh_checkpoint_piece piece_of(flesh_running *r)
{
  const flesh_ranks *ranks = r->options->ranks;
  return (flesh_checkpoint_piece){ranks ? flesh_scene_share_part(ranks->share) : NULL,
                                  flesh_system_unknowns(flesh_ranks_system(ranks, r->scene)) / 3,
                                  ranks ? &r->own : &r->state, r->integrator};
}

/* Opens the checkpoint's file and writes the parts that belong to the run as a whole. */
static int begin_checkpoint(flesh_running *r, int step, flesh_file *file)
{
  const double now = flesh_wall_seconds();
  const flesh_checkpoint_head head = {
      .times = r->options->checkpoint, .no_frames = r->options->no_frames, .step = step, .max_seconds = r->options->max_seconds,
      .exact = flesh_integrator_saves_all(r->integrator), .pieces = r->options->ranks ? r->options->ranks->count : 1,
      .start_t = r->start_t, .wall_s = now - r->started,
      .cpu_s = r->cpu_before + flesh_cpu_seconds() - r->cpu_begin,
      .history = flesh_history_length(r->history), .probes = r->probes ? flesh_probes_length(r->probes) : -1};
  if (!*r->checkpoint.digest) flesh_checkpoint_digest(r->options->out, r->checkpoint.digest);
  char *notes = notes_of(r);
  int status = notes ? sync_files(r) : flesh_no_memory();
  if (!status)
    status = flesh_checkpoint_begin(r->options->out, &head, r->checkpoint.digest, notes, r->figures, &r->trace, file);
  free(notes);
  return status;
}

/* Writes a checkpoint: every rank packs its piece, and the first writes all of them. */
static int write_checkpoint(flesh_running *r, int step)
{
  const flesh_ranks *ranks = r->options->ranks;
  const flesh_checkpoint_piece piece = piece_of(r);
  flesh_file file = {0};
  uint8_t *bytes = NULL;
  size_t size = 0;
  int status = flesh_ranks_first(ranks) ? begin_checkpoint(r, step, &file) : FLESH_OK;
  if (!status) status = flesh_running_sync_parts(r);
  if (!status) status = flesh_checkpoint_pack(&piece, &bytes, &size);
  status = flesh_ranks_agree(ranks, status);
  if (!status) status = flesh_ranks_gather_bytes(ranks, size, bytes, flesh_checkpoint_add, &file);
  if (!status && flesh_ranks_first(ranks)) status = flesh_sync_commit(&file);
  else flesh_file_abandon(&file);
  free(bytes);
  r->checkpoint.step = step;
  r->checkpoint.at = flesh_wall_seconds(); /* the interval between checkpoints begins after writing */
  return status;
}

int flesh_running_observe_checkpoint(void *data, const flesh_step_record *record)
{
  flesh_running *r = data;
  const flesh_checkpoint_times *times = &r->options->checkpoint;
  if (record->last) return FLESH_OK; /* a complete run needs no checkpoint */
  const int asked = flesh_running_asked_to_end(r);
  int due = asked || r->checkpoint.step < 0;
  if (times->steps) due |= record->step % times->steps == 0;
  if (times->seconds > 0) due |= flesh_wall_seconds() - r->checkpoint.at >= times->seconds;
  due = flesh_ranks_largest(r->options->ranks, due);
  int status = due && record->step != r->checkpoint.step ? write_checkpoint(r, record->step) : FLESH_OK;
  return status ? status : asked;
}

/* Checks that each file named by the scene has the checksum of one of the files at the start of the run. */
static int check_inputs(const flesh_running *r)
{
  json_t *now = flesh_provenance_scene(r->scene, r->options->scene_path);
  const json_t *files = json_object_get(now, "files"), *before = json_object_get(r->inputs, "files"), *file, *other;
  int status = FLESH_OK;
  size_t k, j;
  json_array_foreach(files, k, file) {
    int found = k == 0; /* scene.yaml, whose checksum is in the checkpoint */
    json_array_foreach(before, j, other)
      found |= json_equal(json_object_get(file, "sha256"), json_object_get(other, "sha256"));
    if (!found && !status)
      status = flesh_fail(FLESH_ERR_ARGUMENT, "%s: has changed since the run began; resuming needs the file as it was",
                          json_string_value(json_object_get(file, "path")));
  }
  json_decref(now);
  return flesh_json_lacks() ? flesh_no_memory() : status;
}

/* Records for result.json the step and time at which this part of the run begins. */
static int note_place(flesh_running *r)
{
  const flesh_checkpoint_head *head = &r->options->resume->head;
  json_t *place = json_pack("{sisfsb}", "step", head->step, "t", r->state.t, "same_bits", head->exact && r->checkpoint.fits);
  if (!r->resumed) r->resumed = json_array();
  if (!place || json_array_append_new(r->resumed, place)) return flesh_no_memory();
  return FLESH_OK;
}

/* Restores the state and the integrator's memory: from this rank's own piece if every rank has its own, else from all
 * pieces. On the first rank also restores the whole's state. */
static int restore_pieces(flesh_running *r)
{
  const flesh_ranks *ranks = r->options->ranks;
  const int rank = ranks ? ranks->rank : 0, count = ranks ? ranks->count : 1;
  const flesh_checkpoint_piece piece = piece_of(r);
  flesh_checkpoint_piece whole = {.nodes = flesh_mesh_node_count(flesh_scene_mesh(r->scene)), .state = &r->state};
  const flesh_checkpoint *from = r->options->resume;
  int status = flesh_checkpoint_fits(from, rank, count, &piece, &r->checkpoint.fits);
  r->checkpoint.fits = !flesh_ranks_largest(ranks, status || !r->checkpoint.fits);
  if (!status) status = flesh_checkpoint_unpack(from, r->checkpoint.fits ? rank : -1, &piece);
  if (ranks) r->state.t = r->own.t;
  if (!ranks || rank || status || flesh_running_is_split(r)) return status;
  status = flesh_checkpoint_unpack(from, -1, &whole);
  return status ? status : flesh_running_begin_whole(r);
}

int flesh_running_restore(flesh_running *r)
{
  const flesh_checkpoint *from = r->options->resume;
  json_t *notes = json_loads(from->notes, 0, NULL);
  r->inputs = json_incref(json_object_get(notes, "inputs"));
  r->resumed = json_incref(json_object_get(notes, "resumed"));
  r->warning = json_incref(json_object_get(notes, "warning"));
  json_decref(notes);
  int status = r->inputs ? check_inputs(r)
                         : flesh_fail(FLESH_ERR_FILE, "%s: the checkpoint lacks the list of the run's files", r->options->out);
  if (!status && flesh_ranks_first(r->options->ranks)) /* the other ranks have no figures */
    status = flesh_checkpoint_restore(from, r->figures, &r->trace);
  status = flesh_ranks_agree(r->options->ranks, status); /* all fail here before they wait for each other */
  if (!status) status = restore_pieces(r);
  if (!status) status = note_place(r);
  status = flesh_ranks_agree(r->options->ranks, status);
  r->start_t = from->head.start_t;
  r->step = r->checkpoint.step = from->head.step;
  r->cpu_before = from->head.cpu_s;
  return status;
}

int flesh_running_drop_checkpoint(flesh_running *r)
{
  int status = sync_files(r);
  if (!status) status = flesh_sync(flesh_running_path(r, "state.txt"));
  if (!status) status = flesh_sync(flesh_running_path(r, "result.json"));
  if (!status) status = flesh_sync(r->options->out);
  if (!status) flesh_path_unlink(flesh_running_path(r, FLESH_CHECKPOINT_NAME));
  return status;
}
