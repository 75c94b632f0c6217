/* torn.c: tears a mesh into its tets. */
#include "mesh/torn.h"

#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "mesh/pieces.h"

int flesh_mesh_tear(const flesh_mesh *mesh, flesh_mesh **torn, int **from)
{
  const int tets = mesh->tets, size = mesh->edge_nodes ? 10 : 4;
  const size_t room = (size_t)size * (size_t)tets;
  int *nodes = flesh_malloc(room * sizeof *nodes + 1), count = 0;
  double *X = flesh_malloc(3 * room * sizeof *X + 1);
  *from = flesh_malloc(room * sizeof **from + 1);
  int status = nodes && X && *from ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for %d single tets", tets);
  for (int t = 0; t < tets && !status; t++) {
    int own[10];
    const int has = flesh_mesh_tet_nodes(mesh, t, own);
    for (int a = 0; a < size; a++) nodes[(size_t)t * (size_t)size + (size_t)a] = a < has ? count + a : -1;
    for (int a = 0; a < has; a++, count++) {
      (*from)[count] = own[a];
      memcpy(X + 3 * (size_t)count, flesh_mesh_positions(mesh) + 3 * (size_t)own[a], 3 * sizeof *X);
    }
  }
  if (!status) status = size == 4 ? flesh_mesh_create(count, X, tets, nodes, NULL, torn)
                                  : flesh_mesh_create_quadratic(count, X, tets, nodes, NULL, torn);
  flesh_free(nodes);
  flesh_free(X);
  return status;
}
