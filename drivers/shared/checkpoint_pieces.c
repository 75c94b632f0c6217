/* checkpoint_pieces.c: pieces of a checkpoint as bytes and back. A piece says which nodes of the body it has, its own first,
 * then the state at these, then what the integrator remembers. */
#include <stdlib.h>
#include <string.h>

#include "base/archive.h"
#include "base/error.h"
#include "parallel/rank_part.h"
#include "shared/checkpoint.h"
#include "time/integrator.h"

/* The nodes that a piece has; numbers NULL: all of the whole, in order. */
typedef struct piece_nodes {
  int count, own;
  int *numbers; /* [count] in the whole; of a piece that was read new */
} piece_nodes;

/* Of a part the numbers of its nodes in the whole, also where the mesh is split. */
static const int *numbers_of(const flesh_rank_part *part) { return part ? flesh_rank_part_team(part)->numbers : NULL; }

static int fail_for_memory(void) { return flesh_fail(FLESH_ERR_MEMORY, "no memory for a checkpoint's piece"); }

static int archive_nodes(piece_nodes *nodes, flesh_archive *archive)
{
  int numbered = nodes->numbers != NULL;
  const int loads = archive->mode == FLESH_ARCHIVE_LOAD;
  flesh_archive_int(archive, &nodes->count, 0, 0x7ffffff0);
  flesh_archive_int(archive, &nodes->own, 0, nodes->count);
  flesh_archive_int(archive, &numbered, 0, 1);
  if (archive->wrong || !numbered) return FLESH_OK;
  const size_t bytes = (size_t)nodes->count * sizeof *nodes->numbers;
  if (loads && bytes > archive->size) archive->wrong = 1;
  if (loads && !archive->wrong && !(nodes->numbers = malloc(bytes + 1))) return fail_for_memory();
  if (!archive->wrong) flesh_archive_bytes(archive, nodes->numbers, bytes);
  return FLESH_OK;
}

static void archive_state(const flesh_checkpoint_piece *piece, flesh_archive *archive)
{
  flesh_state *state = piece->state;
  FLESH_ARCHIVE(archive, state->t);
  flesh_archive_nodes(archive, state->x, (size_t)piece->nodes);
  flesh_archive_nodes(archive, state->v, (size_t)piece->nodes);
  flesh_archive_bytes(archive, state->multipliers, (size_t)state->multiplier_count * sizeof(double));
  flesh_archive_bytes(archive, state->internal, (size_t)state->internal_count * sizeof(double));
}

/* All but the integrator's bytes, whose number is *size. */
static int archive_head(const flesh_checkpoint_piece *piece, piece_nodes *nodes, size_t *size, flesh_archive *archive)
{
  const int status = archive_nodes(nodes, archive);
  if (status || archive->wrong) return status;
  archive_state(piece, archive);
  FLESH_ARCHIVE(archive, *size);
  return FLESH_OK;
}

int flesh_checkpoint_pack(const flesh_checkpoint_piece *piece, uint8_t **bytes, size_t *size)
{
  const flesh_rank_part *part = piece->part;
  piece_nodes nodes = {piece->nodes, part ? flesh_rank_part_own(part) : piece->nodes,
                       (int *)numbers_of(part)}; /* only read */
  flesh_archive archive = {.mode = FLESH_ARCHIVE_MEASURE};
  size_t saved = 0;
  *bytes = NULL;
  int status = flesh_integrator_save(piece->integrator, 0, NULL, &saved);
  if (!status) status = archive_head(piece, &nodes, &saved, &archive);
  if (status) return status;
  *size = (archive.at + saved + 7) / 8 * 8;
  if (!(*bytes = calloc(*size + 1, 1))) return fail_for_memory();
  archive = (flesh_archive){.mode = FLESH_ARCHIVE_SAVE, .data = *bytes, .size = *size};
  status = archive_head(piece, &nodes, &saved, &archive);
  return status ? status : flesh_integrator_save(piece->integrator, *size - archive.at, *bytes + archive.at, &saved);
}

