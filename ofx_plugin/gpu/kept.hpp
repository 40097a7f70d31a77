// What is kept for the contexts of a system: the last ones used, each with the error that ended its
// use.
#pragma once

#include <cstddef>
#include <list>
#include <memory>
#include <mutex>
#include <new>
#include <set>
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

    /// The key's value for a node, made by make() where there is none.
    template <class Make>
    std::shared_ptr<Value> get(const Key& key, const void* node, Make make) {
        const std::lock_guard<std::mutex> lock(mutex_);
        auto at = all_.begin();
        while (at != all_.end() && at->key != key) ++at;
        if (at == all_.end()) at = all_.insert(at, {key, make(), {}});
        all_.splice(all_.begin(), all_, at);
        if (all_.size() > kMost) all_.pop_back();
        all_.front().nodes.insert(node);
        return all_.front().value;
    }
    /// Drops what no other node has used.
    void leave(const void* node) {
        const std::lock_guard<std::mutex> lock(mutex_);
        all_.remove_if([&](One& one) { return one.nodes.erase(node) > 0 && one.nodes.empty(); });
    }
    void clear() {
        const std::lock_guard<std::mutex> lock(mutex_);
        all_.clear();
    }

private:
    struct One {
        Key key;
        std::shared_ptr<Value> value;
        std::set<const void*> nodes;
    };
    std::mutex mutex_;
    std::list<One> all_;
};

}  // namespace palette4d::gpu
