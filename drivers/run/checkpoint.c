/* checkpoint.c: writes and reads checkpoint.bin: two lines of text that name the format and the build of flesh, then an
 * archive of what belongs to the whole run, then one of each piece; the length and the checksum of an archive
 * stand before it. A piece has the numbers of its nodes, its own ones first, and of its tets if these have multipliers,
 * then the state there, then what the integrator remembers. */
#include "run/checkpoint.h"

#include <errno.h>
#include <math.h>
#include <sha256.h>
#include <stdlib.h>
#include <string.h>

#include "base/archive.h"
#include "base/error.h"
#include "base/rising.h"
#include "base/scan.h"
#include "cli/options.h"
#include "cli/path.h"
#include "output/resume.h"
#include "parallel/rank_part.h"
#include "run/provenance.h"
#include "time/integrator.h"

static const char mark[] = "flesh checkpoint 4\n";

static const char *path_in(const char *folder) { return flesh_path("%s/" FLESH_CHECKPOINT_NAME, folder); }

int flesh_checkpoint_times_read(const char *text, flesh_checkpoint_times *times)
{
  char number[32];
  const size_t length = strcspn(text, "s");
  const int by_steps = !strcmp(text + length, "steps") || !strcmp(text + length, "step");
  double value;
  *times = (flesh_checkpoint_times){0};
  if (length >= sizeof number || (!by_steps && strcmp(text + length, "s"))) return FLESH_ERR_ARGUMENT;
  memcpy(number, text, length);
  number[length] = 0;
  if (flesh_option_number(number, &value) || !(value > 0)) return FLESH_ERR_ARGUMENT;
  if (!by_steps) times->seconds = value;
  else if (value > 1e9 || value != floor(value)) return FLESH_ERR_ARGUMENT;
  else times->steps = (int)value;
  return FLESH_OK;
}

void flesh_checkpoint_digest(const char *folder, char digest[FLESH_DIGEST_SIZE])
{
  char *text = NULL;
  size_t size;
  *digest = 0;
  if (!flesh_file_load(flesh_path("%s/scene.yaml", folder), &text, &size)) SHA256Data((const uint8_t *)text, size, digest);
  free(text);
}

static void archive_head(flesh_checkpoint_head *head, flesh_archive *archive)
{
  FLESH_ARCHIVE(archive, *head);
  archive->wrong |= head->step < 0 || head->step > 0x7ffffffe || head->pieces < 1 || head->pieces > 1 << 24;
}

/* Archives an array; one that is loaded is new, with a zero byte behind it. `array` points to its pointer. */
static int archive_array(void *array, size_t bytes, flesh_archive *archive)
{
  void *data;
  memcpy(&data, array, sizeof data);
  if (archive->mode == FLESH_ARCHIVE_LOAD) {
    archive->wrong |= bytes > archive->size;
    if (archive->wrong) return FLESH_OK;
    if (!(data = calloc(bytes + 1, 1))) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a checkpoint");
    memcpy(array, &data, sizeof data);
  }
  flesh_archive_bytes(archive, data, bytes);
  return FLESH_OK;
}

static int archive_text(char **text, flesh_archive *archive)
{
  int length = *text ? (int)strlen(*text) : 0;
  flesh_archive_int(archive, &length, 0, 0x7ffffffe);
  return archive_array(text, (size_t)length, archive);
}

static int archive_trace(flesh_run_trace *trace, flesh_archive *archive)
{
  flesh_archive_int(archive, &trace->count, 0, 0x7ffffff);
  if (archive->mode == FLESH_ARCHIVE_LOAD) trace->room = trace->count;
  return archive_array(&trace->rows, (size_t)trace->count * sizeof *trace->rows, archive);
}

static int archive_figures(flesh_figures *figures, flesh_run_trace *trace, flesh_archive *archive)
{
  flesh_figures copy = *figures;
  copy.energies = copy.probes = NULL;
  FLESH_ARCHIVE(archive, copy);
  copy.energies = figures->energies;
  copy.probes = figures->probes;
  archive->wrong |= copy.effects != figures->effects || copy.probe_columns != figures->probe_columns;
  if (archive->wrong) return FLESH_OK;
  *figures = copy;
  flesh_archive_bytes(archive, figures->energies, (size_t)figures->effects * sizeof *figures->energies);
  flesh_archive_bytes(archive, figures->probes, FLESH_PROBE_FIGURES * (size_t)figures->probe_columns * sizeof(double));
  return archive_trace(trace, archive);
}

static int archive_all(const flesh_checkpoint_head *head, const char *digest, const char *notes,
                       flesh_figures *figures, flesh_run_trace *trace, flesh_archive *archive)
{
  flesh_checkpoint_head copy = *head;
  char text[FLESH_DIGEST_SIZE], *words = (char *)notes; /* only read */
  memcpy(text, digest, sizeof text);
  FLESH_ARCHIVE(archive, text);
  archive_head(&copy, archive);
  int status = archive_text(&words, archive);
  return status ? status : archive_figures(figures, trace, archive);
}

