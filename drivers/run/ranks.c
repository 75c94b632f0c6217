/* ranks.c: what a run needs to know of the ranks that share its scene, and to do with them. */
#include "parallel/rank_part.h"
#include "run/ranks.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

#include "base/error.h"
#include "base/threads.h"
#include "linear/preconditioner.h"
#include "mesh/mesh.h"
#include "mesh/split_part.h"
#include "parallel/communicator.h"
#include "system/inertia_modulus.h"
#include "system/ranks.h"
#include "system/stiff_rows.h"
#include "time/method.h"

/* Returns whether the environment variables of a launcher announce several ranks: Open MPI, PMI (MPICH, Intel MPI),
 * MVAPICH, or Slurm with PMIx. */
static int launched(void)
{
  static const char *const sizes[] = {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MV2_COMM_WORLD_SIZE"};
  for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
    const char *size = getenv(sizes[k]);
    if (size && atoi(size) > 1) return 1;
  }
  const char *tasks = getenv("SLURM_STEP_NUM_TASKS");
  return getenv("PMIX_RANK") && tasks && atoi(tasks) > 1;
}

static int forgotten;

void flesh_ranks_forget(void) { forgotten = 1; }

int flesh_ranks_open(flesh_ranks **ranks)
{
  *ranks = NULL;
  if (forgotten || !launched()) return FLESH_OK;
  flesh_ranks *self = calloc(1, sizeof *self);
  if (!self) return flesh_no_memory();
  int status = flesh_ranks_join(&self->communicator, &self->neighbours_here);
  if (!status) {
    self->working = self->communicator;
    self->rank = flesh_communicator_rank(self->communicator);
    self->count = self->all = flesh_communicator_size(self->communicator);
  }
  *ranks = self;
  if (status || self->count == 1) flesh_ranks_close(ranks);
  return status;
}

void flesh_ranks_close(flesh_ranks **ranks)
{
  if (!ranks || !*ranks) return;
  flesh_ranks *self = *ranks;
  flesh_gather_destroy(&self->gather);
  flesh_gather_destroy(&self->tets);
  flesh_scene_share_destroy(&self->share);
  if (self->working != self->communicator) flesh_communicator_destroy(&self->working);
  fflush(NULL); /* a launcher may end all ranks once the first has left */
  flesh_ranks_leave(&self->communicator);
  free(self);
  *ranks = NULL;
}

int flesh_ranks_first(const flesh_ranks *ranks) { return !ranks || ranks->rank == 0; }

int flesh_ranks_agree(const flesh_ranks *ranks, int status)
{
  return ranks ? flesh_communicator_agree(ranks->working, status) : status;
}

int flesh_ranks_same(const flesh_ranks *ranks, uint64_t number, const char *what)
{
  enum { PIECES = 4 };
  int own[PIECES], first[PIECES];
  if (!ranks) return FLESH_OK;
  for (int k = 0; k < PIECES; k++) own[k] = first[k] = (int)(number >> 16 * k & 0xffff);
  flesh_communicator_spread(ranks->communicator, PIECES, first);
  const int status = !memcmp(own, first, sizeof own)
                         ? FLESH_OK
                         : flesh_fail(FLESH_ERR_ARGUMENT,
                                      "rank %d has %s than the first rank; all ranks must be given the same options, scene "
                                      "and files", ranks->rank, what);
  return flesh_communicator_agree(ranks->communicator, status);
}

int flesh_ranks_fail(const flesh_ranks *ranks, const char *name, int status)
{
  return flesh_ranks_first(ranks) ? flesh_command_fail(name, status) : flesh_exit_code(status);
}

int flesh_ranks_refuse(const char *name)
{
  flesh_ranks *ranks;
  int status = flesh_ranks_open(&ranks);
  if (!status && ranks)
    status = flesh_fail(FLESH_ERR_ARGUMENT, "a launcher of MPI has started %d ranks, which cannot share this out; start it "
                                            "without the launcher", ranks->count);
  const int code = status ? flesh_ranks_fail(ranks, name, status) : 0;
  flesh_ranks_close(&ranks);
  return code;
}

