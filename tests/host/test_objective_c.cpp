// Messages to objects, by GNU's Objective-C runtime: a class that is made here hears what the node
// says to Metal. Metal itself is not to be had on this system.
#include <cstddef>

#include "gpu/objective_c.hpp"
#include "harness.hpp"

using palette4d::gpu::function_of;
using palette4d::gpu::load_library;
using palette4d::gpu::ObjectiveC;

namespace {

using Handle = void*;
struct Three {
    std::size_t a, b, c;
};
struct Heard {
    Three one, two;
    std::size_t bytes = 0, index = 0;
};
Heard g_heard{};

void hear_structs(Handle, Handle, Three one, Three two) {
    g_heard.one = one;
    g_heard.two = two;
}
void hear_bytes(Handle, Handle, const void* bytes, std::size_t size, std::size_t index) {
    g_heard.bytes = size + static_cast<const unsigned char*>(bytes)[size - 1];
    g_heard.index = index;
}
Handle hear_error(Handle self, Handle, Handle, signed char flag, Handle* error) {
    *error = &g_heard;
    return flag ? nullptr : self;
}
long answer(Handle, Handle) { return -7; }

}  // namespace

TEST(objective_c_messages) {
    ObjectiveC objc(load_library({"libobjc.so.4"}));
    if (!objc.library) {
        test::figure("no Objective-C (Debian: libobjc4): not tested");
        return;
    }
    // A function of Apple's library, which GNU has in its header.
    objc.object_getClass = [](Handle object) { return *static_cast<Handle*>(object); };
    const auto get = [&](const char* name) { return function_of(objc.library, name); };
    const Handle kind = reinterpret_cast<Handle (*)(Handle, const char*, std::size_t)>(
        get("objc_allocateClassPair"))(nullptr, "Palette4DListener", 0);
    const auto add = [&](const char* selector, auto* method, const char* types) {
        reinterpret_cast<bool (*)(Handle, Handle, Handle, const char*)>(get("class_addMethod"))(
            kind, objc.sel_registerName(selector), reinterpret_cast<Handle>(method), types);
    };
    add("dispatchThreadgroups:threadsPerThreadgroup:", &hear_structs, "v@:{?=QQQ}{?=QQQ}");
    add("setBytes:length:atIndex:", &hear_bytes, "v@:^vQQ");
    add("newLibraryWithSource:options:error:", &hear_error, "@@:@c^@");
    add("code", &answer, "q@:");
    reinterpret_cast<void (*)(Handle)>(get("objc_registerClassPair"))(kind);
    CHECK(objc.objc_getClass("Palette4DListener") == kind);
    // A class without a root has no room for the pointer to its class: it gets it here.
    const Handle listener = reinterpret_cast<Handle (*)(Handle, std::size_t)>(
        get("class_createInstance"))(kind, sizeof(Handle));

    objc.send<void>(listener, "dispatchThreadgroups:threadsPerThreadgroup:", Three{1, 2, 3},
                    Three{4, 5, 6});
    CHECK(g_heard.one.a == 1 && g_heard.one.c == 3 && g_heard.two.a == 4 && g_heard.two.c == 6);
    const unsigned char bytes[] = {9, 8, 7};
    objc.send<void>(listener, "setBytes:length:atIndex:", static_cast<const void*>(bytes),
                    sizeof bytes, std::size_t{4});
    CHECK(g_heard.bytes == 10 && g_heard.index == 4);
    Handle error = nullptr;
    CHECK(objc.send(listener, "newLibraryWithSource:options:error:", listener, false, &error) ==
          listener);
    CHECK(error == &g_heard);
    CHECK(objc.send<long>(listener, "code") == -7);
    CHECK(objc.send<long>(nullptr, "code") == 0);
    reinterpret_cast<Handle (*)(Handle)>(get("object_dispose"))(listener);
}
