/* status.h: the status codes of all functions, and the text of the last error.
 *
 * The sign follows SUNDIALS: 0 success; > 0 recoverable (nothing was modified, a shorter step or another state may
 * succeed); < 0 fatal. The library never prints and never exits. Floating-point traps (feenableexcept) must be off in
 * threads that call it: it computes with infinities and NaN, also in unused lanes of vectors. Functions that return
 * no status cannot fail. */
#ifndef FLESH_STATUS_H
#define FLESH_STATUS_H

#if defined(__GNUC__)
#define FLESH_API __attribute__((visibility("default")))
#else
#define FLESH_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* X(name, value, text): the one list from which the enum and the texts are made. */
#define FLESH_STATUS_LIST(X)                                                                       \
  X(FLESH_OK, 0, "success")                                                                        \
  X(FLESH_UNDEFINED, 1, "the energy is undefined at this state (J <= 0, or within an obstacle)")   \
  X(FLESH_NONFINITE, 2, "a number is not finite")                                                  \
  X(FLESH_NOT_CONVERGED, 3, "the iteration limit was reached before the tolerance")                \
  X(FLESH_NOT_POSITIVE, 4, "the matrix is not positive definite")                                  \
  X(FLESH_ERR_ARGUMENT, -1, "invalid argument or scene")                                           \
  X(FLESH_ERR_MEMORY, -2, "out of memory")                                                         \
  X(FLESH_ERR_FILE, -3, "invalid or unreadable file or mesh")                                      \
  X(FLESH_ERR_SOLVE, -4, "the nonlinear solve failed")                                             \
  X(FLESH_ERR_INTEGRATOR, -5, "the time integrator failed")                                        \
  X(FLESH_ERR_BUDGET, -6, "the budget is spent")                                                   \
  X(FLESH_ERR_NONFINITE, -7, "a non-finite number ended the run")                                  \
  X(FLESH_ERR_INTERRUPTED, -8, "interrupted")                                                      \
  X(FLESH_ERR_SUNDIALS, -9, "a SUNDIALS function failed")                                          \
  X(FLESH_ERR_ENERGY, -10, "the energy grew although nothing put it in")

typedef enum flesh_status {
#define FLESH_STATUS_ENUM(name, value, text) name = value,
  FLESH_STATUS_LIST(FLESH_STATUS_ENUM)
#undef FLESH_STATUS_ENUM
} flesh_status;

/* Return the name ("FLESH_UNDEFINED") and the one-line meaning of a status; never NULL. */
FLESH_API const char *flesh_status_name(int status);
FLESH_API const char *flesh_status_text(int status);

/* Returns the text of the last failure in this thread: one sentence that says where, what, and what would be valid
 * ("scene.yaml:12:9: body.material.poisson is 0.6; it must be a number in (-1, 0.5]"). One line of printable UTF-8:
 * '?' replaces any other byte in quoted names. Empty when nothing has failed. A positive status mostly leaves the
 * text unchanged: flesh_status_text() gives its meaning. Owned by the library, overwritten by the thread's next
 * failure. */
FLESH_API const char *flesh_error_text(void);

/* A function that receives every such sentence when it is recorded, with its status; `text` is valid during the call,
 * in which flesh_error_text() is the same. If a caller within the library adds a place to a sentence (file, line,
 * key), the longer sentence is passed again. A positive status is recoverable (by a shorter step); programs that log
 * may ignore it. */
typedef void (*flesh_error_handler)(void *data, int status, const char *text);

/* Sets the handler, one for the whole process; NULL: none, as at the start. `data` is borrowed. May be called at any
 * time from any thread, also by a handler. A handler is called in the thread that failed, which may be one of the
 * library's, and by several threads at once; it must not leave by longjmp or an exception. A failure within a handler
 * calls no handler, and leaves flesh_error_text() unchanged. When this function returns, another thread may still be
 * in the previous handler. */
FLESH_API void flesh_set_error_handler(flesh_error_handler handler, void *data);

#ifdef __cplusplus
}
#endif
#endif
