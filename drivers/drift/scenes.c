/* scenes.c: what is compared on which mesh: the files of the command line with every element and refinement. */
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/text.h"
#include "drift/drift.h"
#include "flesh/body.h"
#include "cli/safe_text.h"

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

/* Splits "a,b" at its commas; at most `room` words of 15 letters. Returns their number, -1: it is no such list. */
static int split(const char *text, int room, char words[][16])
{
  int count = 0;
  while (*text) {
    const size_t length = strcspn(text, ",");
    if (count == room || !length || length > 15) return -1;
    snprintf(words[count], 16, "%.*s", (int)length, text);
    for (int k = 0; k < count; k++)
      if (!strcmp(words[k], words[count])) return -1;
    count++;
    text += length + (text[length] == ',');
  }
  return count;
}

static int is_element(const char *word)
{
  for (int e = FLESH_ELEMENT_TET4; e < FLESH_ELEMENT_COUNT; e++)
    if (!strcmp(word, flesh_element_name((flesh_element)e))) return 1;
  return 0;
}

enum { REFINEMENTS = 4 };

static int read_lists(const char *elements, const char *refine, char words[][16], int *element_count, char times[][16],
                      int *times_count)
{
  *element_count = split(elements, FLESH_ELEMENT_COUNT, words);
  for (int k = 0; k < *element_count; k++)
    if (!is_element(words[k])) *element_count = -1;
  if (*element_count < 0)
    return flesh_fail(FLESH_ERR_ARGUMENT, "--elements is '%s'; it must be a list of tet4, tet10 and tet10-mean, each once",
                      elements);
  *times_count = split(refine, REFINEMENTS, times);
  for (int k = 0; k < *times_count; k++)
    if (strlen(times[k]) != 1 || *times[k] < '0' || *times[k] > '4') *times_count = -1;
  if (*times_count < 0)
    return flesh_fail(FLESH_ERR_ARGUMENT, "--refine is '%s'; it must be a list of whole numbers from 0 to 4, each once",
                      refine);
  return FLESH_OK;
}

int flesh_drift_make_scenes(int count, char *const *paths, const char *elements, const char *refine,
                            flesh_drift_plan *plan)
{
  char words[FLESH_ELEMENT_COUNT][16], times[REFINEMENTS][16], names[64][64];
  int element_count = 0, times_count = 0, status = read_lists(elements, refine, words, &element_count, times, &times_count);
  if (status) return status;
  for (int s = 0; s < count; s++) {
    name_scene(paths[s], s, 0, names[s]);
    for (int other = 0; other < s; other++)
      if (!strcmp(names[s], names[other])) name_scene(paths[s], s, 1, names[s]);
  }
  const int all = count * (element_count ? element_count : 1) * (times_count ? times_count : 1);
  plan->scenes = calloc((size_t)all, sizeof *plan->scenes);
  if (!plan->scenes) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  flesh_drift_scene *to = plan->scenes;
  for (int s = 0; s < count; s++)
    for (int e = 0; e < (element_count ? element_count : 1); e++)
      for (int r = 0; r < (times_count ? times_count : 1); r++, to++) {
        to->path = paths[s];
        snprintf(to->name, sizeof to->name, "%.63s", names[s]);
        if (element_count > 1) flesh_text_add(to->name, sizeof to->name, "_%s", words[e]);
        if (times_count > 1) flesh_text_add(to->name, sizeof to->name, "_refined%c", *times[r]);
        if (element_count) snprintf(to->element, sizeof to->element, "%.15s", words[e]);
        if (times_count) snprintf(to->refine, sizeof to->refine, "%.15s", times[r]);
      }
  plan->scene_count = all;
  return FLESH_OK;
}

int flesh_drift_overrides(const flesh_drift_plan *plan, int scene, flesh_overrides *overrides)
{
  const flesh_drift_scene *s = &plan->scenes[scene];
  int status = flesh_overrides_open(overrides, plan->overrides->count);
  if (status) return status;
  for (int k = 0; k < plan->overrides->count; k++)
    overrides->texts.values[overrides->texts.count++] = plan->overrides->values[k];
  if (*s->element) status = flesh_overrides_add(overrides, "body.element", s->element);
  if (!status && *s->refine) status = flesh_overrides_add(overrides, "body.refine", s->refine);
  if (status) flesh_overrides_close(overrides);
  return status;
}

int flesh_drift_read(const flesh_drift_plan *plan, int scene, flesh_scene **read)
{
  flesh_overrides overrides;
  *read = NULL;
  int status = flesh_drift_overrides(plan, scene, &overrides);
  if (status) return status;
  status = flesh_scene_read(plan->scenes[scene].path, overrides.texts.count, overrides.texts.values, read);
  flesh_overrides_close(&overrides);
  return status;
}
