/* Mutual exclusion of the threads of a process, for the list of maps in map.c. Initialized statically, so that no call
   has to come first. Windows and POSIX have a lock that lets a waiting thread sleep. Elsewhere, or with
   BALLSCREW_SPIN_LOCK, a waiting thread spins. With BALLSCREW_NO_THREADS, or without atomic operations of the compiler,
   there is no lock: instances must then be created and freed by one thread. */
#ifndef BALLSCREW_LOCK_H
#define BALLSCREW_LOCK_H

#if defined(BALLSCREW_NO_THREADS)
#define LOCK_KIND_NONE
#elif defined(_WIN32) && !defined(BALLSCREW_SPIN_LOCK)
#define LOCK_KIND_WINDOWS
#elif (defined(__unix__) || defined(__APPLE__)) && !defined(BALLSCREW_SPIN_LOCK)
#define LOCK_KIND_POSIX
#elif defined(__GNUC__)
#define LOCK_KIND_BUILTIN
#else
#define LOCK_KIND_NONE
#endif

#if defined(LOCK_KIND_WINDOWS)

#include <windows.h>
typedef SRWLOCK Lock;
#define LOCK_OPEN SRWLOCK_INIT
static inline void lock_enter(Lock *lock) { AcquireSRWLockExclusive(lock); }
static inline void lock_leave(Lock *lock) { ReleaseSRWLockExclusive(lock); }

#elif defined(LOCK_KIND_POSIX)

#include <pthread.h>
typedef pthread_mutex_t Lock;
#define LOCK_OPEN PTHREAD_MUTEX_INITIALIZER
static inline void lock_enter(Lock *lock) { (void)pthread_mutex_lock(lock); }
static inline void lock_leave(Lock *lock) { (void)pthread_mutex_unlock(lock); }

#elif defined(LOCK_KIND_BUILTIN)

typedef char Lock;
#define LOCK_OPEN 0
static inline void lock_enter(Lock *lock)
{
    while (__atomic_test_and_set(lock, __ATOMIC_ACQUIRE)) {
    }
}
static inline void lock_leave(Lock *lock) { __atomic_clear(lock, __ATOMIC_RELEASE); }

#else

typedef char Lock;
#define LOCK_OPEN 0
static inline void lock_enter(Lock *lock) { (void)lock; }
static inline void lock_leave(Lock *lock) { (void)lock; }

#endif

#endif
