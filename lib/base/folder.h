/* folder.h: folders of results: made, claimed by one process at a time, and cleared of what killed ones left. */
#ifndef FLESH_BASE_FOLDER_H
#define FLESH_BASE_FOLDER_H

/* Makes the folder and its parents; fine when it is there. FLESH_ERR_FILE when it cannot be made,
 * is a file or cannot be written into. */
int flesh_folder_make(const char *path);

/* A folder that this process alone fills. */
typedef struct flesh_folder_claim {
  char *path;     /* of the lock file; NULL: none is held */
  int descriptor; /* whose lock ends with the process, however that ends */
  int made;       /* the folder was not there before */
} flesh_folder_claim;

/* Makes the folder, locks the file .flesh.lock in it, which holds `who` for others to read, and clears the folder
 * (flesh_folder_clear). Waits up to `patience` seconds for another process that has it: a killed one holds its lock
 * until it has ended, and so do its children. FLESH_ERR_FILE when that is not enough, with the other's words. A lock
 * file without a lock holds nobody up. Where a file system knows no locks, the folder is not guarded. */
int flesh_folder_claim_take(const char *path, const char *who, double patience, flesh_folder_claim *claim);
/* Removes the lock file, and the folder where the claim has made it and it is empty; harmless without a claim. */
void flesh_folder_claim_release(flesh_folder_claim *claim);

/* Removes the temporary files of flesh_file_open (NAME.part-<process>-<number>) whose writers are gone; those of living
 * writers are locked. And those of programs that are called to write (NAME.part-<process><suffix>), once no such
 * process lives. */
void flesh_folder_clear(const char *path);
/* Removes the temporary files of one target whose writers are gone. */
void flesh_file_clear(const char *target);

#endif
