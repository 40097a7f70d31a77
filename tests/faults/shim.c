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
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

enum { KILL = 0, KILL_HALFWAY = -1, NOTHING = -2 };

static char root[4096], names[65536];
static long at, count;
static int what = NOTHING, lasting, no_locks;

/* Fail call number `number` (from 1) below `folder`: `action` is one of the above or an errno. */
void faults_begin(const char* folder, long number, int action, int stays, int without_locks) {
    snprintf(root, sizeof root, "%s", folder);
    at = number;
    count = 0;
    names[0] = 0;
    what = action;
    lasting = stays;
    no_locks = without_locks;
}

/* The names of the calls so far, a line each. */
const char* faults_names(void) { return names; }

static int below(const char* path) {
    return root[0] && path && (path[0] != '/' || !strncmp(path, root, strlen(root)));
}

static int below_handle(int handle) {
    char link[64], path[4096];
    if (!root[0]) return 0;
    if (handle == AT_FDCWD) return 1;
    snprintf(link, sizeof link, "/proc/self/fd/%d", handle);
    const ssize_t size = readlink(link, path, sizeof path - 1);
    if (size < 0) return 0;
    path[size] = 0;
    return path[0] == '/' && below(path);
}

static int below_at(int folder, const char* path) {
    return path && path[0] == '/' ? below(path) : below_handle(folder);
}

/* Whether this call fails; errno is set. */
static int fails(const char* name) {
    ++count;
    const size_t used = strlen(names);
    snprintf(names + used, sizeof names - used, "%s\n", name);
    if (what == NOTHING || count < at || (count > at && !(lasting && what > 0))) return 0;
    /* A full disk lets files go. */
    if (what == ENOSPC && (strstr(name, "unlink") || strstr(name, "rmdir"))) return 0;
    if (what == KILL) raise(SIGKILL);
    if (what <= 0) return what;
    errno = what;
    return 1;
}

#define REAL(name) __typeof__(&name) real = (__typeof__(&name))dlsym(RTLD_NEXT, #name)

