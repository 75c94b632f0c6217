/* probe_place.h: where a probe is. */
#ifndef FLESH_OUTPUT_PROBE_PLACE_H
#define FLESH_OUTPUT_PROBE_PLACE_H

#include "base/team.h"
#include "flesh/probe.h"

/* The quantities that tets have. */
enum { FLESH_PROBE_OF_TETS = FLESH_PROBE_J | FLESH_PROBE_STRETCH | FLESH_PROBE_STRESS | FLESH_PROBE_ENERGY };

/* The tets all of whose nodes the probe has. Returns new *tets [*count], freed by the caller. FLESH_ERR_MEMORY. */
int flesh_probe_find_tets(const flesh_mesh *mesh, const flesh_probe *probe, int *count, int **tets);

/* FLESH_ERR_ARGUMENT where a node is none of a mesh with `total` nodes. */
int flesh_probe_check_nodes(const flesh_probe *probe, int total);
/* Whether the probe's k-th node is this rank's to count; 1 where `team` is NULL. */
int flesh_probe_counts(const flesh_probe *probe, const flesh_team *team, int k);

#endif
