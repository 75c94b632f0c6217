/* scenes.c: what is compared on which mesh: the files of the command line with every element and refinement; and what
 * solvers, forms and cases of the comparison are called. */
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/text.h"
#include "cli/lists.h"
#include "cli/safe_text.h"
#include "drift/drift.h"

const char *flesh_drift_solver_name(flesh_drift_solver solver)
{
  return solver == FLESH_DRIFT_PLAIN ? "plain" : "guarded";
}

void flesh_drift_variant_title(flesh_drift_variant variant, char title[16])
{
  int named = variant.constants != FLESH_CONSTANTS_MATCHED;
  snprintf(title, 16, "%s%s%s", flesh_energy_name(variant.energy), named ? " " : "",
           named ? flesh_constants_name(variant.constants) : "");
}

void flesh_drift_case_folder(const flesh_drift_plan *plan, const flesh_drift_case *c, char folder[256])
{
  const flesh_drift_variant *v = &plan->variants[c->variant];
  snprintf(folder, 256, "runs/%s_%s_%s_%g_%s", plan->scenes[c->scene].name, flesh_energy_name(v->energy),
           flesh_constants_name(v->constants), plan->poissons[c->poisson],
           flesh_drift_solver_name(c->solver));
}

/* The scene's file name without suffix, made unique by its place; it becomes part of names of files and a field. */
static void name_scene(const char *path, int index, int clash, char name[64])
{
  const char *slash = strrchr(path, '/'), *base = slash ? slash + 1 : path;
  const char *dot = strrchr(base, '.');
  int length = dot && dot != base ? (int)(dot - base) : (int)strlen(base);
  if (length > 48) length = 48;
  if (clash) snprintf(name, 64, "%.*s_%d", length, base, index + 1);
  else snprintf(name, 64, "%.*s", length, base);
  flesh_safe_name(name);
}

int flesh_drift_make_scenes(int count, char *const *paths, const char *elements, const char *refine,
                            flesh_drift_plan *plan)
{
  static const char *const times[] = {"0", "1", "2", "3", "4", NULL};
  flesh_element chosen[FLESH_ELEMENT_COUNT];
  char names[64][64];
  int refined[sizeof times / sizeof *times], element_count = 0, times_count = 0, status = FLESH_OK;
  if (*elements) status = flesh_list_elements("elements", elements, chosen, &element_count);
  if (!status && *refine) status = flesh_list_words("refine", refine, times, refined, &times_count);
  if (status) return status;
  for (int s = 0; s < count; s++) {
    name_scene(paths[s], s, 0, names[s]);
    for (int other = 0; other < s; other++)
      if (!strcmp(names[s], names[other])) name_scene(paths[s], s, 1, names[s]);
  }
  const int all = count * (element_count ? element_count : 1) * (times_count ? times_count : 1);
  plan->scenes = calloc((size_t)all, sizeof *plan->scenes);
  if (!plan->scenes) return flesh_no_memory();
  flesh_drift_scene *to = plan->scenes;
  for (int s = 0; s < count; s++)
    for (int e = 0; e < (element_count ? element_count : 1); e++)
      for (int r = 0; r < (times_count ? times_count : 1); r++, to++) {
        *to = (flesh_drift_scene){.path = paths[s], .element = "", .refine = ""};
        snprintf(to->name, sizeof to->name, "%.63s", names[s]);
        if (element_count) to->element = flesh_element_name(chosen[e]);
        if (times_count) to->refine = times[refined[r]];
        if (element_count > 1) flesh_text_add(to->name, sizeof to->name, "_%s", to->element);
        if (times_count > 1) flesh_text_add(to->name, sizeof to->name, "_refined%s", to->refine);
      }
  plan->scene_count = all;
  return FLESH_OK;
}

void flesh_drift_overrides(const flesh_drift_plan *plan, int scene, flesh_overrides *overrides)
{
  const flesh_drift_scene *s = &plan->scenes[scene];
  flesh_overrides_copy(overrides, &plan->options.overrides.texts);
  if (*s->element) flesh_overrides_add(overrides, "body.element", s->element);
  if (*s->refine) flesh_overrides_add(overrides, "body.refine", s->refine);
}

int flesh_drift_read(const flesh_drift_plan *plan, int scene, flesh_scene **read)
{
  flesh_overrides overrides;
  *read = NULL;
  flesh_drift_overrides(plan, scene, &overrides);
  const int status = flesh_overrides_read(&overrides, plan->scenes[scene].path, read);
  flesh_overrides_close(&overrides);
  return status;
}
