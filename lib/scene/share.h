/* share.h: a rank's part of a scene's probes; share.c has its part of everything else. */
#ifndef FLESH_SCENE_SHARE_H
#define FLESH_SCENE_SHARE_H

#include "flesh/probe.h"
#include "flesh/ranks.h"
#include "scene/effect_list.h"
#include "scene/scene.h"

typedef struct flesh_share_probes {
  int count;
  flesh_probe *probes; /* [count] with lists of those of their nodes that the part has */
} flesh_share_probes;

/* Copies the scene's probes with the part's node numbers. `effects` [the scene's effects]: number of each in the part's
 * system, from 1. FLESH_ERR_MEMORY; the caller clears `self` in any case. */
int flesh_share_probes_take(const flesh_scene *scene, const flesh_rank_part *part, const int *effects,
                            flesh_share_probes *self);
/* Calls flesh_probe_prepare for each probe, and adds the place in the scene to errors. Collective. */
int flesh_share_probes_prepare(const flesh_scene *scene, const flesh_body *body, const flesh_system *system,
                               flesh_share_probes *self);
void flesh_share_probes_clear(flesh_share_probes *self);

#endif
