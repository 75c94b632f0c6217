/* override.h: "path.to.key=value" applied to a scene's tree before it is read. */
#ifndef FLESH_SCENE_OVERRIDE_H
#define FLESH_SCENE_OVERRIDE_H

#include "base/key.h"
#include "scene/node.h"

/* Applies `text` as override number `number` (from 1) to the tree of a scene whose top keys are `keys`.
 *
 *   body.material.young=1e5             a key; mappings on the way are made if missing
 *   body.regions[0].density=900         an item of a list, by index from 0; the index after the last appends
 *   effects.gravity.acceleration[2]=0   an effect by name: the first of that name, appended if there is none
 *   effects.pin[1].until=2              the second of the effects named pin
 *   effects[3].pin.until=2              the fourth effect
 *   body.material.mu=null               removes the key (or the item, the effect)
 *
 * The value is YAML. Whether keys are known and values valid is checked when the tree is read.
 * FLESH_ERR_ARGUMENT with "--set text: ..."; FLESH_ERR_MEMORY. */
int flesh_override_apply(flesh_arena *arena, const flesh_key *keys, const char *text, int number,
                         flesh_node *root);

/* Finds the node to which a path of that form leads in the tree, with its parent and the key that describes it (for an
 * item of a list, that of the list). May add removed nodes to the tree. FLESH_ERR_ARGUMENT if there is none,
 * FLESH_ERR_MEMORY. */
int flesh_override_find(flesh_arena *arena, const flesh_key *keys, const char *path, flesh_node *root, flesh_node **node,
                        flesh_node **parent, const flesh_key **key);

#endif
