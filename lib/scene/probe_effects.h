/* probe_effects.h: probes of what a pin, a prescribed motion, a contact, a weld or a joint of the scene bears. */
#ifndef FLESH_SCENE_PROBE_EFFECTS_H
#define FLESH_SCENE_PROBE_EFFECTS_H

#include "scene/scene.h"

/* Fills in nodes, holder and contact of the effect that `word` names, "pin" or "pin[1]"; quantities are checked.
 * FLESH_ERR_ARGUMENT with the effects that there are, FLESH_ERR_MEMORY. */
int flesh_scene_probe_effect(flesh_scene *scene, const char *word, flesh_probe *probe);

/* How many pins, prescribed motions, contacts, welds and joints the scene has; a probe of each, named pin, pin_2, ...,
 * into probes. FLESH_ERR_MEMORY. */
int flesh_scene_count_bearing(const flesh_scene *scene);
int flesh_scene_probe_bearing(flesh_scene *scene, flesh_probe *probes);

#endif
