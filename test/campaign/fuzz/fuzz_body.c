/* fuzz_body.c: files that belong to a mesh: the binding of a skin, a state, a frame and the index of frames. The first
 * byte selects one. */
#define _GNU_SOURCE
#include "fuzz.h"

#include <math.h>

#include "output/vtu_read.h"

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static flesh_mesh *mesh;
static flesh_surface *surface;

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
  (void)argc, (void)argv;
  fuzz_start();
  static const char skin[] = "v 0 0 0\nv 1 0 0\nv .25 .5 1.125\nv 0 1 1\nf 1 2 3 4\n";
  fuzz_write("skin.obj", skin, strlen(skin));
  int status = flesh_mesh_box((int[]){1, 1, 1}, (double[]){1, 1, 1}, (double[]){0, 0, 0}, &mesh);
  if (!status) status = flesh_surface_read("skin.obj", &surface);
  fuzz_expect(!status, "the body");
  return 0;
}

static void try_binding(void)
{
  flesh_skin *skin = NULL;
  flesh_skin_info info;
  double x[3 * 4];
  int status = flesh_skin_read("f", mesh, surface, &skin);
  fuzz_status(status);
  fuzz_expect(!status == (skin != NULL), "a status that is not what was returned");
  if (status) return;
  flesh_skin_inspect(skin, &info);
  flesh_skin_apply(skin, 3, 1, flesh_mesh_positions(mesh), x);
  for (int v = 0; v < 4; v++) {
    double sum = 0, size = 0;
    for (int i = 0; i < 4; i++) sum += flesh_skin_weights(skin)[4 * v + i], size += fabs(flesh_skin_weights(skin)[4 * v + i]);
    fuzz_expect(fabs(sum - 1) <= 1e-12 * size, "weights that do not sum to one");
  }
  flesh_skin_destroy(&skin);
}

static void try_state(void)
{
  enum { NODES = 8 };
  double x[3 * NODES], v[3 * NODES], again_x[3 * NODES], again_v[3 * NODES];
  flesh_state state = {.x = x, .v = v}, again = {.x = again_x, .v = again_v};
  int status = flesh_state_read("f", NODES, &state);
  fuzz_status(status);
  if (status) return;
  for (int i = 0; i < 3 * NODES; i++) fuzz_expect(isfinite(x[i]) && isfinite(v[i]), "a number that is not finite");
  fuzz_expect(isfinite(state.t), "a time that is not finite");
  status = flesh_state_write("written", NODES, &state);
  if (!status) status = flesh_state_read("written", NODES, &again);
  fuzz_expect(!status && again.t == state.t && !memcmp(x, again_x, sizeof x) && !memcmp(v, again_v, sizeof v),
              "another state comes back");
}

static void try_frame(void)
{
  double x[3 * 8], v[3 * 8];
  fuzz_status(flesh_vtu_read("f", 8, 2, (const char *const[]){"Points", "velocity"}, (double *const[]){x, v}));
}

static void try_frames(void)
{
  flesh_pvd index = {0};
  int status = flesh_pvd_read("f", &index);
  fuzz_status(status);
  for (int k = 0; k < index.count && !status; k++) {
    fuzz_expect(isfinite(index.times[k]), "a frame's time is not finite");
    fuzz_expect(!strchr(index.names[k], '/'), "a frame outside its folder");
  }
  flesh_pvd_clear(&index);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
  static void (*const tries[])(void) = {try_binding, try_state, try_frame, try_frames};
  if (!size) return 0;
  fuzz_write("f", data + 1, size - 1);
  tries[*data % 4]();
  return 0;
}
