/* share.h: what a rank has of a scene's probes; share.c is what it has of all else. */
#ifndef FLESH_SCENE_SHARE_H
#define FLESH_SCENE_SHARE_H

#include "flesh/probe.h"
#include "flesh/ranks.h"
#include "scene/effect_list.h"
#include "scene/scene.h"

typedef struct flesh_share_probes {
  int count;
  flesh_probe *probes; /* [count] with nodes of their own: those that the part has */
} flesh_share_probes;

/* Takes the scene's probes, in the part's numbers; `effects` [the scene's]: each one's number in the part's system,
 * from 1. FLESH_ERR_MEMORY; cleared by the caller in any case. */
int flesh_share_probes_take(const flesh_scene *scene, const flesh_rank_part *part, const int *effects,
                            flesh_share_probes *self);
/* Calls flesh_probe_prepare for each, and adds the place in the scene to errors. Collective. */
int flesh_share_probes_prepare(const flesh_scene *scene, const flesh_body *body, const flesh_system *system,
                               flesh_share_probes *self);
void flesh_share_probes_clear(flesh_share_probes *self);

#endif
