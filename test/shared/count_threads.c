/* count_threads.c: counts the threads that a test program creates; linked in place of pthread_create (--wrap) in the
 * program and the static library. */
#include <pthread.h>

_Atomic int test_threads;

int __real_pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*work)(void *), void *data);
int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*work)(void *), void *data);

int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*work)(void *), void *data)
{
  test_threads++;
  return __real_pthread_create(thread, attributes, work, data);
}
