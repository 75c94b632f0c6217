/* stiff_rows.h: the stiff rows (flesh/block_matrix.h) of all effects of a system, in one list. */
#ifndef FLESH_SYSTEM_STIFF_ROWS_H
#define FLESH_SYSTEM_STIFF_ROWS_H

#include "flesh/system.h"

/* Collects this rank's stiff rows of the effects whose rows have as many nodes as those of the first effect that has any.
 * nodes_per_row 0: there are none. Clear it also after a failure. FLESH_ERR_MEMORY. */
int flesh_system_stiff_rows_create(const flesh_system *system, flesh_stiff_rows *rows);
/* Makes the figures of the rows those of all ranks' rows. Collective. */
void flesh_system_stiff_rows_unite(const flesh_system *system, flesh_stiff_rows *rows);
void flesh_system_stiff_rows_clear(flesh_stiff_rows *rows);

/* Computes the rows' values in the system's Jacobian at this point, ignoring constraints. */
void flesh_system_stiff_values(const flesh_system *system, const flesh_point *point, const flesh_shift *shift,
                               flesh_stiff_rows *rows);

#endif
