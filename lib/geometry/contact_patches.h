/* contact_patches.h: where bodies' surfaces go through each other at the start of a run, and so do not touch until they
 * are apart.
 *
 * A patch is a connected part of a surface: faces that go through others, faces that lie inside a body, and what is near
 * the patch that it goes through. Two patches of which one goes through the other ignore each other: the nodes, edges
 * and faces that belong to the one alone (all of whose faces do) do not touch those of the other. So a face of no patch
 * touches everything, and within a step no way leads from one patch through what is not in the other. From step to step
 * patches follow what goes through each other. */
#ifndef FLESH_GEOMETRY_CONTACT_PATCHES_H
#define FLESH_GEOMETRY_CONTACT_PATCHES_H

#include "base/archive.h"
#include "flesh/threads.h"
#include "geometry/near_finder.h"
#include "geometry/near_patches.h"

/* No patches. FLESH_ERR_MEMORY. */
int flesh_contact_patches_create(const flesh_contact_surface *surface, flesh_contact_patches *patches);
void flesh_contact_patches_clear(flesh_contact_patches *patches);

/* The patches become those at x [3*mesh_nodes]: of faces that meet, of what is inside a body, and of what was ignored and
 * is nearer than the thickness [m]; grown where they are nearer than `reach` [m], which is more, to those that they go
 * through. What then counts again is no nearer than the thickness. `finder`, of that surface, must not look at them
 * meanwhile. FLESH_UNDEFINED where a place is not finite, FLESH_ERR_MEMORY: they are as before. */
int flesh_contact_patches_update(flesh_contact_patches *patches, flesh_near_finder *finder, const double *x,
                                 double thickness, double reach, flesh_threads *threads);

/* Patches and pairs; the archive is wrong where they cannot be of this surface. FLESH_ERR_MEMORY. */
int flesh_contact_patches_archive(flesh_contact_patches *patches, flesh_archive *archive);

/* Finds edges' and nodes' patches from those of the faces, for a search and for loading. */
void flesh_contact_patches_label(flesh_contact_patches *patches);
/* Room for so many pairs. FLESH_ERR_MEMORY. */
int flesh_contact_patches_reserve(flesh_contact_patches *patches, int pairs);

#endif