int flesh_ranks_read_options(const flesh_ranks *ranks, const flesh_usage *usage, int argc, char **argv, int *count,
                             int (*check)(void *data, int count), void *data)
{
  int code = FLESH_OPTIONS_GO_ON;
  for (int others = 0; others < (ranks ? 2 : 1) && code == FLESH_OPTIONS_GO_ON; others++) {
    if (flesh_ranks_first(ranks) == !others) {
      code = flesh_options_read(usage, argc, argv, count);
      if (code == FLESH_OPTIONS_GO_ON && check) code = check(data, *count);
    }
    code = flesh_ranks_largest(ranks, code);
  }
  return code;
}

int flesh_ranks_broadcast(const flesh_ranks *ranks, int number)
{
  if (ranks) flesh_communicator_spread(ranks->working, 1, &number);
  return number;
}

int flesh_ranks_largest(const flesh_ranks *ranks, int number)
{
  double largest = number;
  if (ranks) flesh_communicator_largest(ranks->working, 1, &largest);
  return (int)largest;
}

/* Limits the ranks that work so that each has at least one tet. */
static int choose_workers(flesh_ranks *self, int tets)
{
  if (self->count <= tets) return FLESH_OK;
  flesh_communicator *workers = NULL;
  const int status = flesh_communicator_agree(self->communicator, flesh_ranks_split(self->rank < tets, &workers));
  self->working = workers;
  self->count = tets;
  return status;
}

/* Computes the figures of a split mesh as a whole, by sums over the ranks' own tets. */
static void measure_whole(flesh_ranks *self, const flesh_mesh *mesh)
{
  const flesh_split_part *split = mesh->split;
  double sums[2] = {0, 0};
  for (int t = 0; t < mesh->tets; t++)
    if (split->owners[t] == split->part) sums[0] += mesh->volumes[t];
  for (int k = 0; k < mesh->triangles; k++) sums[1] += split->owners[mesh->surface_tets[k]] == split->part;
  flesh_communicator_sum(self->communicator, 2, sums);
  self->whole = (flesh_mesh_info){.nodes = split->whole_nodes, .tets = split->whole_tets, .volume = sums[0],
                                  .triangles = (int)sums[1], .order = flesh_mesh_order(mesh)};
}

/* Fails unless all ranks have read the same scene; each computes everything else from it. */
static int agree_on_scene(const flesh_ranks *self, const flesh_scene *scene)
{
  flesh_scene_sums sums = {0};
  int status = flesh_communicator_agree(self->communicator, flesh_scene_sum(scene, &sums));
  if (!status) status = flesh_ranks_same(self, sums.keys, "another scene");
  if (!status) status = flesh_ranks_same(self, sums.mesh, "another mesh");
  if (!status) status = flesh_ranks_same(self, sums.start, "another start");
  return status ? status : flesh_ranks_same(self, sums.files, "another file that the scene names");
}

/* Returns whether stiff volume terms are taken out of the system's solves, in steps of the length that the scene asks
 * for. Collective if the system belongs to a rank. */
static int takes_volumes_out(const flesh_scene *scene, const flesh_system *system)
{
  const flesh_scene_time *time = flesh_scene_times(scene);
  const flesh_method_row *method = flesh_method_find(time->method);
  const size_t n = (size_t)flesh_system_unknowns(system);
  double *room = malloc((2 * n + 1) * sizeof *room);
  flesh_stiff_rows rows = {0};
  flesh_stage stage = {.shift = {.x = 1}};
  int projects = 0;
  int status = flesh_system_stiff_rows_create(system, &rows);
  status = flesh_team_agree(flesh_system_team(system), room ? status : FLESH_ERR_MEMORY);
  if (!status) flesh_system_stiff_rows_unite(system, &rows);
  if (!status && method && method->stage) {
    const flesh_method_memory of_no_nodes = {.options = time->options};
    method->stage(&of_no_nodes, &(flesh_state){0}, time->step, time->step, &stage);
    const double inertia = rows.nodes_per_row ? flesh_system_inertia_modulus(system, room, room + n) : 0;
    projects = flesh_preconditioner_projects(flesh_scene_solver(scene)->preconditioner, &rows,
                                             inertia * stage.shift.a / stage.shift.x);
  }
  flesh_system_stiff_rows_clear(&rows);
  free(room);
  return projects;
}

