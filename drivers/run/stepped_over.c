/* stepped_over.c: loads and motions that begin, turn or end more than once within a step which evaluates them at its end. */
#include "run/describe.h"

#include <math.h>

#include "flesh/system.h"

int flesh_steps_over(const flesh_scene *scene, double until, double *first)
{
  const flesh_scene_time *time = flesh_scene_times(scene);
  const flesh_system *system = flesh_scene_system(scene);
  const double slack = 1e-6 * time->step;
  int count = 0;
  if (time->method != FLESH_METHOD_BACKWARD_EULER || time->adaptive.control) return 0;
  for (double t = flesh_system_next_event(system, slack), end; t < until; t = flesh_system_next_event(system, end + slack)) {
    end = time->step * ceil((t - slack) / time->step);
    const int over = t < end - slack && flesh_system_next_event(system, t + slack) < end - slack;
    if (over && !count++) *first = t;
  }
  return count;
}
