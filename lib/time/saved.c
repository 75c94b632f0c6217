/* saved.c: writes an integrator's history to bytes and reads it back: a header that identifies it, and an archive of
 * its members. */
#include <stdio.h>
#include <string.h>

#include "base/archive.h"
#include "base/error.h"
#include "effect/effect.h"
#include "flesh/version.h"
#include "time/integrator.h"

static const char mark[8] = "fleshint";
enum { FORMAT = 23, ORDER = 0x01020304 };

typedef struct header {
  char mark[8];
  uint32_t order, format; /* order of bytes; format of the archive */
  uint32_t sizes;         /* sizes of a double, a long, an int and an address, 8 bits each */
  int32_t method;
  char version[16], instructions[16];
  int32_t unknowns, tets, effects, multipliers, internals, unused; /* no padding, as all is summed up */
  uint64_t body, solver; /* hashes: mesh and effects' names; layout of the solver's memory */
  uint64_t bytes, sum;   /* length of what follows; hash of all, with this as 0 */
} header;

/* Returns a hash of the mesh and the effects. */
static uint64_t sum_of_body(const flesh_system *system)
{
  const flesh_mesh *mesh = flesh_system_mesh(system);
  const size_t tets = (size_t)flesh_mesh_tet_count(mesh);
  const int *edges = flesh_mesh_tet_edges(mesh);
  uint64_t sum = flesh_archive_sum(0, flesh_mesh_positions(mesh), (size_t)flesh_system_unknowns(system) * sizeof(double));
  sum = flesh_archive_sum(sum, flesh_mesh_tets(mesh), 4 * tets * sizeof(int));
  if (edges) sum = flesh_archive_sum(sum, edges, 6 * tets * sizeof(int));
  for (int e = 0; e < flesh_system_effect_count(system); e++) {
    const char *name = flesh_system_effect(system, e)->operations->name;
    sum = flesh_archive_sum(sum, name, strlen(name));
  }
  return sum;
}

static uint64_t sum_of_solver(const flesh_solver_options *options)
{
  const int kinds[] = {(int)options->linear_solver, (int)options->preconditioner, (int)options->line_search,
                       (int)options->techniques};
  return flesh_archive_sum(0, kinds, sizeof kinds);
}

static header header_of(const flesh_integrator *self, size_t bytes)
{
  header h = {.order = ORDER, .format = FORMAT, .method = (int32_t)self->memory.method, .unknowns = self->evaluation->n,
              .sizes = sizeof(double) << 24 | sizeof(long) << 16 | sizeof(int) << 8 | sizeof(void *),
              .tets = flesh_mesh_tet_count(flesh_system_mesh(self->evaluation->system)),
              .effects = flesh_system_effect_count(self->evaluation->system),
              .multipliers = flesh_system_multiplier_count(self->evaluation->system), .internals = self->internals.count,
              .body = sum_of_body(self->evaluation->system), .solver = sum_of_solver(&self->options), .bytes = bytes};
  memcpy(h.mark, mark, sizeof mark);
  snprintf(h.version, sizeof h.version, "%s", flesh_version());
  snprintf(h.instructions, sizeof h.instructions, "%s",
           flesh_instructions_name(flesh_system_instructions(self->evaluation->system)));
  return h;
}

static void archive_method(flesh_integrator *self, flesh_archive *archive)
{
  const size_t nodes = (size_t)self->evaluation->n / 3;
  flesh_method_memory *memory = &self->memory;
  FLESH_ARCHIVE(archive, memory->known);
  FLESH_ARCHIVE(archive, memory->serial);
  FLESH_ARCHIVE(archive, memory->h);
  FLESH_ARCHIVE(archive, memory->easy);
  FLESH_ARCHIVE(archive, memory->before);
  const int remembered = self->row->remembered ? self->row->remembered : self->row->vectors;
  for (int k = 0; k < remembered; k++) flesh_archive_nodes(archive, memory->vectors[k], nodes);
  if (!self->last_stage.at.x) return;
  FLESH_ARCHIVE(archive, self->last_stage.known);
  if (!self->last_stage.known) return;
  FLESH_ARCHIVE(archive, self->last_stage.at.t);
  flesh_archive_nodes(archive, self->last_stage.at.x, nodes);
  flesh_archive_nodes(archive, self->last_stage.at.v, nodes);
}

