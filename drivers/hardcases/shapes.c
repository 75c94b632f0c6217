/* shapes.c: what bodies of any shape go through, 0.2 m long along x, one row each. */
#include "hardcases/cases.h"

#include <stddef.h>

enum {
  FEET = FLESH_HARDCASES_FEET,
  RANDOM = FLESH_HARDCASES_RANDOM,
  STATIC = FLESH_HARDCASES_STATIC,
  HARDEST = FLESH_HARDCASES_HARDEST
};

/* Thin bodies swing for long: what is left of the motion is taken out by long steps of backward Euler, 60 in number. */
#define SETTLE(times) .release = 30 * (times), .release_step = 0.5 * (times)

/* clang-format off */
const flesh_hardcases_case flesh_hardcases_shape_table[] = {
  /* Starts of free bodies. */
  {.name = "jitter20", .group = "free", .start = FLESH_HARDCASES_JITTER, .amount = 0.2, .flags = RANDOM, .seconds = 2,
   SETTLE(1), .doc = "every node moved by up to 20 % of an edge along each axis"},
  {.name = "jitter50", .group = "free", .start = FLESH_HARDCASES_JITTER, .amount = 0.5, .flags = RANDOM, .seconds = 2,
   SETTLE(1), .doc = "the same by 50 %"},
  {.name = "jitter70", .group = "free", .start = FLESH_HARDCASES_JITTER, .amount = 0.7, .flags = RANDOM, .seconds = 2,
   SETTLE(1), .doc = "the same by 70 %"},
  {.name = "jitter100", .group = "free", .start = FLESH_HARDCASES_JITTER, .amount = 1, .flags = RANDOM, .seconds = 2,
   SETTLE(1), .doc = "the same by 100 %"},
  {.name = "throw1", .group = "free", .start = FLESH_HARDCASES_THROW, .amount = 1, .flags = RANDOM | HARDEST,
   .seconds = 2, SETTLE(1), .doc = "a hundredth of the nodes thrown one length away"},
  {.name = "throw100", .group = "free", .start = FLESH_HARDCASES_THROW, .amount = 100, .flags = RANDOM | HARDEST,
   .seconds = 2, SETTLE(1), .doc = "the same 100 lengths"},
  {.name = "noise10", .group = "free", .start = FLESH_HARDCASES_GAUSS, .amount = 10, .flags = RANDOM | HARDEST,
   .seconds = 2, SETTLE(1), .doc = "normal noise of ten lengths"},
  {.name = "scramble", .group = "free", .start = FLESH_HARDCASES_SCRAMBLE, .flags = RANDOM | HARDEST, .seconds = 2,
   SETTLE(1), .doc = "all nodes anywhere in the bounding box"},
  {.name = "half_turn", .group = "free", .start = FLESH_HARDCASES_HALF_TURN, .seconds = 2,
   SETTLE(1), .doc = "one half turned by 180 degrees"},
  {.name = "inside_out", .group = "free", .start = FLESH_HARDCASES_INSIDE_OUT, .seconds = 2,
   SETTLE(1), .doc = "every node through the middle to the other side"},
  {.name = "plane", .group = "free", .start = FLESH_HARDCASES_PLANE, .seconds = 2,
   SETTLE(1), .doc = "flattened to a plane, exactly"},
  {.name = "shrink0.3", .group = "free", .start = FLESH_HARDCASES_SCALE_ALL, .amount = 0.3, .seconds = 2,
   SETTLE(1), .doc = "squashed uniformly to 0.3 of its size"},
  {.name = "shrink0.6", .group = "free", .start = FLESH_HARDCASES_SCALE_ALL, .amount = 0.6, .seconds = 2,
   SETTLE(1), .doc = "squashed uniformly to 0.6"},
  {.name = "squash0.3", .group = "free", .start = FLESH_HARDCASES_SCALE_X, .amount = 0.3, .seconds = 2,
   SETTLE(1), .doc = "squashed to 0.3 along x"},
  {.name = "stretch4", .group = "free", .start = FLESH_HARDCASES_SCALE_X, .amount = 4, .seconds = 2,
   SETTLE(1), .doc = "stretched 4 times"},
  {.name = "shear2", .group = "free", .start = FLESH_HARDCASES_SHEAR, .amount = 2, .seconds = 2,
   SETTLE(1), .doc = "sheared by 2"},
  {.name = "twist5", .group = "free", .start = FLESH_HARDCASES_TWIST, .amount = 5, .seconds = 2,
   SETTLE(1), .doc = "twisted by 5 turns"},

  /* These bodies stand on feet. */
  {.name = "feet_jitter70", .group = "feet", .start = FLESH_HARDCASES_JITTER, .amount = 0.7, .flags = FEET | RANDOM,
   .seconds = 2, SETTLE(1), .doc = "every node moved by up to 70 % of an edge; the first twentieth held at rest"},
  {.name = "feet_scramble", .group = "feet", .start = FLESH_HARDCASES_SCRAMBLE, .flags = FEET | RANDOM | HARDEST,
   .seconds = 2, SETTLE(1), .doc = "all nodes anywhere in the bounding box; the first twentieth held at rest"},
  {.name = "feet_line", .group = "feet", .start = FLESH_HARDCASES_LINE, .flags = FEET, .seconds = 2,
   SETTLE(1), .doc = "flattened to a line, exactly; the first twentieth held at rest"},
  {.name = "feet_point", .group = "feet", .start = FLESH_HARDCASES_POINT, .flags = FEET | HARDEST, .seconds = 2,
   SETTLE(1), .doc = "collapsed to a point, exactly; the first twentieth held at rest"},
  {.name = "feet_mirrored", .group = "feet", .start = FLESH_HARDCASES_MIRROR, .flags = FEET, .seconds = 2,
   SETTLE(1), .doc = "the mirror image; the first twentieth held at rest"},
  {.name = "feet_half_turn", .group = "feet", .start = FLESH_HARDCASES_HALF_TURN, .flags = FEET, .seconds = 2,
   SETTLE(1), .doc = "one half turned by 180 degrees; the first twentieth held at rest"},
  {.name = "feet_twist2", .group = "feet", .start = FLESH_HARDCASES_TWIST, .amount = 2, .flags = FEET, .seconds = 2,
   SETTLE(1), .doc = "twisted by 2 turns; the first twentieth held at rest"},
  {.name = "feet_stop", .group = "feet", .start = FLESH_HARDCASES_SPEED, .amount = 1000, .flags = FEET, .seconds = 6,
   SETTLE(1), .doc = "flying at 1000 m/s with the first twentieth held at rest"},

  /* Violence that ends. */
  {.name = "crash1000", .group = "loads", .start = FLESH_HARDCASES_SPEED, .amount = 1000, .step = 1. / 60,
   .seconds = 4, .effects = "  - contact: {plane: {point: [0.25, 0, 0], normal: [-1, 0, 0]}}\n",
   SETTLE(1), .doc = "flying at 1000 m/s against a plane"},
  {.name = "crush", .group = "loads", .step = 1. / 60, .seconds = 3,
   .effects = "  - contact: {plane: {point: [-0.01, 0, 0], normal: [1, 0, 0]}, friction: 0.5}\n"
              "  - contact: {plane: {point: [0.21, 0, 0], normal: [-1, 0, 0]}, friction: 0.5,\n"
              "      motion: [{time: 0}, {time: 0.5, translation: [-0.2, 0, 0]}, {time: 1}]}\n",
   SETTLE(1), .doc = "pressed between two rough planes to a tenth of its length, and let go"},
  {.name = "pull_through", .group = "loads", .flags = FEET, .step = 1. / 60, .seconds = 3.5,
   .effects = "  - prescribed_motion: {box: [[0.19, -1e9, -1e9], [1, 1e9, 1e9]], until: 0.75,\n"
              "      motion: [{time: 0}, {time: 0.5, translation: [-0.6, 0, 0]}]}\n",
   SETTLE(1), .doc = "the far twentieth pulled through the body and beyond, and let go; the first held at rest"},

  /* Units, materials and steps: nodes moved by up to 50 % of an edge. */
  {.name = "soft", .group = "scales", .start = FLESH_HARDCASES_JITTER, .amount = 0.5, .flags = RANDOM, .seconds = 20,
   .step = 1, .young = 1, SETTLE(300), .doc = "jittered by 50 %, of 1 Pa, steps of 1 s"},
  {.name = "stiff", .group = "scales", .start = FLESH_HARDCASES_JITTER, .amount = 0.5, .flags = RANDOM, .seconds = 2,
   .young = 1e11, SETTLE(1), .doc = "jittered by 50 %, of 1e11 Pa"},
  {.name = "light", .group = "scales", .start = FLESH_HARDCASES_JITTER, .amount = 0.5, .flags = RANDOM, .seconds = 2,
   .density = 1, SETTLE(1), .doc = "jittered by 50 %, of 1 kg/m^3"},
  {.name = "heavy", .group = "scales", .start = FLESH_HARDCASES_JITTER, .amount = 0.5, .flags = RANDOM, .seconds = 4,
   .density = 1e4, SETTLE(1), .doc = "jittered by 50 %, of 10 000 kg/m^3"},
  {.name = "tiny", .group = "scales", .start = FLESH_HARDCASES_JITTER, .amount = 0.5, .flags = RANDOM, .seconds = 2,
   .scale = 1e-6, SETTLE(1), .doc = "jittered by 50 %, 0.2 micrometres long"},
  {.name = "huge", .group = "scales", .start = FLESH_HARDCASES_JITTER, .amount = 0.5, .flags = RANDOM, .seconds = 20000,
   .step = 1000, .scale = 1e6, SETTLE(1e6), .doc = "jittered by 50 %, 200 km long, steps of 1000 s"},
  {.name = "far_away", .group = "scales", .start = FLESH_HARDCASES_JITTER, .amount = 0.5, .flags = RANDOM, .seconds = 2,
   .offset = 1e6, SETTLE(1), .doc = "jittered by 50 %, 1000 km from the origin"},
  {.name = "short_steps", .group = "scales", .start = FLESH_HARDCASES_JITTER, .amount = 0.5, .flags = RANDOM,
   .seconds = 1e-3, .step = 1e-5, SETTLE(1), .doc = "jittered by 50 %, steps of 1e-5 s"},
  {.name = "long_steps", .group = "scales", .start = FLESH_HARDCASES_JITTER, .amount = 0.5, .flags = RANDOM,
   .seconds = 200, .step = 10, SETTLE(1), .doc = "jittered by 50 %, steps of 10 s"},

  /* Equilibria at nu = 0.495 from poses; relative residual 1e-8. */
  {.name = "pose_shrink0.3", .group = "poses", .start = FLESH_HARDCASES_SCALE_ALL, .amount = 0.3,
   .flags = FEET | STATIC, .step = 1, .poisson = 0.495, .doc = "squashed uniformly to 0.3"},
  {.name = "pose_shrink0.6", .group = "poses", .start = FLESH_HARDCASES_SCALE_ALL, .amount = 0.6,
   .flags = FEET | STATIC, .step = 1, .poisson = 0.495, .doc = "squashed uniformly to 0.6"},
  {.name = "pose_stretch4", .group = "poses", .start = FLESH_HARDCASES_SCALE_X, .amount = 4,
   .flags = FEET | STATIC, .step = 1, .poisson = 0.495, .doc = "stretched to 4 times its length"},
  {.name = "pose_shear2", .group = "poses", .start = FLESH_HARDCASES_SHEAR, .amount = 2,
   .flags = FEET | STATIC, .step = 1, .poisson = 0.495, .doc = "sheared by 2"},
  {.name = "pose_stretch_twist", .group = "poses", .start = FLESH_HARDCASES_STRETCH_TWIST, .amount = 2,
   .flags = FEET | STATIC, .step = 1, .poisson = 0.495, .doc = "stretched twice and twisted by half a turn"},
  {.name = "pose_jitter50", .group = "poses", .start = FLESH_HARDCASES_JITTER, .amount = 0.5,
   .flags = FEET | STATIC | RANDOM, .step = 1, .poisson = 0.495, .doc = "every node moved by up to 50 % of an edge"},
  {0}};
/* clang-format on */
