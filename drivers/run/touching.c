/* touching.c: which bodies touch, which are let apart, and what never touches. */
#include "run/describe.h"

#include <stdlib.h>

#include "effect/surface_contact.h"
#include "scene/scene.h"

enum { MOST = 8 }; /* pairs of patches that are told one by one */

/* Says of several bodies whether they touch or pass through each other. */
static void describe_bodies(const flesh_scene *scene, FILE *stream)
{
  const flesh_system *system = flesh_scene_system(scene);
  const int bodies = flesh_scene_body(scene)->part_count;
  int pairs = bodies * (bodies - 1) / 2, touching = 0;
  if (bodies < 2) return;
  for (int a = 0; a < bodies; a++)
    for (int b = a + 1; b < bodies; b++) {
      int may = 0;
      for (int k = 0; k < flesh_system_effect_count(system); k++)
        may |= flesh_surface_contact_may_meet(flesh_system_effect(system, k), a, b);
      touching += may;
    }
  if (!touching) fprintf(stream, "bodies: %d, which do not touch each other: they pass through each other\n", bodies);
  else if (touching == pairs) fprintf(stream, "bodies: %d, which touch each other\n", bodies);
  else
    fprintf(stream, "bodies: %d; of their %d pairs %d may touch, the others pass through each other\n", bodies, pairs,
            touching);
}

static const char *name_of(const flesh_body *body, int part)
{
  return body->part_count > 1 && body->parts[part].name ? body->parts[part].name : "the body";
}

static void describe_ignored(const flesh_scene *scene, const flesh_effect *effect, const double *x, FILE *stream)
{
  const flesh_body *body = flesh_scene_body(scene);
  flesh_patch_pair *pairs;
  int count;
  if (flesh_surface_contact_ignored(effect, x, &count, &pairs)) return; /* the run fails for the same reason */
  for (int k = 0; k < count && k < MOST; k++) {
    const flesh_patch_pair *pair = &pairs[k];
    const int itself = pair->bodies[0] == pair->bodies[1];
    fprintf(stream, "contact: %s goes through %s at (%.4g, %.4g, %.4g) m; %d and %d faces there do not touch each other "
            "until they are apart\n", name_of(body, pair->bodies[0]), itself ? "itself" : name_of(body, pair->bodies[1]),
            pair->place[0], pair->place[1], pair->place[2], pair->faces[0], pair->faces[1]);
  }
  if (count > MOST) fprintf(stream, "  and at %d more places\n", count - MOST);
  free(pairs);
}

static void describe_left_out(const flesh_scene *scene, const flesh_effect *effect, FILE *stream)
{
  const double *X = flesh_mesh_positions(flesh_scene_mesh(scene));
  flesh_left_out found;
  if (flesh_surface_contact_left_out(effect, &found) || !found.nodes) return;
  fprintf(stream, "contact: %d node%s faced across a gap that is smaller than the thickness at rest: %s not touch what is there "
          "(the narrowest is %.3g m, at node %d, (%.4g, %.4g, %.4g) m); a smaller `thickness` enables contact there\n",
          found.nodes, found.nodes == 1 ? " is" : "s are", found.nodes == 1 ? "it does" : "they do", found.gap, found.node,
          X[3 * (size_t)found.node], X[3 * (size_t)found.node + 1], X[3 * (size_t)found.node + 2]);
}

void flesh_describe_touching(const flesh_scene *scene, FILE *stream)
{
  const flesh_system *system = flesh_scene_system(scene);
  describe_bodies(scene, stream);
  for (int k = 0; k < flesh_system_effect_count(system); k++) {
    describe_left_out(scene, flesh_system_effect(system, k), stream);
    describe_ignored(scene, flesh_system_effect(system, k), scene->start.x, stream);
  }
}
