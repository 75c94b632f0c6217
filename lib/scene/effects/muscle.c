/* muscle.c: muscles: their keys in a scene. */
#include <math.h>

#include "scene/effect_rows.h"
#include "scene/fibres.h"

typedef struct parameters {
  flesh_tet_selection selection;
  flesh_fibre_field fibres;
  flesh_amplitude_parameters activation;
  double peak_stress, optimal_stretch, max_shortening_velocity;
  int curve;
  struct {
    double c1, c2, limit;
  } passive;
} parameters;

#define PASSIVE(member) .offset = offsetof(parameters, passive.member) - offsetof(parameters, passive)
static const flesh_key passive_keys[] = {
    {.name = "c1", .type = FLESH_KEY_NUMBER, PASSIVE(c1), .range = FLESH_RANGE_NOT_NEGATIVE, .unit = "Pa",
     .default_value = "",
     .doc = "factor of exp(c2 (l-1)) - 1, where l is the stretch over the optimal one; 0: no passive part. Default: "
            "0.05 peak_stress for blemker, 0.00678 peak_stress for thelen"},
    {.name = "c2", .type = FLESH_KEY_NUMBER, PASSIVE(c2), .range = FLESH_RANGE_POSITIVE, .default_value = "",
     .doc = "exponent. Default: 6.6 for blemker, 8.33 for thelen"},
    {.name = "limit", .type = FLESH_KEY_NUMBER, PASSIVE(limit), .range = FLESH_RANGE_POSITIVE, .default_value = "",
     .doc = "l - 1 above which the tension is linear. Default: 0.4 for blemker, 0.6 for thelen"},
    {0}};
#undef PASSIVE

#define CURVE_NAME(NAME, text, ...) text,
static const char *const curve_names[] = {FLESH_FIBRE_CURVE_LIST(CURVE_NAME) NULL};
#undef CURVE_NAME

#define AT(member) .offset = offsetof(parameters, member)
static const flesh_key keys[] = {
    FLESH_TET_SELECTION_KEYS(parameters, selection),
    {.name = "fibres", .type = FLESH_KEY_OBJECT, AT(fibres), .children = flesh_fibre_field_keys,
     .doc = "direction of the fibres in each tet at rest: one of direction, file or along"},
    {.name = "activation", .type = FLESH_KEY_OBJECTS, AT(activation.points), .default_value = "",
     .children = flesh_curve_keys, .child_size = sizeof(flesh_curve_point),
     .doc = "activation over time, 0 to 1; constant before the first and after the last point. Default: 1"},
    FLESH_INTERPOLATION_KEY(offsetof(parameters, activation.interpolation), "the activation's points", "point"),
    {.name = "from", .type = FLESH_KEY_NUMBER, AT(activation.from), .unit = "s", .default_value = "-.inf",
     .doc = "start of the activation"},
    {.name = "until", .type = FLESH_KEY_NUMBER, AT(activation.until), .unit = "s", .default_value = ".inf",
     .doc = "end of the activation; the fibres are active while from <= t < until, their passive part always acts"},
    {.name = "peak_stress", .type = FLESH_KEY_NUMBER, AT(peak_stress), .range = FLESH_RANGE_NOT_NEGATIVE, .unit = "Pa",
     .doc = "stress along the fibres at full activation and optimal stretch, per area of the deformed shape; 0: no "
            "active part (a tendon)"},
    {.name = "optimal_stretch", .type = FLESH_KEY_NUMBER, AT(optimal_stretch), .range = FLESH_RANGE_POSITIVE,
     .default_value = "1", .doc = "stretch at which the fibres are strongest, and above which they resist passively"},
    {.name = "curve", .type = FLESH_KEY_CHOICE, AT(curve), .choices = curve_names, .default_value = "blemker",
     .doc = "curve of the tension over the stretch: blemker (Blemker, Pinsky & Delp 2005) or thelen (Thelen 2003)"},
    {.name = "max_shortening_velocity", .type = FLESH_KEY_NUMBER, AT(max_shortening_velocity),
     .range = FLESH_RANGE_POSITIVE, .unit = "1/s", .default_value = "",
     .doc = "speed, in optimal lengths, at which fully active fibres no longer pull; when stretched, they pull up to "
            "1.4 times as hard (Thelen 2003; 10 in young adults). Without it the tension does not depend on the "
            "speed"},
    {.name = "passive", .type = FLESH_KEY_OBJECT, AT(passive), .default_value = "", .children = passive_keys,
     .doc = "tension of stretched fibres that are not active"},
    {0}};
#undef AT

static int add(const void *values, const flesh_body *body, flesh_system *system)
{
  const parameters *p = values;
  const flesh_amplitude activation = flesh_amplitude_read(&p->activation);
  flesh_chosen_fibres chosen;
  flesh_fibre fibre;
  flesh_effect *effect = NULL;
  int status = flesh_fibre_default((flesh_fibre_curve)p->curve, p->peak_stress, &fibre);
  if (status) return status;
  fibre.optimal_stretch = p->optimal_stretch;
  if (!isnan(p->max_shortening_velocity)) fibre.max_shortening_velocity = p->max_shortening_velocity;
  if (!isnan(p->passive.c1)) fibre.passive_stress = p->passive.c1;
  if (!isnan(p->passive.c2)) fibre.passive_exponent = p->passive.c2;
  if (!isnan(p->passive.limit)) fibre.passive_limit = p->passive.limit;
  status = flesh_fibres_choose(&p->selection, &p->fibres, body, &chosen);
  if (!status)
    status = flesh_effect_muscle(body, chosen.count, chosen.tets, chosen.directions, &fibre, &activation, &effect);
  flesh_fibres_free(&chosen);
  return flesh_effect_row_add(system, status, &effect);
}

const flesh_effect_row flesh_effect_row_muscle = {
    .name = "muscle",
    .doc = "Fibres that pull along themselves: an activation times the active part of a force-stretch curve, and a "
           "passive part. They resist neither compression nor shear, which is the material's part. The active "
           "tension may depend on the speed. The energy that a change of the activation adds at a fixed shape is "
           "external work.",
    .keys = keys,
    .parameters_size = sizeof(parameters),
    /* Strains away from the joints of the curve, near which finite differences are less exact. */
    .sample = "{fibres: {direction: [1, 2, 0.5]}, curve: thelen, peak_stress: 30000, optimal_stretch: 0.6, "
              "max_shortening_velocity: 8, passive: {c1: 3000, c2: 2, limit: 5}, "
              "activation: [{time: 0, value: 0.2}, {time: 1, value: 1}]}",
    .add = add,
    .on_parts = FLESH_PARTS_NODES,
};
