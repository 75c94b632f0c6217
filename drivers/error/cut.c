/* cut.c: shares of tets beyond boxes, by points. */
#include "error/cut.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "mesh/mesh.h"
#include "scene/scene.h"

enum { POINTS_OF_EDGE = 16 }; /* 816 points of a tet */

typedef struct work {
  const flesh_scene *scene;
  int tets, count;       /* of the first body; of its regions */
  uint8_t *meets;        /* [count*tets] whether tets are what regions ask for beside their boxes */
  int *entries, *counts; /* [tets] the region of each, -1: none; [count+1] a tet's points in none and in each */
  int *sample;           /* [count+1] a tet of none and of each, -1: there is none */
} work;

/* The region that a place in a tet is in; -1: none. */
static int entry_at(const work *w, int t, const double L[4])
{
  const flesh_mesh *mesh = w->scene->mesh;
  const flesh_scene_region *regions = w->scene->keys.body.regions.values;
  double x[3] = {0};
  for (int a = 0; a < 4; a++)
    for (int c = 0; c < 3; c++) x[c] += L[a] * mesh->positions[3 * (size_t)mesh->tet_nodes[4 * (size_t)t + (size_t)a] + (size_t)c];
  for (int e = 0; e < w->count; e++) {
    const double *box = regions[e].tets.box;
    int is = w->meets[(size_t)e * (size_t)w->tets + (size_t)t];
    for (int c = 0; c < 3 && is && !isnan(box[0]); c++) is = x[c] >= box[c] && x[c] <= box[3 + c];
    if (is) return e;
  }
  return -1;
}

/* Counts a tet's points by their regions; returns how many there are. */
static int count_points(const work *w, int t)
{
  const int n = POINTS_OF_EDGE;
  int points = 0;
  for (int e = 0; e <= w->count; e++) w->counts[e] = 0;
  for (int i = 0; i < n; i++)
    for (int j = 0; i + j < n; j++)
      for (int k = 0; i + j + k < n; k++, points++) {
        const double L[4] = {(i + .25) / n, (j + .25) / n, (k + .25) / n, (n - 1 - i - j - k + .25) / n};
        w->counts[1 + entry_at(w, t, L)]++;
      }
  return points;
}

/* Fills in what is cut, and how. */
static void find(const work *w, flesh_cut *cut)
{
  const double middle[4] = {.25, .25, .25, .25}, *volumes = w->scene->mesh->volumes;
  const flesh_body *body = &w->scene->body;
  double all = 0;
  for (int t = w->tets; t-- > 0;) {
    w->entries[t] = entry_at(w, t, middle);
    w->sample[1 + w->entries[t]] = t;
  }
  for (int t = 0; t < w->tets; t++) {
    const int points = count_points(w, t);
    int most = 0, wrong = 0;
    cut->materials[t] = body->tet_material ? body->tet_material[t] : 0;
    for (int e = 0; e <= w->count; e++) {
      const int s = w->sample[e], is_denser = s >= 0 && body->density[s] != body->density[t];
      if (s < 0 || e == 1 + w->entries[t] || !w->counts[e] ||
          !(is_denser || (body->tet_material && body->tet_material[s] != body->tet_material[t])))
        continue;
      wrong += w->counts[e];
      cut->has_density |= is_denser;
      if (w->counts[e] > most && body->tet_material) cut->materials[t] = body->tet_material[s];
      if (w->counts[e] > most) most = w->counts[e];
    }
    all += volumes[t];
    cut->count += wrong > 0;
    cut->shares[t] = (double)wrong / points;
    cut->share += volumes[t] * cut->shares[t];
  }
  cut->share /= all;
}

/* Marks the tets that regions choose but for their boxes. */
static int mark(work *w)
{
  const flesh_scene_region *regions = w->scene->keys.body.regions.values;
  int status = FLESH_OK;
  for (int e = 0; e < w->count && !status; e++) {
    flesh_tet_selection rest = regions[e].tets;
    flesh_chosen_fibres chosen;
    rest.box[0] = NAN;
    rest.body = w->scene->keys.body.name;
    status = flesh_tets_choose(&rest, &w->scene->body, &chosen);
    for (int k = 0; k < chosen.count && !status; k++) w->meets[(size_t)e * (size_t)w->tets + (size_t)chosen.tets[k]] = 1;
    flesh_fibres_free(&chosen);
    w->sample[e] = -1;
  }
  w->sample[w->count] = -1;
  return status;
}

int flesh_cut_find(const flesh_scene *scene, flesh_cut *cut)
{
  work w = {.scene = scene, .tets = scene->parts[0].tets, .count = scene->keys.body.regions.count};
  const size_t tets = (size_t)w.tets, count = (size_t)w.count, all = (size_t)scene->mesh->tets;
  *cut = (flesh_cut){0};
  if (!count) return FLESH_OK;
  cut->shares = calloc(all, sizeof *cut->shares);
  cut->materials = calloc(all, sizeof *cut->materials);
  w.meets = calloc(count * tets, 1);
  w.entries = calloc(tets + 2 * (count + 1), sizeof *w.entries);
  int status = cut->shares && cut->materials && w.meets && w.entries ? FLESH_OK : flesh_no_memory();
  if (!status) {
    w.counts = w.entries + tets;
    w.sample = w.counts + count + 1;
    status = mark(&w);
  }
  if (!status) find(&w, cut);
  if (status || !cut->count) flesh_cut_clear(cut);
  free(w.meets);
  free(w.entries);
  return status;
}

void flesh_cut_clear(flesh_cut *cut)
{
  free(cut->shares);
  free(cut->materials);
  *cut = (flesh_cut){0};
}

void flesh_cut_say(const flesh_cut *cut, size_t size, char *words)
{
  snprintf(words, size, "boxes of body.regions cut %d tets, which have the %s of the region that their middle is in: %.2g %% of "
                        "the volume has that of the other side", cut->count, cut->has_density ? "density and material" : "material",
           100 * cut->share);
}

int flesh_cut_warn(const flesh_scene *scene, const char *column)
{
  flesh_cut cut;
  char words[320];
  const int status = flesh_cut_find(scene, &cut), is_place = strstr(column, ".position_") != NULL;
  if (cut.count && (cut.has_density || !is_place)) {
    flesh_cut_say(&cut, sizeof words, words);
    fprintf(stderr, "flesh: warning: %s on the first mesh; the bar of %s does not count %s\n", words, column,
            is_place ? "the densities" : "that");
  }
  flesh_cut_clear(&cut);
  return status;
}
