/* write.c: writes surfaces as OBJ and PLY. */
#include <stdint.h>
#include <string.h>
#include <strings.h>

#include "base/error.h"
#include "base/plain_locale.h"
#include "base/file.h"
#include "surface/surface.h"

static void write_obj(const flesh_surface *s, const double *x, FILE *stream)
{
  for (int i = 0; i < s->vertices; i++, x += 3)
    fprintf(stream, "v %.9g %.9g %.9g\n", x[0], x[1], x[2]);
  for (int i = 0; i < s->texture_count; i++)
    fprintf(stream, "vt %.9g %.9g\n", s->texture[2 * (size_t)i], s->texture[2 * (size_t)i + 1]);
  for (int f = 0; f < s->faces; f++) {
    putc('f', stream);
    for (int k = s->starts[f]; k < s->starts[f + 1]; k++) {
      fprintf(stream, " %d", s->corners[k] + 1);
      if (s->texture_corners && s->texture_corners[k] >= 0)
        fprintf(stream, "/%d", s->texture_corners[k] + 1);
    }
    putc('\n', stream);
  }
}

static void write_ply(const flesh_surface *s, const double *x, FILE *stream)
{
  int largest = 0;
  for (int f = 0; f < s->faces; f++)
    if (s->starts[f + 1] - s->starts[f] > largest) largest = s->starts[f + 1] - s->starts[f];
  fprintf(stream,
          "ply\nformat binary_little_endian 1.0\nelement vertex %d\n"
          "property float x\nproperty float y\nproperty float z\n"
          "element face %d\nproperty list %s int vertex_indices\nend_header\n",
          s->vertices, s->faces, largest < 256 ? "uchar" : "int");
  for (size_t d = 0; d < 3 * (size_t)s->vertices; d++) flesh_single_write(stream, x[d]);
  for (int f = 0; f < s->faces; f++) {
    if (largest < 256) putc(s->starts[f + 1] - s->starts[f], stream);
    else flesh_word_write(stream, (uint32_t)(s->starts[f + 1] - s->starts[f]));
    for (int k = s->starts[f]; k < s->starts[f + 1]; k++)
      flesh_word_write(stream, (uint32_t)s->corners[k]);
  }
}

int flesh_surface_write(const flesh_surface *surface, const double *x, const char *path)
{
  FLESH_NEED({surface, "surface"}, {path, "path"});
  const char *suffix = strrchr(path, '.');
  int obj = suffix && !strcasecmp(suffix, ".obj"), ply = suffix && !strcasecmp(suffix, ".ply");
  if (!obj && !ply)
    return flesh_fail(FLESH_ERR_ARGUMENT, "%s: a surface is written to a file named .obj or .ply",
                      path);
  flesh_plain_locale locale;
  flesh_file file;
  int status = flesh_plain_locale_begin(&locale);
  if (status) return status;
  status = flesh_file_open(path, &file);
  if (!status) {
    (obj ? write_obj : write_ply)(surface, x ? x : surface->positions, file.stream);
    status = flesh_file_commit(&file);
  }
  flesh_plain_locale_end(&locale);
  return status;
}
