/* sunmatrix.h: what flesh's SUNMatrix objects have in common. */
#ifndef FLESH_SUNDIALS_SUNMATRIX_H
#define FLESH_SUNDIALS_SUNMATRIX_H

#include <stddef.h>
#include <sundials/sundials_matrix.h>

typedef struct _generic_SUNMatrix_Ops flesh_sunmatrix_operations; /* filled by name */

/* A matrix of the custom kind with these operations and a zeroed content of `size` bytes. Returns new. */
int flesh_sunmatrix_make(const flesh_sunmatrix_operations *operations, size_t size, SUNContext context,
                         SUNMatrix *matrix);
/* Frees the matrix and its content, but nothing that this points to; sets it to NULL. */
void flesh_sunmatrix_discard(SUNMatrix *matrix);
SUNMatrix_ID flesh_sunmatrix_id(SUNMatrix matrix);

#endif
