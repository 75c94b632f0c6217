/* checkpoint.c: writes and reads checkpoint.bin: two lines of text that name the format and the build of flesh, then an
 * archive of what belongs to the whole run, then one of each piece; the length and the checksum of an archive
 * stand before it. */
#include "run/checkpoint.h"

#include <errno.h>
#include <math.h>
#include <sha256.h>
#include <stdlib.h>
#include <string.h>

#include "base/archive.h"
#include "base/error.h"
#include "base/scan.h"
#include "cli/options.h"
#include "cli/path.h"
#include "output/resume.h"
#include "run/provenance.h"

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

/* Archives a text; a text that is loaded is new. */
static int archive_text(char **text, flesh_archive *archive)
{
  int length = *text ? (int)strlen(*text) : 0;
  const int loads = archive->mode == FLESH_ARCHIVE_LOAD;
  flesh_archive_int(archive, &length, 0, 0x7ffffffe);
  archive->wrong |= loads && (size_t)length > archive->size;
  if (archive->wrong) return FLESH_OK;
  if (loads && !(*text = calloc((size_t)length + 1, 1))) return flesh_no_memory();
  flesh_archive_bytes(archive, *text, (size_t)length);
  return FLESH_OK;
}

static int archive_trace(flesh_run_trace *trace, flesh_archive *archive)
{
  int count = trace->count;
  flesh_archive_int(archive, &count, 0, 0x7ffffff);
  if (archive->mode == FLESH_ARCHIVE_LOAD && !archive->wrong) {
    flesh_run_trace_clear(trace);
    archive->wrong = (size_t)count * sizeof *trace->rows > archive->size;
    if (archive->wrong) return FLESH_OK;
    trace->rows = malloc(((size_t)count + 1) * sizeof *trace->rows);
    if (!trace->rows) return flesh_no_memory();
    trace->count = trace->room = count;
  }
  flesh_archive_bytes(archive, trace->rows, (size_t)count * sizeof *trace->rows);
  return FLESH_OK;
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

int flesh_checkpoint_refuse(const flesh_checkpoint *checkpoint)
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
  if (!fgets(line, sizeof line, checkpoint->file) || !strchr(line, '\n')) return flesh_checkpoint_refuse(checkpoint);
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
             ? flesh_checkpoint_refuse(checkpoint)
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
  return flesh_checkpoint_refuse(checkpoint);
}

/* Finds where each piece begins; the pieces fill the file from its current place to its end. */
static int find_pieces(flesh_checkpoint *checkpoint)
{
  const int pieces = checkpoint->head.pieces;
  uint64_t head[2];
  long at = ftell(checkpoint->file);
  if (pieces < 1 || (long)sizeof head > (checkpoint->end - at) / pieces) return flesh_checkpoint_refuse(checkpoint);
  checkpoint->places = malloc((size_t)pieces * sizeof *checkpoint->places);
  if (!checkpoint->places) return flesh_no_memory_for(checkpoint->folder);
  for (int k = 0; k < pieces; k++) {
    checkpoint->places[k] = at;
    if (fseek(checkpoint->file, at, SEEK_SET)) return flesh_checkpoint_refuse(checkpoint);
    const int status = read_head(checkpoint, head);
    if (status) return status;
    at += (long)(sizeof head + head[0]);
  }
  return at == checkpoint->end ? FLESH_OK : flesh_checkpoint_refuse(checkpoint);
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
  if (archive.wrong) return flesh_checkpoint_refuse(checkpoint);
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
  if (archive.wrong || (!status && archive.at != archive.size)) return flesh_checkpoint_refuse(checkpoint);
  return status;
}

int flesh_checkpoint_read_piece(const flesh_checkpoint *checkpoint, int piece, uint8_t **bytes, size_t *size)
{
  *bytes = NULL;
  return fseek(checkpoint->file, checkpoint->places[piece], SEEK_SET) ? flesh_checkpoint_refuse(checkpoint)
                                                                      : read_bytes(checkpoint, bytes, size);
}
