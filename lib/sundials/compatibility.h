/* compatibility.h: one spelling for SUNDIALS 6.4 (Debian 12) and 7.x (Debian 13). */
#ifndef FLESH_SUNDIALS_COMPATIBILITY_H
#define FLESH_SUNDIALS_COMPATIBILITY_H

#include "flesh/sundials_abi.h" /* before the headers that it checks */

#include <ida/ida.h>
#include <kinsol/kinsol.h>
#include <sundials/sundials_context.h>
#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_nonlinearsolver.h>
#include <sundials/sundials_version.h>

#if SUNDIALS_VERSION_MAJOR >= 7
#define FLESH_SUN_SUCCESS SUN_SUCCESS
#define FLESH_SUNLS_FATAL SUN_ERR_EXT_FAIL
#define FLESH_SUNNLS_FATAL SUN_ERR_EXT_FAIL
/* Makes a context of the library's own. It has no logger: from 7.2 on KINSOL formats its messages with malloc in every
 * iteration, whether or not anybody reads them. (Logging level 5 prints vectors without asking for a logger.) */
static inline int flesh_suncontext_create(SUNContext *context)
{
  const int failed = SUNContext_Create(SUN_COMM_NULL, context);
#if SUNDIALS_LOGGING_LEVEL < 5
  if (!failed) SUNContext_SetLogger(*context, NULL);
#endif
  return failed;
}
/* Stops KINSOL from printing: failures are returned as statuses. */
static inline void flesh_sundials_silence(SUNContext context, void *kinsol)
{
  (void)kinsol;
  SUNContext_ClearErrHandlers(context);
}
static inline void flesh_ida_silence(SUNContext context, void *ida)
{
  (void)ida;
  SUNContext_ClearErrHandlers(context);
}
#else
#define FLESH_SUN_SUCCESS 0
#define FLESH_SUNLS_FATAL SUNLS_PACKAGE_FAIL_UNREC
#define FLESH_SUNNLS_FATAL SUN_NLS_EXT_FAIL
static inline int flesh_suncontext_create(SUNContext *context)
{
  return SUNContext_Create(NULL, context);
}
static inline void flesh_sundials_ignore(int code, const char *module, const char *function,
                                         char *message, void *data)
{
  (void)code, (void)module, (void)function, (void)message, (void)data;
}
static inline void flesh_sundials_silence(SUNContext context, void *kinsol)
{
  (void)context;
  if (kinsol) KINSetErrHandlerFn(kinsol, flesh_sundials_ignore, NULL);
}
static inline void flesh_ida_silence(SUNContext context, void *ida)
{
  (void)context;
  if (ida) IDASetErrHandlerFn(ida, flesh_sundials_ignore, NULL);
}
#endif

#endif
