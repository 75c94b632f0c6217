/* sync.h: what has been written is on the disk before it is relied on, so that it outlives a loss of power. */
#ifndef FLESH_BASE_SYNC_H
#define FLESH_BASE_SYNC_H

#include "base/file.h"

/* Waits until the file, or the folder's list of names, is on the disk. FLESH_ERR_FILE; a path that is not there and a
 * file system that does not know this are fine. */
int flesh_sync(const char *path);
/* The regular files in a folder but for those whose names end with _<number> and a suffix, the number being at most
 * `settled` (-1: none is), and then the folder. */
int flesh_sync_folder(const char *path, int settled);
/* flesh_file_commit, with the bytes on the disk before they get their name, and the name after that. */
int flesh_sync_commit(flesh_file *file);

#endif
