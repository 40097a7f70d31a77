// Loads a system's library at run time.
#pragma once

#include <initializer_list>
#include <string>

#if defined(_WIN32)
#define PALETTE4D_API __stdcall
#else
#define PALETTE4D_API
#endif

namespace palette4d::gpu {

/// The first library that can be loaded, for the life of the process; null for none. One that the
/// host has loaded comes first.
void* load_library(std::initializer_list<const char*> names);
/// Its function; null where it has none.
void* function_of(void* library, const char* name);

/// Base of a system's functions, which are members by their names.
struct Functions {
    explicit Functions(void* from) : library(from), complete(from) {}
    void* library;
    bool complete;  ///< whether the library and all functions were found

    template <class Function>
    Function find(const char* name) {
        const auto found = library ? function_of(library, name) : nullptr;
        complete = complete && found;
        return reinterpret_cast<Function>(found);
    }
};
#define PALETTE4D_FUNCTION(result, name, ...) \
    result(PALETTE4D_API* name)(__VA_ARGS__) = find<result(PALETTE4D_API*)(__VA_ARGS__)>(#name)

/// What *Status* says of a driver's error.
inline std::string driver_error(const char* function, long error) {
    return std::string(function) + " failed with error " + std::to_string(error);
}

}  // namespace palette4d::gpu
