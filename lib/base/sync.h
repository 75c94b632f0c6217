/* sync.h: makes sure that written data are on the disk before they are relied on, so that they survive a loss of
 * power. */
#ifndef FLESH_BASE_SYNC_H
#define FLESH_BASE_SYNC_H

#include "base/file.h"

/* Waits until the file, or the list of names of a folder, is on the disk. FLESH_ERR_FILE; a missing path and a file
 * system without fsync are fine. */
int flesh_sync(const char *path);
/* Syncs the regular files in a folder, and then the folder. Skips files whose names end with _<number> and a suffix if
 * the number is at most `settled` (-1: skips none). FLESH_ERR_FILE. */
int flesh_sync_folder(const char *path, int settled);
/* Like flesh_file_commit, but the bytes are on the disk before the file gets its name, and the name is there on
 * return. */
int flesh_sync_commit(flesh_file *file);

#endif
