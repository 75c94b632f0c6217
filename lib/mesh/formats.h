/* formats.h: the readers and writers, one pair per file format. */
#ifndef FLESH_MESH_FORMATS_H
#define FLESH_MESH_FORMATS_H

#include "mesh/draft.h"
#include "base/scan.h"

/* Each reads the text or bytes of `s` from its beginning into an empty draft. */
int flesh_plain_read(flesh_scanner *s, flesh_draft *draft);
int flesh_medit_read(flesh_scanner *s, flesh_draft *draft);
int flesh_gmsh_read(flesh_scanner *s, flesh_draft *draft);

/* `s` holds one of the two files, `s->path`; its partner beside it is opened. */
int flesh_tetgen_read(flesh_scanner *s, flesh_draft *draft);

#endif
