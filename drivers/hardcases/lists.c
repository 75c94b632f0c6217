/* lists.c: reads the comma lists of the battery's command line. */
#include "hardcases/lists.h"

#include <stdio.h>
#include <string.h>

#include "base/error.h"

static int take_solver(void *data, const char *item)
{
  flesh_hardcases_lists *l = data;
  const int all = !strcmp(item, "all"), ablation = !strcmp(item, "ablation");
  for (int s = 0; s < FLESH_HARDCASES_SOLVER_LIMIT; s++) {
    const char *name = flesh_hardcases_solver_name((flesh_hardcases_solver)s);
    const int taken = all        ? s < FLESH_HARDCASES_CLAMPED_ALWAYS
                      : ablation ? s == FLESH_HARDCASES_DEFAULT || flesh_hardcases_left_out((flesh_hardcases_solver)s)
                                 : name && !strcmp(item, name);
    for (int k = 0; k < l->solvers && taken; k++)
      if ((int)l->solver[k] == s) return flesh_list_fail_twice("solvers", name);
    if (taken) l->solver[l->solvers++] = (flesh_hardcases_solver)s;
    if (taken && !all && !ablation) return FLESH_OK;
  }
  return all || ablation
             ? FLESH_OK
             : flesh_fail(FLESH_ERR_ARGUMENT,
                          "--solvers has '%s'; the solvers are default, kinsol-line-search, plain, always-projected, "
                          "never-projected, clamped, absolute, trust-region, or all of them: all; clamped-always, "
                          "absolute-always, trust-region-always; and without-TECHNIQUE, with the techniques of "
                          "`flesh schema solver`",
                          item);
}

/* "8x4x2": cells of a block; or a file, named by what is between its folder and its suffix. */
static int take_body(void *data, const char *item)
{
  flesh_hardcases_lists *l = data;
  if (l->bodies == FLESH_HARDCASES_LIST_LIMIT)
    return flesh_fail(FLESH_ERR_ARGUMENT, "--meshes has more than %d items", FLESH_HARDCASES_LIST_LIMIT);
  flesh_hardcases_body *b = &l->body[l->bodies];
  int end = 0;
  *b = (flesh_hardcases_body){0};
  if (sscanf(item, "%dx%dx%d%n", &b->cells[0], &b->cells[1], &b->cells[2], &end) == 3 && !item[end]) {
    for (int c = 0; c < 3; c++)
      if (b->cells[c] < 1 || b->cells[c] > 200)
        return flesh_fail(FLESH_ERR_ARGUMENT, "--meshes has '%s'; a block has 1 to 200 cells along each axis", item);
    snprintf(b->name, sizeof b->name, "%.63s", item);
  } else {
    const char *slash = strrchr(item, '/'), *name = slash ? slash + 1 : item;
    flesh_mesh *mesh = NULL;
    int status = flesh_mesh_read(item, &mesh);
    flesh_mesh_destroy(&mesh);
    if (status) return status;
    snprintf(b->name, sizeof b->name, "%.*s", (int)strcspn(name, "."), name);
    for (char *c = b->name; *c; c++)
      if (!strchr("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_", *c)) *c = '_';
    b->file = l->files[l->bodies];
    snprintf(l->files[l->bodies], sizeof *l->files, "%s", item);
  }
  for (int k = 0; k < l->bodies; k++)
    if (!strcmp(l->body[k].name, b->name))
      return flesh_fail(FLESH_ERR_ARGUMENT, "--meshes has two meshes called '%s'; names must differ",
                        b->name);
  l->bodies++;
  return FLESH_OK;
}

int flesh_hardcases_read_lists(const flesh_hardcases_request *asked, flesh_hardcases_lists *l)
{
  enum { ROOM = FLESH_HARDCASES_LIST_LIMIT };
  int status = flesh_list_energies(asked->energies, ROOM, l->energy, l->constants, &l->energies);
  if (!status)
    status = flesh_list_numbers("poisson", asked->poissons, FLESH_LIST_POISSON, ROOM, l->poisson, &l->poissons);
  if (!status) status = flesh_list_numbers("steps", asked->steps, FLESH_LIST_POSITIVE, ROOM, l->step, &l->steps);
  if (!status) status = flesh_list_each("solvers", asked->solvers, take_solver, l);
  if (!status) status = flesh_list_elements("elements", asked->elements, l->element, &l->elements);
  return status || !asked->meshes ? status : flesh_list_each("meshes", asked->meshes, take_body, l);
}
