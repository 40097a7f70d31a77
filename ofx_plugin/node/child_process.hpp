// Starts programs beside the host. They get none of its open files, none of its variables for
// libraries and Python, and an empty input; their output is dropped. Depends neither on OpenFX nor
// on the core.
#pragma once

#include <memory>
#include <string>
#include <vector>

namespace palette4d::node {

/// Starts a program that outlives the host and is never waited for. `arguments` begins with its
/// path; all are UTF-8. Returns what went wrong, or nothing.
std::string start_detached(const std::vector<std::string>& arguments);

/// A program whose end matters. It keeps running when its object goes.
class Child {
public:
    /// Null where it cannot be started; `problem` then says why.
    static std::unique_ptr<Child> start(const std::vector<std::string>& arguments,
                                        std::string& problem);
    ~Child();
    Child(const Child&) = delete;
    Child& operator=(const Child&) = delete;

    /// Returns at once.
    bool running();
    /// Ends it and what it has started.
    void stop();

private:
    struct System;
    explicit Child(std::unique_ptr<System> system);
    std::unique_ptr<System> system_;
};

}  // namespace palette4d::node
