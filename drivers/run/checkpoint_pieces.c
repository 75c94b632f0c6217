/* checkpoint_pieces.c: packs pieces of a checkpoint into bytes, and unpacks them. A piece has the numbers of its nodes,
 * its own ones first, and of its tets if these have multipliers, then the state there, then what the integrator
 * remembers. */
#include <stdlib.h>
#include <string.h>

#include "base/archive.h"
#include "base/error.h"
#include "base/rising.h"
#include "parallel/rank_part.h"
#include "run/checkpoint.h"
#include "time/integrator.h"

/* The nodes and tets of a piece; if the numbers are NULL, all of the whole in order. Tets count only if they have
 * multipliers. */
typedef struct piece_parts {
  int nodes, own, tets;
  int *node_numbers, *tet_numbers; /* numbers in the whole; new if the piece was read */
} piece_parts;

/* Describes this piece; the numbers that it borrows are only read. On a split mesh, too, they number the whole. */
static piece_parts parts_of(const flesh_checkpoint_piece *piece)
{
  const flesh_team *team = piece->part ? flesh_rank_part_team(piece->part) : NULL;
  return (piece_parts){piece->nodes, team ? team->own : piece->nodes, piece->state->multiplier_count,
                       team ? (int *)team->numbers : NULL, team ? (int *)team->tets : NULL};
}

static int fail_for_memory(void) { return flesh_fail(FLESH_ERR_MEMORY, "no memory for a checkpoint's piece"); }

/* Archives [count] numbers; numbers that are loaded are new. */
static int archive_numbers(int count, int **numbers, flesh_archive *archive)
{
  const size_t bytes = (size_t)count * sizeof **numbers;
  const int loads = archive->mode == FLESH_ARCHIVE_LOAD;
  if (loads && bytes > archive->size) archive->wrong = 1;
  if (loads && !archive->wrong && !(*numbers = malloc(bytes + 1))) return fail_for_memory();
  if (!archive->wrong) flesh_archive_bytes(archive, *numbers, bytes);
  return FLESH_OK;
}

static int archive_parts(piece_parts *parts, flesh_archive *archive)
{
  int numbered = parts->node_numbers != NULL;
  flesh_archive_int(archive, &parts->nodes, 0, 0x7ffffff0);
  flesh_archive_int(archive, &parts->own, 0, parts->nodes);
  flesh_archive_int(archive, &parts->tets, 0, 0x7ffffff0);
  flesh_archive_int(archive, &numbered, 0, 1);
  if (archive->wrong || !numbered) return FLESH_OK;
  const int status = archive_numbers(parts->nodes, &parts->node_numbers, archive);
  return status ? status : archive_numbers(parts->tets, &parts->tet_numbers, archive);
}

static void archive_state(const flesh_checkpoint_piece *piece, flesh_archive *archive)
{
  flesh_state *state = piece->state;
  FLESH_ARCHIVE(archive, state->t);
  flesh_archive_nodes(archive, state->x, (size_t)piece->nodes);
  flesh_archive_nodes(archive, state->v, (size_t)piece->nodes);
  flesh_archive_tets(archive, state->multipliers, (size_t)state->multiplier_count);
  flesh_archive_bytes(archive, state->internal, (size_t)state->internal_count * sizeof(double));
}

/* Archives a piece without the integrator's bytes, whose number is *size. */
static int archive_head(const flesh_checkpoint_piece *piece, piece_parts *parts, size_t *size, flesh_archive *archive)
{
  const int status = archive_parts(parts, archive);
  if (status || archive->wrong) return status;
  archive_state(piece, archive);
  FLESH_ARCHIVE(archive, *size);
  return FLESH_OK;
}

int flesh_checkpoint_pack(const flesh_checkpoint_piece *piece, uint8_t **bytes, size_t *size)
{
  piece_parts parts = parts_of(piece);
  flesh_archive archive = {.mode = FLESH_ARCHIVE_MEASURE};
  size_t saved = 0;
  *bytes = NULL;
  int status = flesh_integrator_save(piece->integrator, 0, NULL, &saved);
  if (!status) status = archive_head(piece, &parts, &saved, &archive);
  if (status) return status;
  *size = (archive.at + saved + 7) / 8 * 8;
  if (!(*bytes = calloc(*size + 1, 1))) return fail_for_memory();
  archive = (flesh_archive){.mode = FLESH_ARCHIVE_SAVE, .data = *bytes, .size = *size};
  status = archive_head(piece, &parts, &saved, &archive);
  return status ? status : flesh_integrator_save(piece->integrator, *size - archive.at, *bytes + archive.at, &saved);
}

