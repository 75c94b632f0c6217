/* provenance.c: records the program, machine and inputs of a result. */
#include "run/provenance.h"

#include <errno.h>
#include <fcntl.h>
#include <sha256.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/utsname.h>
#include <time.h>
#include <unistd.h>

#include "build_info.h"
#include "commit.h"
#include "cli/output.h"
#include "cli/json_memory.h"
#include "scene/scene.h"

static const char *instruction_set(void)
{
#if defined(__AVX512F__)
  return "x86-64 with AVX-512";
#elif defined(__AVX2__) && defined(__FMA__)
  return "x86-64 with AVX2 and FMA";
#elif defined(__AVX__)
  return "x86-64 with AVX";
#elif defined(__x86_64__)
  return "x86-64";
#elif defined(__aarch64__)
  return "aarch64";
#else
  return "generic";
#endif
}

void flesh_provenance_print_version(void)
{
  printf("flesh %s%s%s%s\n", FLESH_VERSION, *FLESH_COMMIT ? " (" : "", FLESH_COMMIT,
         *FLESH_COMMIT ? ")" : "");
  printf("%s, %s, %s; %s\n", FLESH_COMPILER, FLESH_BUILD_TYPE, instruction_set(),
         FLESH_BUILD_OPTIONS);
  printf("SUNDIALS %s, SuiteSparse %s, MPI %s, libfyaml %s, GSL %s, jansson %s\n", FLESH_SUNDIALS_VERSION,
         FLESH_SUITESPARSE_VERSION, FLESH_MPI_VERSION, FLESH_FYAML_VERSION, FLESH_GSL_VERSION,
         FLESH_JANSSON_VERSION);
}

void flesh_provenance_identity(char text[FLESH_IDENTITY_SIZE])
{
  snprintf(text, FLESH_IDENTITY_SIZE, "flesh %s%s%s%s, %s, %s %s, SUNDIALS %s, SuiteSparse %s", FLESH_VERSION,
           *FLESH_COMMIT ? " (" : "", FLESH_COMMIT, *FLESH_COMMIT ? ")" : "", FLESH_COMPILER, FLESH_BUILD_TYPE,
           FLESH_COMPILER_FLAGS, FLESH_SUNDIALS_VERSION, FLESH_SUITESPARSE_VERSION);
}

/* Reads without a stream, for which memory might run out: the result would then say less. */
static void cpu_model(char text[256])
{
  char head[2048]; /* lines of the first processor */
  int file = open("/proc/cpuinfo", O_RDONLY | O_CLOEXEC);
  ssize_t got = file < 0 ? 0 : read(file, head, sizeof head - 1);
  if (file >= 0) close(file);
  head[got > 0 ? got : 0] = 0;
  const char *line = strstr(head, "model name");
  if (!line || sscanf(line, "model name : %255[^\n]", text) != 1) strcpy(text, "unknown");
}

json_t *flesh_provenance_program(int argc, char **argv)
{
  char cpu[256], date[32], machine[256];
  struct utsname system;
  struct tm utc;
  const time_t now = time(NULL);
  const int known = !uname(&system);
  cpu_model(cpu);
  strftime(date, sizeof date, "%Y-%m-%dT%H:%M:%SZ", gmtime_r(&now, &utc));
  if (known) snprintf(machine, sizeof machine, "%.60s %.60s %.60s", system.sysname, system.release, system.machine);
  json_t *words = json_array();
  for (int a = 0; a < argc; a++) json_array_append_new(words, flesh_json_text(argv[a]));
  json_t *libraries = json_pack("{s:s, s:s, s:s, s:s, s:s}", "SUNDIALS", FLESH_SUNDIALS_VERSION, "SuiteSparse",
                                FLESH_SUITESPARSE_VERSION, "libfyaml", FLESH_FYAML_VERSION, "GSL", FLESH_GSL_VERSION,
                                "jansson", FLESH_JANSSON_VERSION);
  return json_pack("{s:s, s:s?, s:s, s:s, s:s, s:s, s:s, s:o, s:o, s:i, s:o, s:o*, s:s}", "flesh", FLESH_VERSION,
                   "commit", *FLESH_COMMIT ? FLESH_COMMIT : NULL, "compiler", FLESH_COMPILER,
                   "compiler_flags", FLESH_COMPILER_FLAGS, "build_type", FLESH_BUILD_TYPE,
                   "build_options", FLESH_BUILD_OPTIONS, "instruction_set", instruction_set(), "libraries", libraries,
                   "arguments", words, "threads", 1, "cpu", flesh_json_text(cpu),
                   "system", known ? flesh_json_text(machine) : NULL, "date", date);
}

/* Adds a file once, by its absolute path, which does not depend on the working directory. */
static void add_file(json_t *files, const char *path)
{
  char digest[SHA256_DIGEST_STRING_LENGTH], *whole = realpath(path, NULL);
  const json_t *file;
  size_t k;
  json_t *name = whole ? flesh_json_text(whole) : NULL;
  if (!whole && errno == ENOMEM) flesh_json_note_lack();
  free(whole);
  json_array_foreach(files, k, file) {
    if (!name || !json_equal(json_object_get(file, "path"), name)) continue;
    json_decref(name);
    return;
  }
  if (name && SHA256File(path, digest))
    json_array_append_new(files, json_pack("{sOss}", "path", name, "sha256", digest));
  json_decref(name);
}

static void add_input(void *data, const char *path)
{
  add_file(data, path);
  /* TetGen's meshes consist of two files. */
  const char *name = flesh_tetgen_partner(path);
  if (name) add_file(data, name);
}

json_t *flesh_provenance_mesh(const flesh_mesh_info *info)
{
  return json_pack("{sisisisisisf}", "nodes", info->nodes, "tets", info->tets, "surface_triangles", info->triangles,
                   "flipped_tets", info->flipped, "unused_nodes", info->unused_nodes, "volume", info->volume);
}

json_t *flesh_provenance_scene(const flesh_scene *scene, const char *path)
{
  json_t *files = json_array();
  flesh_mesh_info info;
  add_file(files, path);
  flesh_scene_visit_files(scene, add_input, files);
  flesh_mesh_inspect(flesh_scene_mesh(scene), &info);
  const char *used = flesh_instructions_name(flesh_system_instructions(flesh_scene_system(scene)));
  return json_pack("{s:o, s:o, s:s, s:I}", "files", files, "mesh", flesh_provenance_mesh(&info), "instructions", used,
                   "seed", (json_int_t)flesh_scene_outputs(scene)->seed);
}
