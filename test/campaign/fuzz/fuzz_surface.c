/* fuzz_surface.c: surfaces: OBJ, PLY and STL. */
#define _GNU_SOURCE
#include "fuzz.h"

#include "surface/surface.h"

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
  (void)argc, (void)argv;
  fuzz_start();
  return 0;
}

static void check(const flesh_surface *s)
{
  fuzz_expect(s->faces > 0 && s->vertices > 0 && !s->starts[0], "a surface without a face");
  for (int f = 0; f < s->faces; f++)
    fuzz_expect(s->starts[f + 1] >= s->starts[f] + 3, "a face of fewer than three corners");
  for (int c = 0; c < s->starts[s->faces]; c++) {
    fuzz_expect(s->corners[c] >= 0 && s->corners[c] < s->vertices, "a corner's vertex");
    if (s->texture)
      fuzz_expect(s->texture_corners[c] >= -1 && s->texture_corners[c] < s->texture_count, "a corner's texture");
  }
  for (int t = 0; t < s->triangle_count; t++) {
    const int *v = s->triangles + 3 * t;
    for (int i = 0; i < 3; i++)
      fuzz_expect(v[i] >= 0 && v[i] < s->vertices && v[i] != v[(i + 1) % 3], "a triangle's vertices");
  }
  fuzz_expect(s->triangle_count <= s->starts[s->faces] - 2 * s->faces, "the number of triangles");
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
  fuzz_write("s", data, size);
  flesh_surface *surface = NULL;
  int status = flesh_surface_read("s", &surface);
  fuzz_status(status);
  fuzz_expect(!status == (surface != NULL), "a status that is not what was returned");
  if (status) return 0;
  check(surface);
  flesh_surface_destroy(&surface);
  return 0;
}
