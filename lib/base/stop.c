/* stop.c: the question whether to go on, for each thread separately. */
#include "base/stop.h"

#include "base/error.h"

static _Thread_local struct {
  int (*stop)(void *data);
  void *data;
  int active, said;
} self;

void flesh_stop_set(int (*stop)(void *data), void *data)
{
  self.stop = stop;
  self.data = data;
}

void flesh_stop_begin(void)
{
  self.active = 1;
  self.said = FLESH_OK;
}

int flesh_stop_end(void)
{
  self.active = 0;
  return self.said;
}

int flesh_stop_ask(void)
{
  if (!self.active || !self.stop) return FLESH_OK;
  if (!self.said) self.said = self.stop(self.data);
  if (self.said > 0) self.said = FLESH_OK;
  return self.said ? flesh_fail(self.said, "%s", flesh_status_text(self.said)) : FLESH_OK;
}
