/* probe_place.h: the nodes and tets of a probe. */
#ifndef FLESH_OUTPUT_PROBE_PLACE_H
#define FLESH_OUTPUT_PROBE_PLACE_H

#include "base/team.h"
#include "flesh/probe.h"

/* Quantities that come from tets, and all quantities. */
enum {
  FLESH_PROBE_OF_TETS = FLESH_PROBE_J | FLESH_PROBE_STRETCH | FLESH_PROBE_STRESS | FLESH_PROBE_ENERGY,
  FLESH_PROBE_ALL = 2 * FLESH_PROBE_CONTACT_FORCE - 1
};

/* Finds the tets whose nodes all belong to the probe. Returns new *tets [*count], freed by the caller.
 * FLESH_ERR_MEMORY. */
int flesh_probe_find_tets(const flesh_mesh *mesh, const flesh_probe *probe, int *count, int **tets);

/* Fails with FLESH_ERR_ARGUMENT if a node is not in a mesh with `total` nodes. */
int flesh_probe_check_nodes(const flesh_probe *probe, int total);
/* Checks that probes [count] are prepared for the mesh and have different names. FLESH_ERR_ARGUMENT. */
int flesh_probes_check(const flesh_mesh *mesh, int count, const flesh_probe *probes, const flesh_team *team);
/* Returns whether this rank counts the probe's k-th node; 1 if `team` is NULL. */
int flesh_probe_counts(const flesh_probe *probe, const flesh_team *team, int k);

#endif
