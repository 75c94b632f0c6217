/* provenance.c: program, machine and inputs of a result. */
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
#include "cli/inputs.h"
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

static void cpu_model(char *text, size_t size)
{
  char head[2048]; /* the first processor's lines */
  int file = open("/proc/cpuinfo", O_RDONLY | O_CLOEXEC);
  ssize_t got = file < 0 ? 0 : read(file, head, sizeof head - 1);
  if (file >= 0) close(file);
  head[got > 0 ? got : 0] = 0;
  const char *line = strstr(head, "model name"), *colon = line ? strchr(line, ':') : NULL;
  snprintf(text, size, "%s", colon ? colon + 1 + strspn(colon + 1, " \t") : "unknown");
  text[strcspn(text, "\n")] = 0;
}

json_t *flesh_provenance_program(int argc, char **argv)
{
  json_t *program = json_object(), *words = json_array();
  for (int a = 0; a < argc; a++) json_array_append_new(words, flesh_json_text(argv[a]));
  json_object_set_new(program, "flesh", json_string(FLESH_VERSION));
  json_object_set_new(program, "commit", *FLESH_COMMIT ? json_string(FLESH_COMMIT) : json_null());
  json_object_set_new(program, "compiler", json_string(FLESH_COMPILER));
  json_object_set_new(program, "compiler_flags", json_string(FLESH_COMPILER_FLAGS));
  json_object_set_new(program, "build_type", json_string(FLESH_BUILD_TYPE));
  json_object_set_new(program, "build_options", json_string(FLESH_BUILD_OPTIONS));
  json_object_set_new(program, "instruction_set", json_string(instruction_set()));
  json_object_set_new(program, "libraries",
                      json_pack("{ssssssssss}", "SUNDIALS", FLESH_SUNDIALS_VERSION, "SuiteSparse",
                                FLESH_SUITESPARSE_VERSION, "libfyaml", FLESH_FYAML_VERSION, "GSL",
                                FLESH_GSL_VERSION, "jansson", FLESH_JANSSON_VERSION));
  json_object_set_new(program, "arguments", words);
  json_object_set_new(program, "threads", json_integer(1));
  char text[256];
  cpu_model(text, sizeof text);
  json_object_set_new(program, "cpu", flesh_json_text(text));
  struct utsname system;
  if (!uname(&system)) {
    snprintf(text, sizeof text, "%.60s %.60s %.60s", system.sysname, system.release,
             system.machine);
    json_object_set_new(program, "system", flesh_json_text(text));
  }
  time_t now = time(NULL);
  struct tm utc;
  strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", gmtime_r(&now, &utc));
  json_object_set_new(program, "date", json_string(text));
  return program;
}

/* Once each, by the name that no working directory changes. */
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
  /* TetGen's meshes are two files. */
  char *name = flesh_tetgen_partner(path);
  if (name) add_file(data, name);
  free(name);
}

json_t *flesh_provenance_mesh(const flesh_mesh_info *info)
{
  return json_pack("{sisisisisisf}", "nodes", info->nodes, "tets", info->tets, "surface_triangles", info->triangles,
                   "flipped_tets", info->flipped, "unused_nodes", info->unused_nodes, "volume", info->volume);
}

json_t *flesh_provenance_scene(const flesh_scene *scene, const char *path)
{
  json_t *inputs = json_object(), *files = json_array();
  add_file(files, path);
  flesh_scene_visit_files(scene, add_input, files);
  json_object_set_new(inputs, "files", files);
  flesh_mesh_info info;
  flesh_mesh_inspect(flesh_scene_mesh(scene), &info);
  json_object_set_new(inputs, "mesh", flesh_provenance_mesh(&info));
  const flesh_instructions used = flesh_system_instructions(flesh_scene_system(scene));
  json_object_set_new(inputs, "instructions", json_string(flesh_instructions_name(used)));
  json_object_set_new(inputs, "seed", json_integer(flesh_scene_outputs(scene)->seed));
  return inputs;
}
