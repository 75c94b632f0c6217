/* stress_pictures.c: the matrix and the frames of the battery. */
#include "stress.h"

int flesh_stress_draw(const flesh_stress_plan *plan)
{
  (void)plan;
  return 0;
}
