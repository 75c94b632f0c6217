/* fibre_tension.c: the tension of a muscle fibre and its stress, one value at a time. */
#include "base/error.h"
#include "material/fibre_forms.h"

int flesh_fibre_tension(const flesh_fibre *fibre, double activation, double stretch, double tension[3])
{
  flesh_fibre_constants constants;
  flesh_fibre_real at;
  FLESH_NEED({fibre, "fibre"}, {tension, "tension"});
  int status = flesh_fibre_constants_of(fibre, &constants);
  if (status) return status;
  if (!(activation >= 0 && activation <= 1))
    return flesh_fail(FLESH_ERR_ARGUMENT, "activation is %g; it must be from 0 to 1", activation);
  if (!(stretch >= 0 && stretch < 1e100))
    return flesh_fail(FLESH_ERR_ARGUMENT, "stretch is %g; it must be from 0 to 1e100", stretch);
  flesh_fibre_form(&constants, activation, stretch * stretch, &at);
  tension[0] = at.value;
  tension[1] = at.T * stretch;
  tension[2] = at.stiffness;
  return FLESH_OK;
}

void flesh_fibre_add_stress(const flesh_fibre_constants *constants, double activation, const double f[3],
                            double tau[9])
{
  flesh_fibre_real at;
  flesh_fibre_form(constants, activation, f[0] * f[0] + f[1] * f[1] + f[2] * f[2], &at);
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) tau[3 * i + j] += at.T * f[i] * f[j];
}
