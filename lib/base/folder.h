/* folder.h: folders of results: creates them, claims one for a single process, and removes what killed processes left
 * behind. */
#ifndef FLESH_BASE_FOLDER_H
#define FLESH_BASE_FOLDER_H

/* Makes the folder and its parents; an existing folder is fine. FLESH_ERR_FILE when it cannot be made, is a file or
 * cannot be written into. */
int flesh_folder_make(const char *path);

/* Claim of a folder into which only this process writes. */
typedef struct flesh_folder_claim {
  char *path;     /* path of the lock file; NULL: no claim is held */
  int descriptor; /* open lock file; its lock ends when the process ends in any way */
  int made;       /* 1: the claim made the folder */
} flesh_folder_claim;

/* Makes the folder, locks the file .flesh.lock in it, which holds `who` for others to read, and clears the folder
 * (flesh_folder_clear). Waits up to `patience` seconds for another process that holds the lock: a killed process holds
 * it until it and its children have ended. FLESH_ERR_FILE, quoting the other's `who`, when the wait is over. A lock
 * file that nobody has locked is taken. On a file system without locks the folder is not guarded. */
int flesh_folder_claim_take(const char *path, const char *who, double patience, flesh_folder_claim *claim);
/* Removes the lock file, and the folder if the claim made it and it is empty; harmless without a claim. */
void flesh_folder_claim_release(flesh_folder_claim *claim);

/* Removes the temporary files of flesh_file_open (NAME.part-<process>-<number>) whose writers are gone; living writers
 * hold a lock on theirs. Also removes those of other programs that were called to write (NAME.part-<process><suffix>)
 * once that process is gone. */
void flesh_folder_clear(const char *path);
/* Removes the temporary files of one target whose writers are gone. */
void flesh_file_clear(const char *target);

#endif
