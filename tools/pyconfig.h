// pyconfig.h of CPython 3.11 to 3.13 for x86-64 Windows and arm64 macOS: what its headers ask of
// it. Python's own comes with its installers for these systems alone.
#ifndef Py_PYCONFIG_H
#define Py_PYCONFIG_H

#define ALIGNOF_MAX_ALIGN_T 16
#define HAVE_SSIZE_T 1
#define HAVE_STDDEF_H 1
#define HAVE_STDINT_H 1
#define HAVE_SYS_STAT_H 1
#define HAVE_SYS_TYPES_H 1
#define HAVE_WCHAR_H 1
#define SIZEOF_DOUBLE 8
#define SIZEOF_FLOAT 4
#define SIZEOF_INT 4
#define SIZEOF_LONG_LONG 8
#define SIZEOF_PID_T 4
#define SIZEOF_SHORT 2
#define SIZEOF_SIZE_T 8
#define SIZEOF_TIME_T 8
#define SIZEOF_VOID_P 8
#define WITH_DOC_STRINGS 1
#define WITH_PYMALLOC 1

#if defined(_WIN64) && defined(__x86_64__)
#define HAVE_DECLSPEC_DLL
#define MS_WIN32
#define MS_WIN64
#define MS_WINDOWS
#define NT_THREADS
#define Py_ENABLE_SHARED 1
#define SIZEOF_LONG 4
#define SIZEOF_WCHAR_T 2
#elif defined(__APPLE__) && defined(__aarch64__)
#define HAVE_CLOCK_GETTIME 1
#define HAVE_DLOPEN 1
#define HAVE_FORK 1
#define HAVE_PTHREAD_H 1
#define HAVE_SYS_SELECT_H 1
#define HAVE_SYS_TIME_H 1
#define HAVE_UNISTD_H 1
#define SIZEOF_LONG 8
#define SIZEOF_WCHAR_T 4
#else
#error "for x86-64 Windows and arm64 macOS"
#endif

#endif
