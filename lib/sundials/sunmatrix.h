/* sunmatrix.h: common parts of flesh's SUNMatrix objects. */
#ifndef FLESH_SUNDIALS_SUNMATRIX_H
#define FLESH_SUNDIALS_SUNMATRIX_H

#include <stddef.h>
#include <sundials/sundials_matrix.h>

typedef struct _generic_SUNMatrix_Ops flesh_sunmatrix_operations; /* set by member names */

/* Makes a matrix of the custom kind with these operations and a zeroed content of `size` bytes. Returns new. */
int flesh_sunmatrix_make(const flesh_sunmatrix_operations *operations, size_t size, SUNContext context,
                         SUNMatrix *matrix);
/* Frees the matrix and its content, but nothing that the content points to; sets *matrix to NULL. */
void flesh_sunmatrix_discard(SUNMatrix *matrix);
SUNMatrix_ID flesh_sunmatrix_id(SUNMatrix matrix);

#endif