/* Archives the body's motion, which does not depend on how many ranks share the body out: numbers of nodes, and numbers
 * that are the same on all ranks. */
static void archive_motion(flesh_integrator *self, flesh_archive *archive)
{
  const size_t effects = (size_t)flesh_system_effect_count(self->evaluation->system);
  flesh_evaluation_archive(self->evaluation, archive);
  archive_method(self, archive);
  if (self->first.extrapolation.n) flesh_extrapolation_archive(&self->first.extrapolation, archive);
  flesh_energy_watch_archive(&self->watch, archive);
  flesh_multipliers_archive(&self->multipliers, archive);
  flesh_internals_archive(&self->internals, archive);
  FLESH_ARCHIVE(archive, self->recovery.tangled);
  FLESH_ARCHIVE(archive, self->recovery.in_vain);
  FLESH_ARCHIVE(archive, self->recovery.failure);
  FLESH_ARCHIVE(archive, self->residual_last);
  FLESH_ARCHIVE(archive, self->residual_target);
  flesh_archive_bytes(archive, self->costs.effects, effects * sizeof *self->costs.effects);
  flesh_error_control_archive(&self->control, archive);
  flesh_ahead_archive(&self->ahead, self->evaluation->n, archive);
  if (self->ida) flesh_ida_steps_archive(self->ida, archive);
}

/* Archives all but what every step sets anew; the motion comes first, as flesh_integrator_take reads no further. */
static int archive_all(flesh_integrator *self, flesh_archive *archive)
{
  archive_motion(self, archive);
  if (self->recovery.untangler) flesh_untangler_archive(self->recovery.untangler, archive);
  return flesh_nonlinear_archive(self->nonlinear, archive);
}

int flesh_integrator_save(const flesh_integrator *integrator, size_t room, void *data, size_t *size)
{
  FLESH_NEED({integrator, "integrator"}, {size, "size"});
  flesh_integrator *self = (flesh_integrator *)integrator; /* saving changes nothing */
  flesh_archive archive = {.mode = FLESH_ARCHIVE_MEASURE};
  int status = archive_all(self, &archive);
  const size_t bytes = archive.at;
  *size = sizeof(header) + bytes;
  if (status || !data) return status;
  if (room < *size)
    return flesh_fail(FLESH_ERR_ARGUMENT, "there is room for %zu bytes; the integrator's history takes %zu", room, *size);
  archive = (flesh_archive){.mode = FLESH_ARCHIVE_SAVE, .data = (uint8_t *)data + sizeof(header), .size = bytes};
  status = archive_all(self, &archive);
  header h = header_of(self, bytes);
  h.sum = flesh_archive_sum(flesh_archive_sum(0, &h, sizeof h), archive.data, bytes);
  memcpy(data, &h, sizeof h);
  return status;
}

/* Returns whether the bytes are complete. */
static int check_bytes(const header *h, const uint8_t *data, size_t size)
{
  header summed = *h;
  summed.sum = 0;
  if (h->bytes != size - sizeof *h)
    return flesh_fail(FLESH_ERR_FILE, "the saved history of an integrator has %zu bytes; it must have %llu", size,
                      (unsigned long long)h->bytes + sizeof *h);
  if (flesh_archive_sum(flesh_archive_sum(0, &summed, sizeof summed), data + sizeof *h, size - sizeof *h) != h->sum)
    return flesh_fail(FLESH_ERR_FILE, "the saved history of an integrator is damaged: its bytes do not have its checksum");
  return FLESH_OK;
}

