/* load.c: a force on nodes, and a traction per reference area of surface triangles. */
#include "base/error.h"
#include "base/memory.h"
#include "effect/dead_load.h"
#include "effect/face_shares.h"
#include "element/body.h"
#include "mesh/mesh.h"

#define OPERATIONS(text)                                                                                               \
  {                                                                                                                    \
      .name = text,                                                                                                    \
      .role = FLESH_ROLE_LOAD,                                                                                         \
      .residual = flesh_dead_load_residual,                                                                            \
      .potential = flesh_dead_load_potential,                                                                          \
      .energy = flesh_dead_load_energy,                                                                                \
      .destroy = flesh_dead_load_destroy,                                                                              \
      .time = &flesh_dead_load_time,                                                                                   \
      .figures = &flesh_dead_load_figures,                                                                             \
      .library = &flesh_dead_load_private,                                                                             \
  }
static const flesh_effect_operations force_operations = OPERATIONS("force"), traction_operations = OPERATIONS("traction");
#undef OPERATIONS

/* Creates a dead load with a list of `count` nodes, which the caller fills in. */
static int create(const flesh_body *body, int count, const double vector[3], const char *name, const char *unit,
                  const flesh_amplitude *amplitude, flesh_dead_load **load)
{
  if (count < 1 && !body->mesh->split) /* a part of a split mesh may have no loaded nodes */
    return flesh_fail(FLESH_ERR_ARGUMENT, "a %s acts on nothing; it must be given at least one node or triangle", name);
  const int status = flesh_dead_load_create(name, unit, vector, count, amplitude, load);
  if (status) return status;
  (*load)->X = flesh_mesh_positions(body->mesh);
  (*load)->nodes = flesh_malloc(((size_t)count + 1) * sizeof *(*load)->nodes);
  if ((*load)->nodes) return FLESH_OK;
  flesh_dead_load_destroy(*load);
  return flesh_fail(FLESH_ERR_MEMORY, "no memory for a %s on %d nodes", name, count);
}

int flesh_effect_force(const flesh_body *body, int count, const int *nodes, const double force[3],
                       const flesh_amplitude *amplitude, flesh_effect **effect)
{
  FLESH_NEED_BODY({body, "body"}, {nodes, "nodes"}, {force, "force"});
  const int total = flesh_mesh_node_count(body->mesh);
  for (int k = 0; k < count; k++)
    if (nodes[k] < 0 || nodes[k] >= total)
      return flesh_fail(FLESH_ERR_ARGUMENT, "node %d is loaded; the mesh has the nodes 0 to %d", nodes[k], total - 1);
  flesh_dead_load *load;
  const int status = create(body, count, force, "force", "N", amplitude, &load);
  if (status) return status;
  for (int k = 0; k < count; k++) load->nodes[k] = nodes[k];
  for (int d = 0; d < 3 * count; d++) load->force[d] = force[d % 3];
  load->is_shared = 1;
  load->scale = 1. / (count ? count : 1);
  return flesh_effect_create(&force_operations, body->mesh, load, effect);
}

int flesh_effect_traction(const flesh_body *body, int count, const int *triangles, const double traction[3],
                          const flesh_amplitude *amplitude, flesh_effect **effect)
{
  FLESH_NEED_BODY({body, "body"}, {triangles, "triangles"}, {traction, "traction"});
  const int total = flesh_mesh_node_count(body->mesh);
  int used = 0;
  flesh_dead_load *load;
  double *areas = flesh_calloc((size_t)total, sizeof *areas);
  int status = areas ? flesh_face_shares(body->mesh, count, triangles, areas)
                     : flesh_fail(FLESH_ERR_MEMORY, "no memory for a traction");
  for (int i = 0; !status && i < total; i++) used += areas[i] != 0;
  if (!status) status = create(body, used, traction, "traction", "Pa", amplitude, &load);
  for (int i = 0, k = 0; !status && i < total; i++) {
    if (areas[i] == 0) continue;
    for (int c = 0; c < 3; c++) load->force[3 * k + c] = areas[i] * traction[c];
    load->nodes[k++] = i;
  }
  flesh_free(areas);
  return status ? status : flesh_effect_create(&traction_operations, body->mesh, load, effect);
}
