/* read.c: flesh_surface_read: loads a file and finds its format by its content. */
#include <string.h>

#include "base/error.h"
#include "surface/surface.h"

static int read_by_content(flesh_scanner *s, char *text, flesh_surface_draft *draft)
{
  if (s->at < s->end && flesh_surface_is_stl(s)) return flesh_surface_read_stl(s, draft);
  if (!flesh_scan_next(s)) return flesh_fail(FLESH_ERR_FILE, "%s: the file is empty", s->path);
  if (flesh_scan_word(s, "ply")) return flesh_surface_read_ply(s, draft);
  return flesh_surface_read_obj(s, text, draft);
}

int flesh_surface_read(const char *path, flesh_surface **surface)
{
  FLESH_NEED({surface, "surface"});
  *surface = NULL;
  FLESH_NEED({path, "path"});
  flesh_scanner scanner;
  flesh_surface_draft draft = {0};
  int status = flesh_scan_open(&scanner, path);
  if (!status) status = read_by_content(&scanner, scanner.data, &draft);
  if (!status && !draft.faces)
    status = flesh_fail(FLESH_ERR_FILE, "%s: there is no face in it", path);
  if (!status && (status = flesh_surface_draft_finish(&draft, surface)))
    status = flesh_fail_within(status, "%s: ", path);
  flesh_surface_draft_clear(&draft);
  flesh_scan_close(&scanner);
  return status;
}