/* A piece that was read. */
typedef struct piece_bytes {
  uint8_t *bytes;
  flesh_archive archive; /* positioned behind the parts */
  piece_parts parts;
} piece_bytes;

static void close_piece(piece_bytes *read)
{
  free(read->bytes);
  free(read->parts.node_numbers);
  free(read->parts.tet_numbers);
}

static int open_piece(const flesh_checkpoint *checkpoint, int k, piece_bytes *read)
{
  size_t size = 0;
  *read = (piece_bytes){0};
  int status = flesh_checkpoint_read_piece(checkpoint, k, &read->bytes, &size);
  read->archive = (flesh_archive){.mode = FLESH_ARCHIVE_LOAD, .data = read->bytes, .size = size};
  if (!status) status = archive_parts(&read->parts, &read->archive);
  return status || !read->archive.wrong ? status : flesh_checkpoint_refuse(checkpoint);
}

static int same_numbers(int count, const int *a, const int *b)
{
  return !a == !b && (!a || !count || !memcmp(a, b, (size_t)count * sizeof *a));
}

int flesh_checkpoint_fits(const flesh_checkpoint *checkpoint, int rank, int ranks, const flesh_checkpoint_piece *piece,
                          int *fits)
{
  piece_bytes read;
  *fits = 0;
  if (ranks != checkpoint->head.pieces) return FLESH_OK;
  const int status = open_piece(checkpoint, rank, &read);
  const piece_parts *from = &read.parts, here = parts_of(piece);
  *fits = !status && from->nodes == here.nodes && from->own == here.own && from->tets == here.tets &&
          same_numbers(here.nodes, from->node_numbers, here.node_numbers) &&
          same_numbers(here.tets, from->tet_numbers, here.tet_numbers);
  close_piece(&read);
  return status;
}

/* Finds the indices in this piece of the own nodes and of the tets of the piece that was read; its shared nodes are
 * left to their owner. *places is new and holds both. */
static int find_places(const piece_parts *from, const flesh_checkpoint_piece *piece, int **places,
                       flesh_archive_others *others)
{
  const flesh_rank_part *part = piece->part;
  const piece_parts here = parts_of(piece);
  int *nodes = *places = malloc(((size_t)from->nodes + (size_t)from->tets + 1) * sizeof **places), *tets = nodes + from->nodes;
  if (!nodes) return fail_for_memory();
  for (int i = 0; i < from->nodes; i++) {
    const int number = from->node_numbers ? from->node_numbers[i] : i;
    nodes[i] = i >= from->own ? -1 : part ? flesh_rank_part_find_number(part, number) : number;
  }
  for (int t = 0; t < from->tets; t++) {
    const int number = from->tet_numbers ? from->tet_numbers[t] : t;
    tets[t] = part ? flesh_rising_find(here.tet_numbers, 0, here.tets, number) : number;
  }
  *others = (flesh_archive_others){from->nodes, from->tets, nodes, tets};
  return FLESH_OK;
}

/* Takes over piece k: all of it if it is this rank's `own`, else the data of this rank's nodes. */
static int take(const flesh_checkpoint *checkpoint, int k, int own, const flesh_checkpoint_piece *piece)
{
  piece_bytes read;
  flesh_archive_others others;
  size_t saved = 0;
  int *places = NULL, status = open_piece(checkpoint, k, &read);
  flesh_archive *archive = &read.archive;
  if (!status && !own) {
    status = find_places(&read.parts, piece, &places, &others);
    archive->others = &others;
  }
  if (!status) {
    archive_state(piece, archive);
    FLESH_ARCHIVE(archive, saved);
    if (archive->wrong || saved > archive->size - archive->at) status = flesh_checkpoint_refuse(checkpoint);
  }
  if (!status && piece->integrator && own)
    status = flesh_integrator_load(piece->integrator, archive->data + archive->at, saved);
  else if (!status && piece->integrator)
    status = flesh_integrator_take(piece->integrator, archive->data + archive->at, saved, &others);
  free(places);
  close_piece(&read);
  return status;
}

int flesh_checkpoint_unpack(const flesh_checkpoint *checkpoint, int rank, const flesh_checkpoint_piece *piece)
{
  int status = FLESH_OK;
  if (rank >= 0) return take(checkpoint, rank, 1, piece);
  /* For data that belong to no node, the last piece that is taken decides: the first rank's, as in result.json. */
  for (int k = checkpoint->head.pieces - 1; k >= 0 && !status; k--) status = take(checkpoint, k, 0, piece);
  return status;
}
