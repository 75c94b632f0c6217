/* probe_effects.h: probes of the forces of a pin, a prescribed motion, a contact, a weld or a joint of the scene. */
#ifndef FLESH_SCENE_PROBE_EFFECTS_H
#define FLESH_SCENE_PROBE_EFFECTS_H

#include "scene/scene.h"

/* Fills in nodes, holder and contact of the effect that `word` names, "pin" or "pin[1]", and checks the quantities.
 * FLESH_ERR_ARGUMENT with the list of effects, FLESH_ERR_MEMORY. */
int flesh_scene_probe_effect(flesh_scene *scene, const char *word, flesh_probe *probe);

/* flesh_scene_count_bearing returns the number of pins, prescribed motions, contacts, welds and joints;
 * flesh_scene_probe_bearing makes a probe of each, named pin, pin_2, ..., into probes. FLESH_ERR_MEMORY. */
int flesh_scene_count_bearing(const flesh_scene *scene);
int flesh_scene_probe_bearing(flesh_scene *scene, flesh_probe *probes);

#endif
