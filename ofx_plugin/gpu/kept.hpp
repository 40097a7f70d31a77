// What is kept for the contexts of a system: the last ones used, each with the error that ended its
// use.
#pragma once

#include <cstddef>
#include <list>
#include <memory>
#include <mutex>
#include <new>
#include <utility>

namespace palette4d::gpu {

/// A host may make contexts without end and tells of none that goes: so old ones are dropped.
template <class Key, class Value>
class Kept {
public:
    /// More than a machine has devices.
    static constexpr std::size_t kMost = 8;

    /// Never destroyed: at the end of a process the driver may be gone.
    static Kept& of_process() {
        alignas(Kept) static unsigned char place[sizeof(Kept)];
        static auto* const all = new (place) Kept;
        return *all;
    }

    /// The key's value, made by make() where there is none.
    template <class Make>
    std::shared_ptr<Value> get(const Key& key, Make make) {
        const std::lock_guard<std::mutex> lock(mutex_);
        for (auto at = all_.begin(); at != all_.end(); ++at) {
            if (at->first != key) continue;
            all_.splice(all_.begin(), all_, at);
            return all_.front().second;
        }
        all_.emplace_front(key, make());
        if (all_.size() > kMost) all_.pop_back();
        return all_.front().second;
    }
    void clear() {
        const std::lock_guard<std::mutex> lock(mutex_);
        all_.clear();
    }

private:
    std::mutex mutex_;
    std::list<std::pair<Key, std::shared_ptr<Value>>> all_;
};

}  // namespace palette4d::gpu