static int check_method(const header *h, const header *own)
{
  if (h->method == own->method) return FLESH_OK;
  const char *name = flesh_method_name((flesh_method)h->method);
  return flesh_fail(FLESH_ERR_ARGUMENT, "the history was saved by method %s; this integrator's is %s",
                    name ? name : "(unknown)", flesh_method_name((flesh_method)own->method));
}

/* Returns whether the bytes are of such an integrator. */
static int check_kind(const header *h, const header *own)
{
  if (check_method(h, own)) return FLESH_ERR_ARGUMENT;
  if (h->unknowns != own->unknowns || h->tets != own->tets || h->effects != own->effects ||
      h->multipliers != own->multipliers)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "the history is of %d unknowns, %d tets, %d effects and %d multipliers; this system has %d, %d, %d "
                      "and %d",
                      h->unknowns, h->tets, h->effects, h->multipliers, own->unknowns, own->tets, own->effects,
                      own->multipliers);
  if (h->internals != own->internals)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the history is of %d internal variables; this system has %d", h->internals,
                      own->internals);
  if (h->body != own->body)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the history is of another mesh or other effects than this system has");
  if (h->solver != own->solver)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the history was saved with another linear_solver, preconditioner, line_search "
                                          "or other techniques");
  if (memcmp(h->instructions, own->instructions, sizeof h->instructions))
    return flesh_fail(FLESH_ERR_ARGUMENT, "the history was saved with instructions %.16s; this system has %.16s",
                      h->instructions, own->instructions);
  return FLESH_OK;
}

/* Reads the header of bytes that are complete and of this version. */
static int read_header(const void *data, size_t size, const header *own, header *h)
{
  *h = (header){0};
  if (size >= sizeof *h) memcpy(h, data, sizeof *h);
  if (memcmp(h->mark, mark, sizeof mark))
    return flesh_fail(FLESH_ERR_FILE, "these %zu bytes are no saved history of an integrator", size);
  if (h->order != own->order || h->sizes != own->sizes)
    return flesh_fail(FLESH_ERR_FILE, "the history was saved on a machine with other numbers or another order of bytes");
  if (h->format != own->format || memcmp(h->version, own->version, sizeof h->version))
    return flesh_fail(FLESH_ERR_FILE, "the history was saved by version %.16s (format %u) of the library; this is %s "
                                      "(format %u), which goes on from its own only",
                      h->version, h->format, own->version, own->format);
  return check_bytes(h, data, size);
}

static int fail_unfit(void)
{
  return flesh_fail(FLESH_ERR_FILE, "the saved history does not fit this integrator, which is lost: other options made it");
}

int flesh_integrator_load(flesh_integrator *self, const void *data, size_t size)
{
  FLESH_NEED({self, "integrator"}, {data, "data"});
  header h, own = header_of(self, 0);
  int status = read_header(data, size, &own, &h);
  if (!status) status = check_kind(&h, &own);
  if (status) return status;
  flesh_archive archive = {.mode = FLESH_ARCHIVE_LOAD, .data = (uint8_t *)data + sizeof h, .size = size - sizeof h};
  status = archive_all(self, &archive);
  return status || (!archive.wrong && archive.at == archive.size) ? status : fail_unfit();
}

int flesh_integrator_take(flesh_integrator *self, const void *data, size_t size, const flesh_archive_others *others)
{
  header h, own = header_of(self, 0);
  int status = read_header(data, size, &own, &h);
  if (!status) status = check_method(&h, &own);
  if (status) return status;
  flesh_archive archive = {.mode = FLESH_ARCHIVE_LOAD, .data = (uint8_t *)data + sizeof h, .size = size - sizeof h,
                           .others = others};
  archive_motion(self, &archive);
  return archive.wrong ? fail_unfit() : FLESH_OK;
}

int flesh_integrator_saves_all(const flesh_integrator *self)
{
  return self && !(self->ida && self->ida->running);
}
