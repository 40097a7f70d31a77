#include "gpu/library.hpp"

#if defined(_WIN32)
#define NOMINMAX
#include <windows.h>
#else
#include <dlfcn.h>
#endif

namespace palette4d::gpu {

#if defined(_WIN32)
void* load_library(std::initializer_list<const char*> names) {
    for (const char* name : names) {
        // From the system's folder alone: not from the host's working folder.
        if (void* found = LoadLibraryExA(name, nullptr, LOAD_LIBRARY_SEARCH_SYSTEM32)) return found;
    }
    return nullptr;
}

void* function_of(void* library, const char* name) {
    return reinterpret_cast<void*>(GetProcAddress(static_cast<HMODULE>(library), name));
}
#else
void* load_library(std::initializer_list<const char*> names) {
    for (const int flags : {RTLD_NOW | RTLD_NOLOAD, RTLD_NOW}) {
        for (const char* name : names) {
            if (void* found = dlopen(name, flags)) return found;
        }
    }
    return nullptr;
}

void* function_of(void* library, const char* name) { return dlsym(library, name); }
#endif

}  // namespace palette4d::gpu