/* Writes the length and the checksum of the bytes, then the bytes. */
int flesh_checkpoint_add(void *file, size_t size, const uint8_t *bytes)
{
  FILE *stream = ((flesh_file *)file)->stream;
  const uint64_t head[2] = {size, flesh_archive_sum(0, bytes, size)};
  fwrite(head, sizeof head, 1, stream);
  fwrite(bytes, 1, size, stream);
  return FLESH_OK;
}

int flesh_checkpoint_begin(const char *folder, const flesh_checkpoint_head *head, const char *scene_digest,
                           const char *notes, flesh_figures *figures, flesh_run_trace *trace, flesh_file *file)
{
  flesh_archive archive = {.mode = FLESH_ARCHIVE_MEASURE};
  char identity[FLESH_IDENTITY_SIZE];
  int status = archive_all(head, scene_digest, notes, figures, trace, &archive);
  archive = (flesh_archive){.mode = FLESH_ARCHIVE_SAVE, .size = archive.at, .data = status ? NULL : malloc(archive.at)};
  if (!status && !archive.data) status = flesh_no_memory_for(folder);
  if (!status) status = archive_all(head, scene_digest, notes, figures, trace, &archive);
  if (!status) status = flesh_file_open(path_in(folder), file);
  if (!status) {
    flesh_provenance_identity(identity);
    fprintf(file->stream, "%s%s\n", mark, identity);
    flesh_checkpoint_add(file, archive.size, archive.data);
  }
  free(archive.data);
  return status;
}

/* Fails because the checkpoint is damaged. */
static int refuse(const flesh_checkpoint *checkpoint)
{
  return flesh_fail(FLESH_ERR_FILE, "%s/" FLESH_CHECKPOINT_NAME ": the checkpoint is damaged", checkpoint->folder);
}

/* Reads the two lines of text; fails unless they are those of this build. */
static int read_lines(const flesh_checkpoint *checkpoint)
{
  char identity[FLESH_IDENTITY_SIZE], line[2 * FLESH_IDENTITY_SIZE];
  if (!fgets(line, sizeof line, checkpoint->file) || strcmp(line, mark))
    return flesh_fail(FLESH_ERR_FILE, "%s/" FLESH_CHECKPOINT_NAME ": this is no checkpoint of flesh, or one of another "
                                                                  "format", checkpoint->folder);
  if (!fgets(line, sizeof line, checkpoint->file) || !strchr(line, '\n')) return refuse(checkpoint);
  line[strcspn(line, "\n")] = 0;
  flesh_provenance_identity(identity);
  if (!strcmp(identity, line)) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT,
                    "%s: the checkpoint was written by %.200s; this is %s, which goes on from its own only",
                    checkpoint->folder, line, identity);
}

/* Reads the length and the checksum of an archive at the file's current place, and checks that the archive can be in the
 * file. */
static int read_head(const flesh_checkpoint *checkpoint, uint64_t head[2])
{
  const long at = ftell(checkpoint->file), size = 2 * (long)sizeof *head;
  return fread(head, (size_t)size, 1, checkpoint->file) != 1 || at < 0 ||
                 head[0] > (uint64_t)(checkpoint->end - at - size)
             ? refuse(checkpoint)
             : FLESH_OK;
}

/* Reads an archive at the file's current place; *bytes is new. */
static int read_bytes(const flesh_checkpoint *checkpoint, uint8_t **bytes, size_t *size)
{
  uint64_t head[2];
  *bytes = NULL;
  const int status = read_head(checkpoint, head);
  if (status) return status;
  *size = (size_t)head[0];
  *bytes = malloc(*size + 1);
  if (!*bytes) return flesh_no_memory_for(checkpoint->folder);
  if (fread(*bytes, 1, *size, checkpoint->file) == *size && flesh_archive_sum(0, *bytes, *size) == head[1]) return FLESH_OK;
  free(*bytes);
  *bytes = NULL;
  return refuse(checkpoint);
}

/* Finds where each piece begins; the pieces fill the file from its current place to its end. */
static int find_pieces(flesh_checkpoint *checkpoint)
{
  const int pieces = checkpoint->head.pieces;
  uint64_t head[2];
  long at = ftell(checkpoint->file);
  if (pieces < 1 || (long)sizeof head > (checkpoint->end - at) / pieces) return refuse(checkpoint);
  checkpoint->places = malloc((size_t)pieces * sizeof *checkpoint->places);
  if (!checkpoint->places) return flesh_no_memory_for(checkpoint->folder);
  for (int k = 0; k < pieces; k++) {
    checkpoint->places[k] = at;
    if (fseek(checkpoint->file, at, SEEK_SET)) return refuse(checkpoint);
    const int status = read_head(checkpoint, head);
    if (status) return status;
    at += (long)(sizeof head + head[0]);
  }
  return at == checkpoint->end ? FLESH_OK : refuse(checkpoint);
}

