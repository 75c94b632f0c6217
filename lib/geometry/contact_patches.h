/* contact_patches.h: regions where surfaces intersect at the start of a run and therefore do not touch until they have
 * come apart.
 *
 * A patch is a connected part of a surface: faces that intersect others, faces inside a body, and the surroundings near
 * the patch that it intersects. Two patches that intersect ignore each other: nodes, edges and faces that belong only
 * to the one (all of their faces do) do not touch those of the other. A face of no patch touches everything, and no
 * path within a step leads from one patch through faces outside the other. Patches are updated from step to step as the
 * intersections change. */
#ifndef FLESH_GEOMETRY_CONTACT_PATCHES_H
#define FLESH_GEOMETRY_CONTACT_PATCHES_H

#include "base/archive.h"
#include "flesh/threads.h"
#include "geometry/near_finder.h"
#include "geometry/near_patches.h"

/* Creates an empty set of patches. FLESH_ERR_MEMORY. */
int flesh_contact_patches_create(const flesh_contact_surface *surface, flesh_contact_patches *patches);
void flesh_contact_patches_clear(flesh_contact_patches *patches);

/* Recomputes the patches at x [3*mesh_nodes] from faces that intersect, faces inside a body, and ignored pairs still
 * nearer than the thickness [m]. Patches grow to include what is nearer than `reach` [m], larger than the thickness, to
 * a patch that they intersect. Pairs that touch again afterwards are therefore at least the thickness apart. `finder`,
 * of the same surface, must not use the patches meanwhile. FLESH_UNDEFINED if a position is not finite,
 * FLESH_ERR_MEMORY: the patches are unchanged. */
int flesh_contact_patches_update(flesh_contact_patches *patches, flesh_near_finder *finder, const double *x,
                                 double thickness, double reach, flesh_threads *threads);

/* Saves or loads patches and their pairs; marks the archive as wrong if they cannot belong to this surface.
 * FLESH_ERR_MEMORY. */
int flesh_contact_patches_archive(flesh_contact_patches *patches, flesh_archive *archive);

/* Derives the patches of edges and nodes from those of the faces. */
void flesh_contact_patches_label(flesh_contact_patches *patches);
/* Makes room for `pairs` pairs. FLESH_ERR_MEMORY. */
int flesh_contact_patches_reserve(flesh_contact_patches *patches, int pairs);

#endif
