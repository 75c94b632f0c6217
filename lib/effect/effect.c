/* effect.c: creates and destroys effects. */
#include "effect/effect.h"
#include "effect/environment.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "mesh/mesh.h"

int flesh_effect_create(const flesh_effect_operations *operations, const flesh_mesh *mesh, void *data,
                        flesh_effect **effect)
{
  FLESH_NEED({operations, "operations"});
  if ((!effect || !mesh) && operations->destroy) operations->destroy(data);
  FLESH_NEED({effect, "effect"});
  *effect = NULL;
  FLESH_NEED({mesh, "mesh"});
  const char *name = operations->name ? operations->name : "";
  int status = FLESH_OK;
  if ((unsigned)operations->role >= FLESH_ROLE_COUNT)
    status = flesh_fail(FLESH_ERR_ARGUMENT, "role %d of an effect does not exist; it must be below %d", (int)operations->role,
                        (int)FLESH_ROLE_COUNT);
  else if (!*name || strpbrk(name, ",\"\r\n"))
    status = flesh_fail(FLESH_ERR_ARGUMENT, "the name of an effect is '%s'; it must name columns of tables: not empty, without "
                                            "commas, quotation marks and line breaks", name);
  else if (!(*effect = flesh_malloc(sizeof **effect)))
    status = flesh_fail(FLESH_ERR_MEMORY, "no memory for an effect");
  if (status) {
    if (operations->destroy) operations->destroy(data);
    return status;
  }
  **effect = (flesh_effect){.operations = operations,
                            .data = data,
                            .nodes = flesh_mesh_node_count(mesh),
                            .tets = flesh_mesh_tet_count(mesh)};
  return FLESH_OK;
}

int flesh_effect_create_after(int status, const flesh_effect_operations *operations, const flesh_mesh *mesh, void *data,
                              flesh_effect **effect)
{
  if (!status) return flesh_effect_create(operations, mesh, data, effect);
  operations->destroy(data);
  return status;
}

flesh_point flesh_point_at(double t, const double *x, const double *v, const double *a)
{
  return (flesh_point){.t = t, .load = 1, .x = x, .v = v, .a = a, .lagged = {t, x, v}, .frozen = {x, v}, .penalty = 1};
}

void *flesh_point_near(const flesh_point *point) { return flesh_environment_of(point)->near; }

void flesh_effect_destroy(flesh_effect **effect)
{
  if (!effect || !*effect) return;
  if ((*effect)->operations->destroy) (*effect)->operations->destroy((*effect)->data);
  flesh_free(*effect);
  *effect = NULL;
}

int flesh_effect_check_mesh(const flesh_effect *effect, const flesh_mesh *mesh)
{
  return flesh_mesh_check_counts(mesh, "the effect", effect->operations->name, effect->nodes, effect->tets);
}

int flesh_effect_returned(const flesh_effect *effect, unsigned long said, int status)
{
  if (status >= 0 || flesh_fail_count() != said) return status;
  return flesh_fail(status, "effect %s returned %s: %s", effect->operations->name, flesh_status_name(status),
                    flesh_status_text(status));
}

flesh_instructions flesh_effect_instructions(const flesh_effect *effect)
{
  const flesh_effect_private *library = flesh_effect_private_of(effect);
  return library->instructions ? library->instructions(effect) : FLESH_INSTRUCTIONS_AUTO;
}

double flesh_interval_next_event(double from, double until, double t)
{
  return from > t ? from : until > t ? until : INFINITY;
}