static int read_main(flesh_checkpoint *checkpoint, char digest[FLESH_DIGEST_SIZE])
{
  int status = read_lines(checkpoint);
  if (!status) status = read_bytes(checkpoint, &checkpoint->main, &checkpoint->size);
  if (status) return status;
  flesh_archive archive = {.mode = FLESH_ARCHIVE_LOAD, .data = checkpoint->main, .size = checkpoint->size};
  flesh_archive_bytes(&archive, digest, FLESH_DIGEST_SIZE);
  archive_head(&checkpoint->head, &archive);
  status = archive_text(&checkpoint->notes, &archive);
  if (archive.wrong) return refuse(checkpoint);
  checkpoint->figures = archive.at;
  return status ? status : find_pieces(checkpoint);
}

int flesh_checkpoint_open(const char *folder, flesh_checkpoint *checkpoint)
{
  char digest[FLESH_DIGEST_SIZE] = "", now[FLESH_DIGEST_SIZE];
  const char *path = path_in(folder);
  checkpoint->folder = folder;
  if (flesh_regular_open(path, &checkpoint->file))
    return flesh_fail_within(FLESH_ERR_FILE, "%s: there is no checkpoint to go on from, as a run writes it with "
                                             "--checkpoint: ", folder);
  if (fseek(checkpoint->file, 0, SEEK_END) || (checkpoint->end = ftell(checkpoint->file)) < 0 ||
      fseek(checkpoint->file, 0, SEEK_SET))
    return flesh_fail(FLESH_ERR_FILE, "%s: cannot be read: %s", path, strerror(errno));
  const int status = read_main(checkpoint, digest);
  if (status) return status;
  flesh_checkpoint_digest(folder, now);
  if (!*now) return FLESH_ERR_FILE;
  if (strcmp(digest, now))
    return flesh_fail(FLESH_ERR_ARGUMENT, "%s/scene.yaml: differs from the checkpoint's scene; resuming needs the file "
                                          "as it was", folder);
  return FLESH_OK;
}

void flesh_checkpoint_close(flesh_checkpoint *checkpoint)
{
  if (checkpoint->file) fclose(checkpoint->file);
  free(checkpoint->notes);
  free(checkpoint->main);
  free(checkpoint->places);
  *checkpoint = (flesh_checkpoint){0};
}

int flesh_checkpoint_restore(const flesh_checkpoint *checkpoint, flesh_figures *figures, flesh_run_trace *trace)
{
  flesh_archive archive = {.mode = FLESH_ARCHIVE_LOAD, .data = checkpoint->main, .size = checkpoint->size,
                           .at = checkpoint->figures};
  int status = archive_figures(figures, trace, &archive);
  if (archive.wrong || (!status && archive.at != archive.size)) return refuse(checkpoint);
  return status;
}

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

static int archive_parts(piece_parts *parts, flesh_archive *archive)
{
  int numbered = parts->node_numbers != NULL;
  flesh_archive_int(archive, &parts->nodes, 0, 0x7ffffff0);
  flesh_archive_int(archive, &parts->own, 0, parts->nodes);
  flesh_archive_int(archive, &parts->tets, 0, 0x7ffffff0);
  flesh_archive_int(archive, &numbered, 0, 1);
  if (archive->wrong || !numbered) return FLESH_OK;
  const int status = archive_array(&parts->node_numbers, (size_t)parts->nodes * sizeof(int), archive);
  return status ? status : archive_array(&parts->tet_numbers, (size_t)parts->tets * sizeof(int), archive);
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
static int archive_piece(const flesh_checkpoint_piece *piece, piece_parts *parts, size_t *size, flesh_archive *archive)
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
  if (!status) status = archive_piece(piece, &parts, &saved, &archive);
  if (status) return status;
  *size = (archive.at + saved + 7) / 8 * 8;
  if (!(*bytes = calloc(*size + 1, 1))) return flesh_no_memory();
  archive = (flesh_archive){.mode = FLESH_ARCHIVE_SAVE, .data = *bytes, .size = *size};
  status = archive_piece(piece, &parts, &saved, &archive);
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
  int status = fseek(checkpoint->file, checkpoint->places[k], SEEK_SET) ? refuse(checkpoint)
                                                                        : read_bytes(checkpoint, &read->bytes, &size);
  read->archive = (flesh_archive){.mode = FLESH_ARCHIVE_LOAD, .data = read->bytes, .size = size};
  if (!status) status = archive_parts(&read->parts, &read->archive);
  return status || !read->archive.wrong ? status : refuse(checkpoint);
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
  if (!nodes) return flesh_no_memory();
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
    if (archive->wrong || saved > archive->size - archive->at) status = refuse(checkpoint);
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
