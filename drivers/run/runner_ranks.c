/* runner_ranks.c: a run on several ranks: each steps its part, and the first observes the whole. */
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "mesh/mesh.h"
#include "parallel/rank_part.h"
#include "run/running.h"
#include "run/start.h"
#include "system/state.h"

int flesh_running_share(flesh_running *r)
{
  const flesh_ranks *ranks = r->options->ranks;
  const flesh_system *system = flesh_scene_system(r->scene), *part = flesh_ranks_system(ranks, r->scene);
  const int gathers = flesh_ranks_first(ranks) && !flesh_running_is_split(r);
  const size_t tets = gathers ? (size_t)flesh_mesh_tet_count(flesh_scene_mesh(r->scene)) : 0;
  int status = flesh_state_make(flesh_system_unknowns(part) / 3, flesh_system_multiplier_count(part),
                                flesh_system_internal_count(system) /* every rank has all of them */, &r->own);
  if (!status) status = flesh_state_make(gathers ? flesh_system_unknowns(system) / 3 : 0, 0, 0, &r->stage);
  r->J_mean = malloc(2 * tets * sizeof(double) + 1);
  if (status || !r->J_mean) return flesh_no_memory();
  r->J_min = r->J_mean + tets;
  flesh_scene_share_start(ranks->share, &r->own);
  return flesh_ranks_first(ranks) ? flesh_proximity_create(system, NULL, &r->proximity) : FLESH_OK;
}

/* Keeps nodes of no tet at rest, as a run without ranks does; they belong to no rank. */
static void hold_unused(const flesh_mesh *mesh, flesh_state *state)
{
  const uint8_t *used = flesh_mesh_node_used(mesh);
  for (int d = 0; d < 3 * flesh_mesh_node_count(mesh); d++)
    if (!used[d / 3]) state->x[d] = flesh_mesh_positions(mesh)[d], state->v[d] = 0;
}

int flesh_running_open_parts(flesh_running *r)
{
  const flesh_ranks *ranks = r->options->ranks;
  const int every = flesh_scene_outputs(r->scene)->frame_interval;
  const flesh_rank_part *part = flesh_scene_share_part(ranks->share);
  if (!r->options->out) return FLESH_OK;
  int status = flesh_running_open_probes(r);
  if (status || !flesh_running_is_split(r) || r->options->no_frames || every < 1) return status;
  const flesh_checkpoint *from = r->options->resume;
  const char *folder = flesh_running_path(r, "frames");
  const flesh_mesh *mesh = flesh_rank_part_mesh(part);
  const flesh_team *team = flesh_rank_part_team(part);
  status = flesh_part_frames_create(folder, mesh, team, ranks->rank, ranks->count, every, &r->part_frames);
  if (!status && from) status = flesh_part_frames_resume(&r->part_frames, from->head.step);
  status = flesh_ranks_agree(ranks, status);
  return status ? status
                : flesh_running_set_fields(r, r->part_frames, flesh_scene_share_body(ranks->share),
                                           flesh_ranks_system(ranks, r->scene));
}

/* A rank's part of a state that is written to a file. */
typedef struct part_rows {
  const flesh_team *team;
  const flesh_state *state;
  int next; /* index of the next own node; the own nodes' numbers rise */
} part_rows;

enum { ROWS = 16384 }; /* number of nodes that are collected at a time */

/* Collects the nodes with numbers from `first` to before `end` of the whole on all ranks: x [3*ROWS], then v. */
static void find_rows(part_rows *p, int first, int end, double *rows)
{
  memset(rows, 0, 6 * (size_t)ROWS * sizeof *rows);
  for (; p->next < p->team->own && p->team->numbers[p->next] < end; p->next++) {
    const size_t from = 3 * (size_t)p->next, to = 3 * (size_t)(p->team->numbers[p->next] - first);
    memcpy(rows + to, p->state->x + from, 3 * sizeof *rows);
    memcpy(rows + 3 * (size_t)ROWS + to, p->state->v + from, 3 * sizeof *rows);
  }
  flesh_team_sum(p->team, 6 * ROWS, rows);
}

static int write_state(const flesh_running *r, const char *path, double *rows)
{
  const flesh_ranks *ranks = r->options->ranks;
  const int first = flesh_ranks_first(ranks), nodes = ranks->whole.nodes;
  part_rows p = {.team = flesh_rank_part_team(flesh_scene_share_part(ranks->share)), .state = &r->own};
  flesh_file file = {0};
  int status = flesh_ranks_agree(ranks, first ? flesh_file_open(path, &file) : FLESH_OK);
  if (status) return status;
  if (first) flesh_state_write_head(&file, r->own.t);
  for (int from = 0; from < nodes; from += ROWS) {
    const int end = nodes - from < ROWS ? nodes : from + ROWS;
    find_rows(&p, from, end, rows);
    if (first) flesh_state_write_rows(&file, end - from, rows, rows + 3 * (size_t)ROWS);
  }
  return flesh_ranks_agree(ranks, first ? flesh_file_commit(&file) : FLESH_OK);
}

