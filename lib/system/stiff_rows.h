/* stiff_rows.h: the stiff rows (flesh/block_matrix.h) of all effects of a system, in one list. */
#ifndef FLESH_SYSTEM_STIFF_ROWS_H
#define FLESH_SYSTEM_STIFF_ROWS_H

#include "flesh/system.h"

/* Collects the stiff rows, of this rank, of the effects whose rows have as many nodes as those of the first that has any.
 * nodes_per_row 0: there are none. To be cleared also when it fails. FLESH_ERR_MEMORY. */
int flesh_system_stiff_rows_create(const flesh_system *system, flesh_stiff_rows *rows);
/* The figures of the rows become those of all ranks' rows. Collective. */
void flesh_system_stiff_rows_unite(const flesh_system *system, flesh_stiff_rows *rows);
void flesh_system_stiff_rows_clear(flesh_stiff_rows *rows);

/* Their values in the system's Jacobian at this point; constrained dofs are not looked at. */
void flesh_system_stiff_values(const flesh_system *system, const flesh_point *point, const flesh_shift *shift,
                               flesh_stiff_rows *rows);

#endif
