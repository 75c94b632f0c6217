/* renamed.h: what scenes of earlier versions called effects, keys and values, so that the sentence that refuses
 * an old name says the new one. */
#ifndef FLESH_SCENE_RENAMED_H
#define FLESH_SCENE_RENAMED_H

#include "base/key.h"

/* "techniques: [watchdog]" for the key "watchdog" where `keys` has techniques; NULL where `name` is no old name of
 * one of the keys. */
const char *flesh_renamed_key(const flesh_key *keys, const char *name);
/* The value to write in place of an old one of the key, and why in words; NULL where `text` is none. */
const char *flesh_renamed_choice(const flesh_key *key, const char *text, const char **why);
/* The new name of an effect; NULL where `name` is no old one. */
const char *flesh_renamed_effect(const char *name);

#endif
