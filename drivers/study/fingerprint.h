/* fingerprint.h: what a scene is, in one short text. */
#ifndef FLESH_STUDY_FINGERPRINT_H
#define FLESH_STUDY_FINGERPRINT_H

#include "flesh/scene.h"

enum { FLESH_STUDY_FINGERPRINT = 65 };

/* SHA-256 of every value in force, of the mesh and of the state that the scene starts from. `path` is the scene's, for
 * sentences. FLESH_ERR_MEMORY. */
int flesh_study_fingerprint(const flesh_scene *scene, const char *path, char text[FLESH_STUDY_FINGERPRINT]);

#endif
