// On Linux a library must itself destroy its static objects when a host unloads it; otherwise they
// are destroyed at the host's end, by code that is gone. GCC's start files call this, zig's do not.
// A second call does nothing.
#if defined(__linux__)
extern "C" void __cxa_finalize(void* library);
extern "C" __attribute__((visibility("hidden"))) void* __dso_handle;

namespace {
__attribute__((destructor)) void destroy_statics() { __cxa_finalize(&__dso_handle); }
}  // namespace
#endif
