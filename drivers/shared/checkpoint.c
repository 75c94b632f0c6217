/* checkpoint.c: two lines of text that say what it is and of which flesh, then a sum and an archive. */
#include "shared/checkpoint.h"

#include <math.h>
#include <sha256.h>
#include <stdlib.h>
#include <string.h>

#include "base/archive.h"
#include "base/error.h"
#include "base/scan.h"
#include "base/sync.h"
#include "shared/options.h"
#include "shared/provenance.h"

static const char mark[] = "flesh checkpoint 1\n";

static char *in_folder(const char *folder, const char *name)
{
  char *path = malloc(strlen(folder) + strlen(name) + 2);
  if (path) sprintf(path, "%s/%s", folder, name);
  else flesh_fail(FLESH_ERR_MEMORY, "%s: out of memory", folder);
  return path;
}

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
  char *path = in_folder(folder, "scene.yaml");
  if (!path || !SHA256File(path, digest)) *digest = 0;
  free(path);
}

static void archive_head(flesh_checkpoint_head *head, flesh_archive *archive)
{
  FLESH_ARCHIVE(archive, head->times.seconds);
  FLESH_ARCHIVE(archive, head->times.steps);
  FLESH_ARCHIVE(archive, head->no_frames);
  flesh_archive_int(archive, &head->step, 0, 0x7ffffffe);
  FLESH_ARCHIVE(archive, head->exact);
  FLESH_ARCHIVE(archive, head->max_seconds);
  FLESH_ARCHIVE(archive, head->start_t);
  FLESH_ARCHIVE(archive, head->wall_s);
  FLESH_ARCHIVE(archive, head->cpu_s);
  FLESH_ARCHIVE(archive, head->history);
  FLESH_ARCHIVE(archive, head->probes);
}

/* Text that is loaded is new. */
static int archive_text(char **text, flesh_archive *archive)
{
  int length = *text ? (int)strlen(*text) : 0;
  const int loads = archive->mode == FLESH_ARCHIVE_LOAD;
  flesh_archive_int(archive, &length, 0, 0x7ffffffe);
  archive->wrong |= loads && (size_t)length > archive->size;
  if (archive->wrong) return FLESH_OK;
  if (loads && !(*text = calloc((size_t)length + 1, 1))) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  flesh_archive_bytes(archive, *text, (size_t)length);
  return FLESH_OK;
}

static void archive_state(const flesh_checkpoint_parts *parts, flesh_archive *archive)
{
  flesh_state *state = parts->state;
  const size_t vector = (size_t)flesh_system_unknowns(flesh_scene_system(parts->scene)) * sizeof(double);
  FLESH_ARCHIVE(archive, state->t);
  flesh_archive_bytes(archive, state->x, vector);
  flesh_archive_bytes(archive, state->v, vector);
  flesh_archive_bytes(archive, state->multipliers, (size_t)state->multiplier_count * sizeof(double));
  flesh_archive_bytes(archive, state->internal, (size_t)state->internal_count * sizeof(double));
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
    if (!trace->rows) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
    trace->count = trace->room = count;
  }
  flesh_archive_bytes(archive, trace->rows, (size_t)count * sizeof *trace->rows);
  return FLESH_OK;
}

static int archive_integrator(flesh_integrator *integrator, flesh_archive *archive)
{
  size_t size = 0, room;
  int status = FLESH_OK;
  if (archive->mode != FLESH_ARCHIVE_LOAD) status = flesh_integrator_save(integrator, 0, NULL, &size);
  FLESH_ARCHIVE(archive, size);
  if (status || archive->wrong) return status;
  room = archive->size - archive->at;
  if (archive->mode != FLESH_ARCHIVE_MEASURE && size > room) {
    archive->wrong = 1;
    return FLESH_OK;
  }
  if (archive->mode == FLESH_ARCHIVE_LOAD) status = flesh_integrator_load(integrator, archive->data + archive->at, size);
  if (archive->mode == FLESH_ARCHIVE_SAVE)
    status = flesh_integrator_save(integrator, room, archive->data + archive->at, &size);
  archive->at += size;
  return status;
}

static int archive_parts(const flesh_checkpoint_parts *parts, flesh_archive *archive)
{
  flesh_figures *figures = parts->figures, copy = *figures;
  copy.energies = NULL;
  archive_state(parts, archive);
  FLESH_ARCHIVE(archive, copy);
  copy.energies = figures->energies;
  archive->wrong |= copy.effects != figures->effects;
  if (archive->wrong) return FLESH_OK;
  *figures = copy;
  flesh_archive_bytes(archive, figures->energies, (size_t)figures->effects * sizeof *figures->energies);
  int status = archive_trace(parts->trace, archive);
  return status || archive->wrong ? status : archive_integrator(parts->integrator, archive);
}

static int archive_all(const flesh_checkpoint_head *head, const char *digest, const char *notes,
                       const flesh_checkpoint_parts *parts, flesh_archive *archive)
{
  flesh_checkpoint_head copy = *head;
  char text[FLESH_DIGEST_SIZE], *words = (char *)notes; /* only read */
  memcpy(text, digest, sizeof text);
  FLESH_ARCHIVE(archive, text);
  archive_head(&copy, archive);
  int status = archive_text(&words, archive);
  return status ? status : archive_parts(parts, archive);
}

