/* binding_file.c: a binding as text. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/plain_locale.h"
#include "base/file.h"
#include "base/scan.h"
#include "skin/skin.h"

enum { VERSION = 1 };

int flesh_skin_write(const flesh_skin *skin, const char *path)
{
  FLESH_NEED({skin, "skin"}, {path, "path"});
  const flesh_skin_identity *id = &skin->identity;
  flesh_plain_locale locale;
  flesh_file file;
  int status = flesh_plain_locale_begin(&locale);
  if (status) return status;
  status = flesh_file_open(path, &file);
  if (!status) {
    fprintf(file.stream,
            "flesh skin %d\nmesh %d %d %016llx\nsurface %d %d %016llx\n# tet w0 w1 w2 w3 distance\n",
            VERSION, id->nodes, id->tets, (unsigned long long)id->mesh_hash, id->vertices,
            id->faces, (unsigned long long)id->surface_hash);
    for (int v = 0; v < id->vertices; v++) {
      const double *w = skin->weights + 4 * (size_t)v;
      fprintf(file.stream, "%d %.17g %.17g %.17g %.17g %.17g\n", skin->tets[v], w[0], w[1], w[2],
              w[3], skin->distances[v]);
    }
    status = flesh_file_commit(&file);
  }
  flesh_plain_locale_end(&locale);
  return status;
}

/* Reads the next word of the line as a hash; returns 0 if it is none. */
static int read_hash(flesh_scanner *s, uint64_t *hash)
{
  if (!flesh_scan_next_in_line(s)) return 0;
  char *end;
  *hash = strtoull(s->at, &end, 16);
  int good = end - s->at == 16;
  s->at = end;
  return good;
}

/* Reads a line `word COUNT COUNT HASH`, which must match this body. */
static int read_identity(flesh_scanner *s, const char *word, const char *of, const int counts[2],
                         uint64_t hash)
{
  static const char *const names[][2] = {{"nodes", "tets"}, {"vertices", "faces"}};
  const char *const *name = names[*word == 's'];
  int64_t found[2];
  uint64_t found_hash = 0;
  if (!flesh_scan_next(s) || !flesh_scan_word(s, word))
    return flesh_scan_fail(s, "a line `%s %s %s HASH` is expected", word, name[0], name[1]);
  s->item = word, s->index = -1, s->form = "COUNT COUNT HASH";
  int status = flesh_scan_integer(s, &found[0]);
  if (!status) status = flesh_scan_integer(s, &found[1]);
  if (!status && !read_hash(s, &found_hash))
    status = flesh_scan_fail(s, "%s: a hash of 16 hexadecimal digits is expected", word);
  if (!status) status = flesh_scan_row_end(s);
  if (status) return status;
  if (found[0] != counts[0] || found[1] != counts[1])
    return flesh_scan_fail(s, "the binding is for a %s of %lld %s and %lld %s; %s has %d and %d",
                           word, (long long)found[0], name[0], (long long)found[1], name[1], of,
                           counts[0], counts[1]);
  if (found_hash != hash)
    return flesh_scan_fail(s,
                           "the binding is for another %s of the same size (hash %016llx, here "
                           "%016llx); bind again",
                           word, (unsigned long long)found_hash, (unsigned long long)hash);
  return FLESH_OK;
}

static int read_row(flesh_scanner *s, const flesh_mesh *mesh, int v, flesh_skin *skin)
{
  int64_t tet;
  double w[4], distance, sum = 0, size = 0;
  s->item = "vertex", s->form = "tet w0 w1 w2 w3 distance", s->index = v;
  if (!flesh_scan_next(s))
    return flesh_scan_fail(s, "vertex %d: the file ends too early; it has a row per vertex, %d", v,
                           skin->identity.vertices);
  int status = flesh_scan_integer(s, &tet);
  for (int i = 0; i < 4 && !status; i++) status = flesh_scan_real(s, &w[i]);
  if (!status) status = flesh_scan_real(s, &distance);
  if (!status) status = flesh_scan_row_end(s);
  if (status) return status;
  if (tet < 0 || tet >= skin->identity.tets)
    return flesh_scan_fail(s, "vertex %d: the tet is %lld; it must be 0 to %d", v, (long long)tet,
                           skin->identity.tets - 1);
  for (int i = 0; i < 4; i++) sum += w[i], size += fabs(w[i]);
  if (!(fabs(sum - 1) <= 1e-12 * size))
    return flesh_scan_fail(s, "vertex %d: the weights sum to %.17g; it must be 1", v, sum);
  if (distance < 0)
    return flesh_scan_fail(s, "vertex %d: the distance is %g; it must not be negative", v, distance);
  flesh_skin_set(skin, mesh, v, (int)tet, w, distance);
  return FLESH_OK;
}

static int read_binding(flesh_scanner *s, const flesh_mesh *mesh, flesh_skin *skin)
{
  const flesh_skin_identity *id = &skin->identity;
  int64_t version;
  if (!flesh_scan_next(s) || !flesh_scan_word(s, "flesh") || !flesh_scan_next_in_line(s) ||
      !flesh_scan_word(s, "skin"))
    return flesh_scan_fail(s, "this is no binding of a skin: its first line is not `flesh skin %d`",
                           VERSION);
  s->item = "version", s->index = -1, s->form = "flesh skin VERSION";
  int status = flesh_scan_integer(s, &version);
  if (!status && version != VERSION)
    status = flesh_scan_fail(s, "the binding's version is %lld; only %d can be read",
                             (long long)version, VERSION);
  if (!status)
    status = read_identity(s, "mesh", "this mesh", (int[]){id->nodes, id->tets}, id->mesh_hash);
  if (!status)
    status = read_identity(s, "surface", "this surface", (int[]){id->vertices, id->faces},
                           id->surface_hash);
  for (int v = 0; v < id->vertices && !status; v++) status = read_row(s, mesh, v, skin);
  if (!status && flesh_scan_next(s))
    status = flesh_scan_fail(s, "%s stands behind the last of %d rows", flesh_scan_show(s),
                             id->vertices);
  return status;
}

int flesh_skin_read(const char *path, const flesh_mesh *mesh, const flesh_surface *surface,
                    flesh_skin **skin)
{
  FLESH_NEED({skin, "skin"});
  *skin = NULL;
  FLESH_NEED({path, "path"}, {mesh, "mesh"}, {surface, "surface"});
  flesh_scanner scanner;
  int status = flesh_scan_open(&scanner, path);
  if (!status) status = flesh_skin_open(mesh, surface, skin);
  if (!status) {
    status = read_binding(&scanner, mesh, *skin);
    if (status) flesh_skin_destroy(skin);
  }
  flesh_scan_close(&scanner);
  return status;
}
