/* fuzz_scene.c: scenes and overrides. Parts of an input end at lines "%%": the scene, then one text for each --set. The
 * files "mesh", "tri.obj" and "state" exist. */
#define _GNU_SOURCE
#include "fuzz.h"

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
  (void)argc, (void)argv;
  fuzz_start();
  static const char mesh[] = "nodes 5\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\ntets 2\n0 1 2 3\n1 2 3 4\n";
  static const char triangles[] = "v 0 0 -1\nv 1 0 -1\nv 0 1 -1\nv 1 1 -1\nf 1 2 3\nf 2 4 3\n";
  static const char state[] = "# t .25\n0 0 0 0 0 0\n1 0 0 0 0 0\n0 1 0 0 0 0\n0 0 1 0 0 0\n1 1 1 0 0 1\n";
  fuzz_write("mesh", mesh, strlen(mesh));
  fuzz_write("tri.obj", triangles, strlen(triangles));
  fuzz_write("state", state, strlen(state));
  return 0;
}

/* Checks that the resolved scene is a scene, and that resolving it again changes nothing. */
static void check_resolved(const flesh_scene *scene)
{
  char *text[2] = {NULL, NULL};
  size_t length[2] = {0};
  flesh_scene *again = NULL;
  fuzz_expect(!flesh_scene_write(scene, "resolved.yaml"), "the resolved scene cannot be written");
  fuzz_expect(!flesh_scene_read("resolved.yaml", 0, NULL, &again), "the resolved scene is refused");
  fuzz_expect(!flesh_scene_write(again, "resolved2.yaml"), "the resolved scene cannot be written");
  for (int k = 0; k < 2; k++) {
    FILE *file = fopen(k ? "resolved2.yaml" : "resolved.yaml", "r");
    size_t room = 0;
    fuzz_expect(file && (length[k] = (size_t)getdelim(&text[k], &room, 0, file)) > 0, "the resolved scene is not there");
    fclose(file);
  }
  fuzz_expect(length[0] == length[1] && !memcmp(text[0], text[1], length[0]), "the resolved scene resolves to another");
  free(text[0]), free(text[1]);
  flesh_scene_destroy(&again);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
  enum { MOST = 6 };
  char *overrides[MOST];
  int count = 0;
  const uint8_t *at = data;
  size_t left = size, first = fuzz_part(&at, &left);
  fuzz_write("scene.yaml", data, first);
  while (left && count < MOST) {
    const uint8_t *from = at;
    size_t part = fuzz_part(&at, &left);
    if (part && from[part - 1] == '\n') part--;
    overrides[count++] = strndup((const char *)from, part);
  }
  flesh_scene *scene = NULL;
  int status = flesh_scene_read("scene.yaml", count, (const char *const *)overrides, &scene);
  fuzz_status(status);
  fuzz_expect(status != FLESH_ERR_MEMORY, "so small a scene needs little memory");
  fuzz_expect(!status == (scene != NULL), "a status that is not what was returned");
  if (!status && fuzz_chosen(data, size, 8)) check_resolved(scene);
  flesh_scene_destroy(&scene);
  while (count) free(overrides[--count]);
  return 0;
}