int flesh_ranks_share(flesh_ranks *self, const flesh_scene *scene)
{
  const int split = flesh_scene_mesh(scene)->split != NULL;
  int status = agree_on_scene(self, scene);
  if (!status && !split) status = choose_workers(self, flesh_mesh_tet_count(flesh_scene_mesh(scene)));
  if (!status && self->working) {
    status = flesh_scene_share_create(scene, self->working, &self->share);
    if (!status && split) measure_whole(self, flesh_scene_mesh(scene));
    else if (!status) {
      status = flesh_gather_create(self->working, flesh_scene_share_part(self->share), &self->gather);
      if (!status) status = flesh_gather_create_tets(self->working, flesh_scene_share_part(self->share), &self->tets);
    }
    if (!status) self->takes_volumes_out = takes_volumes_out(scene, flesh_scene_share_system(self->share));
  }
  return flesh_communicator_agree(self->communicator, status);
}

const flesh_system *flesh_ranks_system(const flesh_ranks *ranks, const flesh_scene *scene)
{
  return ranks ? flesh_scene_share_system(ranks->share) : flesh_scene_system(scene);
}

const char *flesh_ranks_preconditioner(const flesh_ranks *ranks, const flesh_scene *scene)
{
  const flesh_solver_options *solver = flesh_scene_solver(scene);
  const flesh_mesh *mesh = flesh_scene_mesh(scene);
  if (solver->linear_solver != FLESH_LINEAR_PCG) return NULL;
  return flesh_preconditioner_name(
      (ranks ? ranks->takes_volumes_out : takes_volumes_out(scene, flesh_scene_system(scene)))
          ? FLESH_PRECONDITIONER_VOLUME_PROJECTION
          : flesh_preconditioner_choose(solver->preconditioner,
                                        mesh->split ? mesh->split->whole_nodes : flesh_mesh_node_count(mesh),
                                        flesh_mesh_order(mesh)));
}

int flesh_ranks_threads(const flesh_ranks *ranks, const flesh_scene *scene)
{
  const int given = flesh_scene_solver(scene)->threads, available = flesh_threads_available();
  if (given || !ranks) return given ? given : available;
  return available > ranks->neighbours_here ? available / ranks->neighbours_here : 1;
}

/* Sends one message from rank k to the first, in doubles. */
static void send(const flesh_ranks *ranks, int k, int count, const uint8_t *bytes, double *room)
{
  const int other = ranks->rank ? 0 : k, all[2] = {0, count}, none[2] = {0};
  const flesh_exchange message = {1, ranks->rank ? all : none, ranks->rank ? none : all, (const double *)bytes, room};
  flesh_communicator_begin(ranks->working, 1, &other, &message);
  flesh_communicator_end(ranks->working);
}

/* Sends the bytes of every rank to the first one, which takes them. The other ranks send even if an earlier one's bytes
 * could not be taken. */
static int take_all(const flesh_ranks *ranks, const double *sizes, const uint8_t *bytes, double *room,
                    int (*take)(void *data, size_t size, const uint8_t *bytes), void *data)
{
  const double own = sizes[ranks->rank];
  if (ranks->rank) {
    send(ranks, 0, (int)own, bytes, NULL);
    return FLESH_OK;
  }
  int status = take(data, (size_t)own * sizeof(double), bytes);
  for (int k = 1; k < ranks->count; k++) {
    send(ranks, k, (int)sizes[k], NULL, room);
    if (!status) status = take(data, (size_t)sizes[k] * sizeof(double), (const uint8_t *)room);
  }
  return status;
}