int flesh_checkpoint_write(const char *folder, const flesh_checkpoint_head *head, const char *scene_digest,
                           const char *notes, const flesh_checkpoint_parts *parts)
{
  flesh_archive archive = {.mode = FLESH_ARCHIVE_MEASURE};
  flesh_file file;
  char *path = in_folder(folder, FLESH_CHECKPOINT_NAME), identity[FLESH_IDENTITY_SIZE];
  int status = path ? archive_all(head, scene_digest, notes, parts, &archive) : FLESH_ERR_MEMORY;
  archive = (flesh_archive){.mode = FLESH_ARCHIVE_SAVE, .size = archive.at, .data = status ? NULL : malloc(archive.at)};
  if (!status && !archive.data) status = flesh_fail(FLESH_ERR_MEMORY, "%s: out of memory", folder);
  if (!status) status = archive_all(head, scene_digest, notes, parts, &archive);
  if (!status) status = flesh_file_open(path, &file);
  if (!status) {
    flesh_provenance_identity(identity);
    const uint64_t sum = flesh_archive_sum(0, archive.data, archive.size);
    fprintf(file.stream, "%s%s\n", mark, identity);
    fwrite(&sum, sizeof sum, 1, file.stream);
    fwrite(archive.data, 1, archive.size, file.stream);
    status = flesh_sync_commit(&file);
  }
  free(archive.data);
  free(path);
  return status;
}

static int refuse_damaged(const char *folder)
{
  return flesh_fail(FLESH_ERR_FILE, "%s/" FLESH_CHECKPOINT_NAME ": the checkpoint is damaged", folder);
}

/* Behind the two lines, where they are right. */
static int check_lines(const char *folder, const flesh_checkpoint *checkpoint, size_t *at)
{
  char identity[FLESH_IDENTITY_SIZE];
  const size_t marked = sizeof mark - 1, size = checkpoint->size;
  if (size < marked || memcmp(checkpoint->file, mark, marked))
    return flesh_fail(FLESH_ERR_FILE, "%s/" FLESH_CHECKPOINT_NAME ": this is no checkpoint that this flesh knows", folder);
  const char *line = checkpoint->file + marked, *end = memchr(line, '\n', size - marked);
  if (!end) return refuse_damaged(folder);
  flesh_provenance_identity(identity);
  const int length = (int)(end - line);
  if (strlen(identity) != (size_t)length || memcmp(identity, line, (size_t)length))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "%s: the checkpoint was written by %.*s; this is %s, which goes on from its own only", folder,
                      length < 200 ? length : 200, line, identity);
  *at = (size_t)(end + 1 - checkpoint->file);
  return FLESH_OK;
}

static flesh_archive archive_of(flesh_checkpoint *checkpoint, size_t at)
{
  return (flesh_archive){.mode = FLESH_ARCHIVE_LOAD, .data = (uint8_t *)checkpoint->file, .size = checkpoint->size, .at = at};
}

int flesh_checkpoint_open(const char *folder, flesh_checkpoint *checkpoint)
{
  char *path = in_folder(folder, FLESH_CHECKPOINT_NAME), digest[FLESH_DIGEST_SIZE] = "", now[FLESH_DIGEST_SIZE];
  size_t at = 0;
  uint64_t sum;
  if (!path) return FLESH_ERR_MEMORY;
  int status = flesh_file_load(path, &checkpoint->file, &checkpoint->size);
  if (status)
    status = flesh_fail_within(status, "%s: there is no checkpoint to go on from, as a run writes it with --checkpoint: ",
                               folder);
  free(path);
  if (!status) status = check_lines(folder, checkpoint, &at);
  if (status) return status;
  if (checkpoint->size - at < sizeof sum) return refuse_damaged(folder);
  memcpy(&sum, checkpoint->file + at, sizeof sum);
  at += sizeof sum;
  if (flesh_archive_sum(0, checkpoint->file + at, checkpoint->size - at) != sum) return refuse_damaged(folder);
  flesh_archive archive = archive_of(checkpoint, at);
  FLESH_ARCHIVE(&archive, digest);
  archive_head(&checkpoint->head, &archive);
  status = archive_text(&checkpoint->notes, &archive);
  if (archive.wrong) return refuse_damaged(folder);
  checkpoint->parts = archive.at;
  flesh_checkpoint_digest(folder, now);
  if (!status && !*now) return flesh_fail(FLESH_ERR_FILE, "%s/scene.yaml: cannot be read", folder);
  if (!status && strcmp(digest, now))
    return flesh_fail(FLESH_ERR_ARGUMENT, "%s/scene.yaml: is another scene than that of the checkpoint, which cannot go on "
                                          "with it", folder);
  return status;
}

void flesh_checkpoint_close(flesh_checkpoint *checkpoint)
{
  free(checkpoint->notes);
  free(checkpoint->file);
  *checkpoint = (flesh_checkpoint){0};
}

int flesh_checkpoint_restore(const char *folder, flesh_checkpoint *checkpoint, const flesh_checkpoint_parts *parts)
{
  flesh_archive archive = archive_of(checkpoint, checkpoint->parts);
  int status = archive_parts(parts, &archive);
  if (archive.wrong || (!status && archive.at != archive.size)) return refuse_damaged(folder);
  return status;
}
