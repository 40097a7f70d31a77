/* Counts the calls that change files below a folder, and fails one of them: the process is killed
 * before it or in its middle, or it is refused. LD_PRELOAD puts it before the C library. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

enum { KILL = 0, KILL_HALFWAY = -1, NOTHING = -2 };

static char root[4096];
static long at, count;
static int what = NOTHING, lasting, no_locks;

/* Fail call number `number` (from 1) below `folder`: `action` is one of the above or an errno. */
void faults_begin(const char* folder, long number, int action, int stays, int without_locks) {
    snprintf(root, sizeof root, "%s", folder);
    at = number;
    count = 0;
    what = action;
    lasting = stays;
    no_locks = without_locks;
}

long faults_count(void) { return count; }

static int below(const char* path) {
    return root[0] && path && (path[0] != '/' || !strncmp(path, root, strlen(root)));
}

static int below_handle(int handle) {
    char link[64], path[4096];
    snprintf(link, sizeof link, "/proc/self/fd/%d", handle);
    const ssize_t size = readlink(link, path, sizeof path - 1);
    if (!root[0] || size < 0) return 0;
    path[size] = 0;
    return path[0] == '/' && below(path);
}

/* Whether this call fails; errno is set. */
static int fails(void) {
    ++count;
    if (what == NOTHING || count < at || (count > at && !(lasting && what > 0))) return 0;
    if (what == KILL) raise(SIGKILL);
    if (what <= 0) return what;
    errno = what;
    return 1;
}

#define REAL(name) __typeof__(&name) real = (__typeof__(&name))dlsym(RTLD_NEXT, #name)

#define ON_PATHS(name, parameters, arguments, path) \
    int name parameters {                           \
        REAL(name);                                 \
        if (below(path)) {                          \
            const int found = fails();              \
            if (found == KILL_HALFWAY) {            \
                real arguments;                     \
                raise(SIGKILL);                     \
            }                                       \
            if (found) return -1;                   \
        }                                           \
        return real arguments;                      \
    }

ON_PATHS(rename, (const char* from, const char* to), (from, to), to)
ON_PATHS(renameat, (int a, const char* from, int b, const char* to), (a, from, b, to), to)
ON_PATHS(mkdir, (const char* path, mode_t mode), (path, mode), path)
ON_PATHS(symlink, (const char* to, const char* path), (to, path), path)
ON_PATHS(link, (const char* from, const char* path), (from, path), path)

#define ON_HANDLES(name)                                          \
    int name(int handle) {                                        \
        REAL(name);                                               \
        if (below_handle(handle) && fails() > 0) return -1;       \
        return real(handle);                                      \
    }

ON_HANDLES(fsync)
ON_HANDLES(fdatasync)

ssize_t write(int handle, const void* data, size_t size) {
    REAL(write);
    if (below_handle(handle)) {
        const int found = fails();
        if (found == KILL_HALFWAY) {
            real(handle, data, size / 2);
            raise(SIGKILL);
        }
        if (found) return -1;
    }
    return real(handle, data, size);
}

#define ON_OPEN(name)                                                                 \
    int name(const char* path, int flags, ...) {                                      \
        REAL(name);                                                                   \
        va_list rest;                                                                 \
        va_start(rest, flags);                                                        \
        const mode_t mode = flags & (O_CREAT | __O_TMPFILE) ? va_arg(rest, mode_t) : 0; \
        va_end(rest);                                                                 \
        if ((flags & O_CREAT) && below(path) && fails() > 0) return -1;               \
        return real(path, flags, mode);                                               \
    }

ON_OPEN(open)
ON_OPEN(open64)

int flock(int handle, int operation) {
    REAL(flock);
    if (no_locks && below_handle(handle)) {
        errno = ENOLCK;
        return -1;
    }
    return real(handle, operation);
}