int flesh_ranks_gather_bytes(const flesh_ranks *ranks, size_t size, const uint8_t *bytes,
                          int (*take)(void *data, size_t size, const uint8_t *bytes), void *data)
{
  if (!ranks) return take(data, size, bytes);
  double *sizes = calloc((size_t)ranks->count, sizeof *sizes), largest = (double)(size / sizeof(double));
  flesh_communicator_largest(ranks->working, 1, &largest);
  double *room = ranks->rank ? NULL : malloc(((size_t)largest + 1) * sizeof *room);
  int status = sizes && (room || ranks->rank) ? FLESH_OK : flesh_no_memory();
  if (!status && largest > INT_MAX)
    status = flesh_fail(FLESH_ERR_ARGUMENT, "a rank has %.3g GB to send; at most 17 GB are possible", 8e-9 * largest);
  status = flesh_ranks_agree(ranks, status);
  if (!status) {
    sizes[ranks->rank] = (double)(size / sizeof(double));
    flesh_communicator_sum(ranks->working, ranks->count, sizes);
    status = flesh_ranks_agree(ranks, take_all(ranks, sizes, bytes, room, take, data));
  }
  free(sizes);
  free(room);
  return status;
}

/* Figures of each rank, in result.json. */
enum { NODES, OWN, TETS, NEIGHBOURS, MESSAGES, BYTES, REDUCTIONS, PEAK, NUMBERS };

static void describe(const flesh_ranks *ranks, double *row)
{
  const flesh_rank_part *part = flesh_scene_share_part(ranks->share);
  const flesh_communicator_figures exchanged = flesh_communicator_exchanged(ranks->working);
  struct rusage usage;
  row[NODES] = flesh_mesh_node_count(flesh_rank_part_mesh(part));
  row[OWN] = flesh_rank_part_own(part);
  row[TETS] = flesh_mesh_tet_count(flesh_rank_part_mesh(part));
  row[NEIGHBOURS] = flesh_rank_part_neighbours(part);
  row[MESSAGES] = (double)exchanged.messages;
  row[BYTES] = exchanged.bytes;
  row[REDUCTIONS] = (double)exchanged.reductions;
  row[PEAK] = getrusage(RUSAGE_SELF, &usage) ? 0 : (double)usage.ru_maxrss;
}

json_t *flesh_ranks_json(const flesh_ranks *ranks)
{
  static const char *const names[NUMBERS] = {"nodes",    "own_nodes", "tets",       "neighbours",
                                             "messages", "bytes",     "reductions", "peak_memory_kB"};
  double *rows = ranks && ranks->share ? calloc((size_t)ranks->count * NUMBERS, sizeof *rows) : NULL;
  if (ranks && flesh_ranks_agree(ranks, rows ? FLESH_OK : FLESH_ERR_MEMORY)) {
    free(rows);
    return NULL;
  }
  if (!rows) return NULL;
  describe(ranks, rows + (size_t)ranks->rank * NUMBERS);
  flesh_communicator_sum(ranks->working, ranks->count * NUMBERS, rows);
  json_t *parts = json_array();
  for (int k = 0; k < ranks->count; k++) {
    json_t *part = json_object();
    for (int c = 0; c < NUMBERS; c++)
      json_object_set_new(part, names[c], json_integer((json_int_t)rows[(size_t)k * NUMBERS + (size_t)c]));
    json_array_append_new(parts, part);
  }
  free(rows);
  if (!flesh_ranks_first(ranks)) {
    json_decref(parts);
    return NULL;
  }
  return json_pack("{siso}", "count", ranks->count, "parts", parts);
}