int flesh_running_keep_parts(flesh_running *r)
{
  const flesh_ranks *ranks = r->options->ranks;
  const flesh_runner_options *options = r->options;
  double *rows = malloc(6 * (size_t)ROWS * sizeof *rows), sum = 0;
  int status = rows ? FLESH_OK : flesh_no_memory();
  for (int d = 0; d < flesh_system_unknowns(flesh_running_system(r)); d++) sum += 0 * r->own.x[d] + 0 * r->own.v[d];
  if (!status && sum != 0)
    status = flesh_fail(FLESH_ERR_NONFINITE, "%s: not written: the state is not finite", options->out ? "state.txt" : "state");
  if (!status && r->checkpoint.on) status = flesh_running_sync_parts(r); /* before the checkpoint is removed */
  status = flesh_ranks_agree(ranks, status);
  if (!status && options->out) status = write_state(r, flesh_running_path(r, "state.txt"), rows);
  if (!status && options->save_state) status = write_state(r, options->save_state, rows);
  free(rows);
  return status;
}

int flesh_running_sync_parts(flesh_running *r)
{
  return r->part_frames ? flesh_part_frames_sync(r->part_frames, r->checkpoint.step) : FLESH_OK;
}

/* Observes a step of a split mesh: each rank writes its own frames, and the first rank's observers see sums over all
 * ranks. */
static int observe_parts(flesh_running *r, const flesh_step_record *record)
{
  int status = r->part_frames ? flesh_frames_observe(r->part_frames, record) : FLESH_OK;
  r->state.t = record->state->t;
  for (int o = 0; o < r->observer_count && status >= 0; o++)
    status = r->observers[o].observe(r->observers[o].data, record);
  return status;
}

int flesh_running_begin_whole(flesh_running *r)
{
  int changed;
  const int status = flesh_proximity_follow(&r->proximity, 0, r->state.t, r->state.x, &changed);
  return status > 0 ? FLESH_OK : status; /* the writers report positions that are not finite */
}

/* Calls the first rank's observers with the gathered state. */
static int observe_gathered(flesh_running *r, const flesh_step_record *record)
{
  const flesh_mesh *mesh = flesh_scene_mesh(r->scene);
  flesh_step_record whole = *record;
  for (int k = 0; k < r->own.internal_count; k++) r->state.internal[k] = r->own.internal[k];
  int changed;
  if (record->step) hold_unused(mesh, &r->state);
  if (record->stage != record->state) hold_unused(mesh, &r->stage);
  flesh_mesh_mean_jacobians(mesh, r->state.x, r->J_mean);
  flesh_mesh_jacobians(mesh, r->state.x, r->J_min, NULL, NULL);
  whole.system = flesh_scene_system(r->scene);
  whole.state = &r->state;
  whole.stage = record->stage == record->state ? &r->state : &r->stage;
  whole.tet_J_mean = r->J_mean;
  whole.tet_J_min = r->J_min;
  whole.proximity = &r->proximity;
  int status = flesh_proximity_follow(&r->proximity, record->step > 0, r->state.t, r->state.x, &changed);
  if (status > 0) status = FLESH_OK;
  for (int o = 0; o < r->observer_count && status >= 0; o++)
    status = r->observers[o].observe(r->observers[o].data, &whole);
  return status;
}

static void gather(const flesh_ranks *ranks, const flesh_state *part, flesh_state *whole)
{
  whole->t = part->t;
  flesh_gather_vector(ranks->gather, part->x, whole->x);
  flesh_gather_vector(ranks->gather, part->v, whole->v);
}

static int observe_whole(flesh_running *r, const flesh_step_record *record)
{
  const flesh_ranks *ranks = r->options->ranks;
  gather(ranks, record->state, &r->state);
  if (record->stage != record->state) gather(ranks, record->stage, &r->stage);
  if (r->own.multiplier_count) flesh_gather_numbers(ranks->tets, r->own.multipliers, r->state.multipliers);
  return flesh_ranks_first(ranks) ? observe_gathered(r, record) : FLESH_OK;
}

int flesh_running_observe_ranks(void *data, const flesh_step_record *record)
{
  flesh_running *r = data;
  const int status = flesh_running_is_split(r) ? observe_parts(r, record) : observe_whole(r, record);
  const int probed = r->probes ? flesh_probes_observe(r->probes, record) : FLESH_OK;
  return status < 0 ? status : probed; /* all ranks of the run return the same status */
}
