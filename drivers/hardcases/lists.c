/* lists.c: reads the comma lists of the battery's command line. */
#include "hardcases/lists.h"

#include <stdio.h>
#include <string.h>

#include "base/error.h"
#include "material/form.h"

int flesh_hardcases_split(const char *option, const char *text, int (*take)(void *data, const char *item), void *data)
{
  char item[FLESH_HARDCASES_ITEM_SIZE];
  int count = 0;
  while (*text) {
    const size_t length = strcspn(text, ","), most = sizeof item - 1;
    snprintf(item, sizeof item, "%.*s", (int)(length < most ? length : most), text);
    int status = take(data, item);
    if (status) return status;
    if (++count > FLESH_HARDCASES_LIST_LIMIT)
      return flesh_fail(FLESH_ERR_ARGUMENT, "%s has more than %d items", option, FLESH_HARDCASES_LIST_LIMIT);
    text += length + (text[length] == ',');
  }
  return count ? FLESH_OK
               : flesh_fail(FLESH_ERR_ARGUMENT, "%s is empty; it must be a list", option);
}

static int fail_twice(const char *option, const char *item)
{
  return flesh_fail(FLESH_ERR_ARGUMENT, "%s has %s twice; once is enough", option, item);
}

/* "S", or "D.as_e" with its constants; matched where the form can be, else raw. */
int flesh_hardcases_take_energy(void *data, const char *item)
{
  flesh_hardcases_lists *l = data;
  char name[64];
  const char *dot = strchr(item, '.');
  snprintf(name, sizeof name, "%.*s", dot ? (int)(dot - item) : 63, item);
  flesh_energy energy;
  flesh_constants constants;
  int status = flesh_energy_from_name(name, &energy);
  if (status) return status;
  constants = flesh_form_default_constants(energy);
  if (dot) status = flesh_constants_from_name(dot + 1, &constants);
  for (int k = 0; k < l->energies && !status; k++)
    if (l->energy[k] == energy && l->constants[k] == constants) status = fail_twice("--energies", item);
  l->energy[l->energies] = energy;
  l->constants[l->energies++] = constants;
  return status;
}

int flesh_hardcases_take_poisson(void *data, const char *item)
{
  flesh_hardcases_lists *l = data;
  double value;
  if (flesh_option_number(item, &value) || !(value > -1 && value <= 0.5))
    return flesh_fail(FLESH_ERR_ARGUMENT, "--poisson has '%s'; every value must be in (-1, 0.5]",
                      item);
  for (int k = 0; k < l->poissons; k++)
    if (l->poisson[k] == value) return fail_twice("--poisson", item);
  l->poisson[l->poissons++] = value;
  return FLESH_OK;
}

int flesh_hardcases_take_step(void *data, const char *item)
{
  flesh_hardcases_lists *l = data;
  double value;
  if (flesh_option_number(item, &value) || !(value > 0))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "--steps has '%s'; every value must be positive [s], as in 1/60", item);
  for (int k = 0; k < l->steps; k++)
    if (l->step[k] == value) return fail_twice("--steps", item);
  l->step[l->steps++] = value;
  return FLESH_OK;
}

int flesh_hardcases_take_solver(void *data, const char *item)
{
  flesh_hardcases_lists *l = data;
  const int all = !strcmp(item, "all"), ablation = !strcmp(item, "ablation");
  for (int s = 0; s < FLESH_HARDCASES_SOLVER_LIMIT; s++) {
    const char *name = flesh_hardcases_solver_name((flesh_hardcases_solver)s);
    const int taken = all        ? s < FLESH_HARDCASES_SOLVERS
                      : ablation ? s == FLESH_HARDCASES_DEFAULT || flesh_hardcases_left_out((flesh_hardcases_solver)s)
                                 : name && !strcmp(item, name);
    for (int k = 0; k < l->solvers && taken; k++)
      if ((int)l->solver[k] == s) return fail_twice("--solvers", name);
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

int flesh_hardcases_take_element(void *data, const char *item)
{
  flesh_hardcases_lists *l = data;
  for (int e = FLESH_ELEMENT_TET4; e <= FLESH_ELEMENT_TET10_MEAN; e++)
    if (!strcmp(item, flesh_element_name((flesh_element)e))) {
      for (int k = 0; k < l->elements; k++)
        if ((int)l->element[k] == e) return fail_twice("--elements", item);
      l->element[l->elements++] = (flesh_element)e;
      return FLESH_OK;
    }
  return flesh_fail(FLESH_ERR_ARGUMENT, "--elements has '%s'; the elements are tet4, tet10 and tet10-mean", item);
}

/* "8x4x2": cells of a block; or a file, named by what is between its folder and its suffix. */
int flesh_hardcases_take_body(void *data, const char *item)
{
  flesh_hardcases_lists *l = data;
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
      return flesh_fail(FLESH_ERR_ARGUMENT, "--meshes has two that are called '%s'; their runs would share folders",
                        b->name);
  l->bodies++;
  return FLESH_OK;
}
