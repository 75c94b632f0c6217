/* path.h: paths for the next call or the next few. */
#ifndef FLESH_CLI_PATH_H
#define FLESH_CLI_PATH_H

/* A path as printf prints it, in one of this thread's rooms, which the FLESH_PATHS-th path after it takes: what is to last
 * longer is copied. One that is longer than the system takes is cut where the system refuses it still. */
enum { FLESH_PATHS = 16 };
const char *flesh_path(const char *format, ...) __attribute__((format(printf, 1, 2)));

#endif