/* A piece as it was read. */
typedef struct piece_bytes {
  uint8_t *bytes;
  flesh_archive archive; /* behind the nodes */
  piece_nodes nodes;
} piece_bytes;

static void close_piece(piece_bytes *read)
{
  free(read->bytes);
  free(read->nodes.numbers);
}

static int open_piece(const char *folder, const flesh_checkpoint *checkpoint, int k, piece_bytes *read)
{
  size_t size = 0;
  *read = (piece_bytes){0};
  int status = flesh_checkpoint_read_piece(folder, checkpoint, k, &read->bytes, &size);
  read->archive = (flesh_archive){.mode = FLESH_ARCHIVE_LOAD, .data = read->bytes, .size = size};
  if (!status) status = archive_nodes(&read->nodes, &read->archive);
  return status || !read->archive.wrong ? status : flesh_checkpoint_refuse(folder);
}

int flesh_checkpoint_fits(const char *folder, const flesh_checkpoint *checkpoint, int rank, int ranks,
                          const flesh_checkpoint_piece *piece, int *fits)
{
  piece_bytes read;
  *fits = 0;
  if (ranks != checkpoint->head.pieces) return FLESH_OK;
  const int status = open_piece(folder, checkpoint, rank, &read);
  const piece_nodes *nodes = &read.nodes;
  const int *numbers = numbers_of(piece->part);
  *fits = !status && nodes->count == piece->nodes && !numbers == !nodes->numbers &&
          nodes->own == (piece->part ? flesh_rank_part_own(piece->part) : piece->nodes) &&
          (!numbers || !memcmp(numbers, nodes->numbers, (size_t)nodes->count * sizeof *numbers));
  close_piece(&read);
  return status;
}

/* Where the piece that was read has its own nodes here, [count] new; those that it shares are another's. */
static int *find_places(const piece_nodes *from, const flesh_checkpoint_piece *piece)
{
  int *places = malloc(((size_t)from->count + 1) * sizeof *places);
  for (int i = 0; places && i < from->count; i++) {
    const int number = from->numbers ? from->numbers[i] : i;
    places[i] = i >= from->own ? -1 : piece->part ? flesh_rank_part_find_number(piece->part, number) : number;
  }
  return places;
}

/* What piece k has for this one: all of it, or where it is not its `own`, what is of its nodes. */
static int take(const char *folder, const flesh_checkpoint *checkpoint, int k, int own, const flesh_checkpoint_piece *piece)
{
  piece_bytes read;
  size_t saved = 0;
  int *places = NULL, status = open_piece(folder, checkpoint, k, &read);
  flesh_archive *archive = &read.archive;
  if (!status && !own) {
    places = find_places(&read.nodes, piece);
    archive->places = places;
    archive->nodes = read.nodes.count;
    if (!places) status = fail_for_memory();
  }
  if (!status) {
    archive_state(piece, archive);
    FLESH_ARCHIVE(archive, saved);
    if (archive->wrong || saved > archive->size - archive->at) status = flesh_checkpoint_refuse(folder);
  }
  if (!status && piece->integrator && own)
    status = flesh_integrator_load(piece->integrator, archive->data + archive->at, saved);
  else if (!status && piece->integrator)
    status = flesh_integrator_take(piece->integrator, archive->data + archive->at, saved, archive->nodes, places, piece->state);
  free(places);
  close_piece(&read);
  return status;
}

int flesh_checkpoint_unpack(const char *folder, const flesh_checkpoint *checkpoint, int rank,
                            const flesh_checkpoint_piece *piece)
{
  int status = FLESH_OK;
  if (rank >= 0) return take(folder, checkpoint, rank, 1, piece);
  /* Of what is not of nodes, the first rank's comes last and stays, as in result.json. */
  for (int k = checkpoint->head.pieces - 1; k >= 0 && !status; k--) status = take(folder, checkpoint, k, 0, piece);
  return status;
}
