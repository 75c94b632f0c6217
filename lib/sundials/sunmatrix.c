/* sunmatrix.c: common parts of flesh's SUNMatrix objects. */
#include "sundials/sunmatrix.h"

#include <stdlib.h>

#include "base/error.h"

SUNMatrix_ID flesh_sunmatrix_id(SUNMatrix matrix)
{
  (void)matrix;
  return SUNMATRIX_CUSTOM;
}

void flesh_sunmatrix_discard(SUNMatrix *matrix)
{
  free((*matrix)->content);
  (*matrix)->content = NULL;
  SUNMatFreeEmpty(*matrix);
  *matrix = NULL;
}

int flesh_sunmatrix_make(const flesh_sunmatrix_operations *operations, size_t size, SUNContext context,
                         SUNMatrix *matrix)
{
  *matrix = SUNMatNewEmpty(context);
  if (*matrix) (*matrix)->content = calloc(1, size);
  if (*matrix && (*matrix)->content) {
    *(*matrix)->ops = *operations;
    return FLESH_OK;
  }
  if (*matrix) flesh_sunmatrix_discard(matrix);
  return flesh_fail(FLESH_ERR_MEMORY, "no memory for a SUNMatrix");
}
