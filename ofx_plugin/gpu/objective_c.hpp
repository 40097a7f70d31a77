// The Objective-C runtime, loaded at run time: messages to objects, without its language.
#pragma once

#include "gpu/library.hpp"

namespace palette4d::gpu {

struct ObjectiveC : Functions {
    using Handle = void*;
    using Functions::Functions;
    PALETTE4D_FUNCTION(Handle, objc_getClass, const char*);
    PALETTE4D_FUNCTION(Handle, object_getClass, Handle);
    PALETTE4D_FUNCTION(Handle, sel_registerName, const char*);
    PALETTE4D_FUNCTION(void*, class_getMethodImplementation, Handle, Handle);

    /// Arguments must have exactly the types of the method. Null answers with nothing, as in the
    /// language.
    template <class Result = Handle, class... Arguments>
    Result send(Handle object, const char* selector, Arguments... arguments) const {
        if (!object) return Result();
        const Handle name = sel_registerName(selector);
        const auto method = reinterpret_cast<Result (*)(Handle, Handle, Arguments...)>(
            class_getMethodImplementation(object_getClass(object), name));
        return method(object, name, arguments...);
    }
};

}  // namespace palette4d::gpu