/* A call that is done whole or not at all: killed halfway is killed just after it. */
#define WHOLE(type, name, parameters, arguments, counts) \
    type name parameters {                               \
        REAL(name);                                      \
        if (counts) {                                    \
            const int found = fails(#name);              \
            if (found == KILL_HALFWAY) {                 \
                (void)!real arguments;                   \
                raise(SIGKILL);                          \
            }                                            \
            if (found) return -1;                        \
        }                                                \
        return real arguments;                           \
    }

WHOLE(int, rename, (const char* from, const char* to), (from, to), below(to))
WHOLE(int, renameat, (int a, const char* from, int b, const char* to), (a, from, b, to),
      below_at(b, to))
WHOLE(int, mkdir, (const char* path, mode_t mode), (path, mode), below(path))
WHOLE(int, mkdirat, (int a, const char* path, mode_t mode), (a, path, mode), below_at(a, path))
WHOLE(int, rmdir, (const char* path), (path), below(path))
WHOLE(int, unlink, (const char* path), (path), below(path))
WHOLE(int, unlinkat, (int a, const char* path, int flags), (a, path, flags), below_at(a, path))
WHOLE(int, symlink, (const char* to, const char* path), (to, path), below(path))
WHOLE(int, symlinkat, (const char* to, int a, const char* path), (to, a, path), below_at(a, path))
WHOLE(int, link, (const char* from, const char* path), (from, path), below(path))
WHOLE(int, linkat, (int a, const char* from, int b, const char* path, int flags),
      (a, from, b, path, flags), below_at(b, path))
WHOLE(int, chmod, (const char* path, mode_t mode), (path, mode), below(path))
WHOLE(int, fchmod, (int handle, mode_t mode), (handle, mode), below_handle(handle))
WHOLE(int, fchmodat, (int a, const char* path, mode_t mode, int flags), (a, path, mode, flags),
      below_at(a, path))
WHOLE(int, fsync, (int handle), (handle), below_handle(handle))
WHOLE(int, fdatasync, (int handle), (handle), below_handle(handle))
WHOLE(int, ftruncate, (int handle, off_t size), (handle, size), below_handle(handle))
WHOLE(int, ftruncate64, (int handle, off64_t size), (handle, size), below_handle(handle))

/* A call that can be done in part. */
#define IN_PART(name, parameters, arguments, half) \
    ssize_t name parameters {                      \
        REAL(name);                                \
        if (below_handle(handle)) {                \
            const int found = fails(#name);        \
            if (found == KILL_HALFWAY) {           \
                (void)!real half;                  \
                raise(SIGKILL);                    \
            }                                      \
            if (found) return -1;                  \
        }                                          \
        return real arguments;                     \
    }

IN_PART(write, (int handle, const void* data, size_t size), (handle, data, size),
        (handle, data, size / 2))
IN_PART(pwrite, (int handle, const void* data, size_t size, off_t to), (handle, data, size, to),
        (handle, data, size / 2, to))
IN_PART(pwrite64, (int handle, const void* data, size_t size, off64_t to), (handle, data, size, to),
        (handle, data, size / 2, to))
IN_PART(writev, (int handle, const struct iovec* parts, int number), (handle, parts, number),
        (handle, parts, number / 2))
IN_PART(sendfile, (int handle, int from, off_t* start, size_t size), (handle, from, start, size),
        (handle, from, start, size / 2))
IN_PART(sendfile64, (int handle, int from, off64_t* start, size_t size),
        (handle, from, start, size), (handle, from, start, size / 2))
IN_PART(copy_file_range,
        (int from, off64_t* start, int handle, off64_t* to, size_t size, unsigned flags),
        (from, start, handle, to, size, flags), (from, start, handle, to, size / 2, flags))

/* Streams of the C library, whose buffer is written where it likes: here with each call. */
size_t fwrite(const void* data, size_t size, size_t number, FILE* stream) {
    REAL(fwrite);
    if (root[0] && size && number && below_handle(fileno(stream))) {
        const int found = fails("fwrite");
        if (found == KILL_HALFWAY) {
            real(data, 1, size * number / 2, stream);
            fflush(stream);
            raise(SIGKILL);
        }
        if (found) return 0;
    }
    return real(data, size, number, stream);
}

#define ON_STREAM(name)                                                  \
    FILE* name(const char* path, const char* mode) {                     \
        REAL(name);                                                      \
        const int changes = strpbrk(mode, "wa+") != NULL && below(path); \
        const int found = changes ? fails(#name) : 0;                    \
        if (found > 0) return NULL;                                      \
        FILE* stream = real(path, mode);                                 \
        if (found == KILL_HALFWAY) raise(SIGKILL);                       \
        if (changes && stream) setvbuf(stream, NULL, _IONBF, 0);         \
        return stream;                                                   \
    }

ON_STREAM(fopen)
ON_STREAM(fopen64)

#define ON_OPEN(name, parameters, arguments, counts)                                    \
    int name parameters {                                                               \
        REAL(name);                                                                     \
        va_list rest;                                                                   \
        va_start(rest, flags);                                                          \
        const mode_t mode = flags & (O_CREAT | __O_TMPFILE) ? va_arg(rest, mode_t) : 0; \
        va_end(rest);                                                                   \
        const int found = (flags & (O_CREAT | O_TRUNC)) && (counts) ? fails(#name) : 0; \
        if (found > 0) return -1;                                                       \
        const int handle = real arguments;                                              \
        if (found == KILL_HALFWAY) raise(SIGKILL);                                      \
        return handle;                                                                  \
    }

ON_OPEN(open, (const char* path, int flags, ...), (path, flags, mode), below(path))
ON_OPEN(open64, (const char* path, int flags, ...), (path, flags, mode), below(path))
ON_OPEN(openat, (int a, const char* path, int flags, ...), (a, path, flags, mode),
        below_at(a, path))
ON_OPEN(openat64, (int a, const char* path, int flags, ...), (a, path, flags, mode),
        below_at(a, path))

int flock(int handle, int operation) {
    REAL(flock);
    if (no_locks && below_handle(handle)) {
        errno = ENOLCK;
        return -1;
    }
    return real(handle, operation);
}
