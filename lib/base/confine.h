/* confine.h: confines access to folders of results, which may come from an untrusted source: whatever they contain,
 * nothing outside of them is read, written or removed.
 *
 * A command confines the folder in which it reads or writes results once, under the name that the user gave; that name
 * may itself be a symbolic link. From then on the functions below, which base, output and the program use for all
 * opening, making and removing of files, resolve every path that begins with that name folder by folder with openat.
 * They follow no link and refuse "..": they fail with errno ELOOP or EXDEV, which flesh_path_reason explains. For all
 * other paths they do what the system's functions do. */
#ifndef FLESH_BASE_CONFINE_H
#define FLESH_BASE_CONFINE_H

#include <dirent.h>
#include <sys/stat.h>
#include <sys/types.h>

/* Confines the folder for the rest of the process. FLESH_ERR_MEMORY. */
int flesh_confine(const char *folder);
/* Returns whether the path lies inside a confined folder. */
int flesh_is_confined(const char *path);

/* Confined versions of open with O_CLOEXEC, stat, access, mkdir, unlink, rmdir, rename and opendir. flesh_path_stat
 * reports a link that it does not follow as a link (S_ISLNK). */
int flesh_path_open(const char *path, int flags, mode_t mode);
int flesh_path_stat(const char *path, struct stat *info);
int flesh_path_access(const char *path, int mode);
int flesh_path_make_folder(const char *path);
int flesh_path_unlink(const char *path);
int flesh_path_remove_folder(const char *path);
int flesh_path_rename(const char *from, const char *to);
DIR *flesh_path_list(const char *path);

/* Calls plain unlink, which takes no lock: signal handlers must not wait for the code that they interrupted. */
int flesh_path_drop(const char *path);

/* Explains errno `reason`: the text of strerror, or why the path leads out of a confined folder and what would be
 * valid. */
const char *flesh_path_reason(const char *path, int reason);

/* Checks a file that may be missing: FLESH_OK for a regular file or none; FLESH_ERR_FILE with a sentence for anything
 * else, and for a path that leads out of a confined folder. */
int flesh_path_check(const char *path);
/* Fails with FLESH_ERR_FILE, saying that the path is not a regular file. */
int flesh_fail_kind(const char *path, mode_t mode);
/* Returns whether a regular file, or anything at all, has this path. */
int flesh_path_is_file(const char *path);
int flesh_path_is_there(const char *path);

#endif
