/* confine.h: folders of results, which may come from anyone: whatever lies in them, nothing outside of them is read,
 * written or removed.
 *
 * A folder that a command reads or writes results in is confined once, under the name that the command was given; that
 * name may itself be a symbolic link. From then on the functions below, on which all opening, making and removing of
 * files in base, output and the program rests, go down every path that begins with that name one folder after another, by
 * openat. They follow no link, and refuse "..": they fail with errno ELOOP or EXDEV, of which flesh_path_reason makes
 * words. On all other paths they do what the system's functions do. */
#ifndef FLESH_BASE_CONFINE_H
#define FLESH_BASE_CONFINE_H

#include <dirent.h>
#include <sys/stat.h>
#include <sys/types.h>

/* Confines the folder for the rest of the process. FLESH_ERR_MEMORY. */
int flesh_confine(const char *folder);
/* Whether the path is that of something within a confined folder. */
int flesh_is_confined(const char *path);

/* These do what open with O_CLOEXEC, stat, access, mkdir, unlink, rmdir, rename and opendir do. flesh_path_stat reports
 * a link that it does not follow as a link (S_ISLNK). */
int flesh_path_open(const char *path, int flags, mode_t mode);
int flesh_path_stat(const char *path, struct stat *info);
int flesh_path_access(const char *path, int mode);
int flesh_path_make_folder(const char *path);
int flesh_path_unlink(const char *path);
int flesh_path_remove_folder(const char *path);
int flesh_path_rename(const char *from, const char *to);
DIR *flesh_path_list(const char *path);

/* unlink, for handlers of signals: these may not wait for what they have interrupted. */
int flesh_path_drop(const char *path);

/* The fault in words, by errno: strerror, or why the path leads out of a confined folder, and what would be valid. */
const char *flesh_path_reason(const char *path, int reason);

/* For files that may be missing. FLESH_OK where there is a regular file, or nothing; FLESH_ERR_FILE with a sentence for
 * anything else, and for what leads out. */
int flesh_path_check(const char *path);
/* Fails with FLESH_ERR_FILE for what is no regular file. */
int flesh_fail_kind(const char *path, mode_t mode);
/* Whether there is a regular file, or anything at all. */
int flesh_path_is_file(const char *path);
int flesh_path_is_there(const char *path);

#endif
