// The memory, multi-thread and message suites.
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <set>
#include <thread>

#include "strict_host.hpp"

struct OfxMutex {
    std::recursive_mutex mutex;
};

namespace strict {
namespace {

// ---------------------------------------------------------------- memory

OfxStatus memory_alloc(void*, size_t bytes, void** data) {
    const Call call("memoryAlloc", true);
    if (call.refused()) return kOfxStatErrMemory;
    *data = std::malloc(bytes);
    return *data ? kOfxStatOK : kOfxStatErrMemory;
}
OfxStatus memory_free(void* data) {
    std::free(data);
    return kOfxStatOK;
}
const OfxMemorySuiteV1 kMemory = {memory_alloc, memory_free};

// ---------------------------------------------------------------- threads

thread_local unsigned t_index = 0;

OfxStatus multi_thread(OfxThreadFunctionV1 function, unsigned int count, void* argument) {
    const Call call("multiThread", true);
    if (call.refused()) return kOfxStatFailed;
    Host& host = Host::get();
    if (!function || count == 0) {
        host.fault("multiThread: no function or no threads");
        return kOfxStatFailed;
    }
    if (activity().worker) return kOfxStatErrExists;
    if (count > host.config().processors) count = host.config().processors;
    const std::string action = activity().action;
    std::vector<std::thread> threads;
    for (unsigned i = 0; i < count; ++i) {
        threads.emplace_back([=] {
            activity().action = action;
            activity().worker = true;
            t_index = i;
            function(i, count, argument);
        });
    }
    for (std::thread& thread : threads) thread.join();
    return kOfxStatOK;
}
OfxStatus processors(unsigned int* count) {
    const Call call("multiThreadNumCPUs", true);
    if (call.refused()) return kOfxStatFailed;
    *count = Host::get().config().processors;
    return kOfxStatOK;
}
OfxStatus thread_index(unsigned int* index) {
    *index = t_index;
    return kOfxStatOK;
}
int is_spawned() { return activity().worker ? 1 : 0; }
OfxStatus mutex_create(OfxMutexHandle* mutex, int locks) {
    *mutex = new OfxMutex;
    for (int i = 0; i < locks; ++i) (*mutex)->mutex.lock();
    return kOfxStatOK;
}
OfxStatus mutex_destroy(const OfxMutexHandle mutex) {
    delete mutex;
    return kOfxStatOK;
}
OfxStatus mutex_lock(const OfxMutexHandle mutex) {
    mutex->mutex.lock();
    return kOfxStatOK;
}
OfxStatus mutex_unlock(const OfxMutexHandle mutex) {
    mutex->mutex.unlock();
    return kOfxStatOK;
}
OfxStatus mutex_try(const OfxMutexHandle mutex) {
    return mutex->mutex.try_lock() ? kOfxStatOK : kOfxStatFailed;
}
const OfxMultiThreadSuiteV1 kThreads = {multi_thread, processors,   thread_index,
                                        is_spawned,   mutex_create, mutex_destroy,
                                        mutex_lock,   mutex_unlock, mutex_try};

// ---------------------------------------------------------------- messages

OfxStatus take(const char* function, void* handle, const char* type, const char* format,
               va_list arguments, bool persistent) {
    const Call call(function);
    if (call.refused()) return kOfxStatFailed;
    static const std::set<std::string> types = {kOfxMessageFatal,   kOfxMessageError,
                                                kOfxMessageWarning, kOfxMessageMessage,
                                                kOfxMessageLog,     kOfxMessageQuestion};
    Host& host = Host::get();
    if (!handle || !type || !types.count(type) || !format) {
        host.fault(std::string(function) + ": no instance, no format or an unknown type");
        return kOfxStatErrBadHandle;
    }
    char text[4096];
    if (host.config().natron) {
        // It passes the list of arguments as if it were the first of them.
        const char* none = "";
        std::snprintf(text, sizeof text, format, none, none, none, none);
    } else {
        std::vsnprintf(text, sizeof text, format, arguments);
    }
    auto* effect = static_cast<OfxImageEffectStruct*>(handle);
    const std::lock_guard<std::mutex> lock(effect->mutex);
    effect->messages.emplace_back(text);
    if (persistent) effect->persistent_message = text;
    return kOfxStatOK;
}

OfxStatus message(void* handle, const char* type, const char*, const char* format, ...) {
    va_list arguments;
    va_start(arguments, format);
    const OfxStatus status = take("message", handle, type, format, arguments, false);
    va_end(arguments);
    return status;
}
OfxStatus persistent(void* handle, const char* type, const char*, const char* format, ...) {
    va_list arguments;
    va_start(arguments, format);
    const OfxStatus status = take("setPersistentMessage", handle, type, format, arguments, true);
    va_end(arguments);
    return status;
}
OfxStatus clear(void* handle) {
    const Call call("clearPersistentMessage");
    if (call.refused() || !handle) return kOfxStatFailed;
    auto* effect = static_cast<OfxImageEffectStruct*>(handle);
    const std::lock_guard<std::mutex> lock(effect->mutex);
    effect->persistent_message.clear();
    return kOfxStatOK;
}
const OfxMessageSuiteV1 kMessages = {message};
const OfxMessageSuiteV2 kMessages2 = {message, persistent, clear};

// ---------------------------------------------------------------- progress

OfxStatus progress(const char* function, void* handle, bool starts, double share) {
    const Call call(function);
    if (call.refused()) return kOfxStatFailed;
    auto* effect = static_cast<OfxImageEffectStruct*>(handle);
    if (!effect || effect->in_progress == starts || !(share >= 0 && share <= 1)) {
        Host::get().fault(std::string(function) + ": no instance, out of turn, or beyond 0 to 1");
        return kOfxStatErrBadHandle;
    }
    return kOfxStatOK;
}
OfxStatus progress_start(void* handle, const char*) {
    const OfxStatus status = progress("progressStart", handle, true, 0);
    if (status == kOfxStatOK) static_cast<OfxImageEffectStruct*>(handle)->in_progress = true;
    return status;
}
OfxStatus progress_update(void* handle, double share) {
    const OfxStatus status = progress("progressUpdate", handle, false, share);
    if (status != kOfxStatOK) return status;
    auto& told = static_cast<OfxImageEffectStruct*>(handle)->progress;
    told.push_back(share);
    const int after = Host::get().config().cancel_after;
    return after >= 0 && static_cast<int>(told.size()) > after ? kOfxStatReplyNo : kOfxStatReplyYes;
}
OfxStatus progress_end(void* handle) {
    const OfxStatus status = progress("progressEnd", handle, false, 0);
    if (handle) static_cast<OfxImageEffectStruct*>(handle)->in_progress = false;
    return status;
}
const OfxProgressSuiteV1 kProgress = {progress_start, progress_update, progress_end};

}  // namespace

SuiteTable progress_suite() {
    using S = OfxProgressSuiteV1;
    return {&kProgress,
            sizeof kProgress,
            {{"progressStart", offsetof(S, progressStart)},
             {"progressUpdate", offsetof(S, progressUpdate)},
             {"progressEnd", offsetof(S, progressEnd)}}};
}
SuiteTable memory_suite() { return {&kMemory, sizeof kMemory, {}}; }
SuiteTable thread_suite() {
    using S = OfxMultiThreadSuiteV1;
    return {&kThreads,
            sizeof kThreads,
            {{"multiThread", offsetof(S, multiThread)},
             {"multiThreadNumCPUs", offsetof(S, multiThreadNumCPUs)}}};
}
SuiteTable message_suite_v1() {
    return {&kMessages, sizeof kMessages, {{"message", offsetof(OfxMessageSuiteV1, message)}}};
}
SuiteTable message_suite_v2() {
    using S = OfxMessageSuiteV2;
    return {&kMessages2,
            sizeof kMessages2,
            {{"message", offsetof(S, message)},
             {"setPersistentMessage", offsetof(S, setPersistentMessage)},
             {"clearPersistentMessage", offsetof(S, clearPersistentMessage)}}};
}

}  // namespace strict
