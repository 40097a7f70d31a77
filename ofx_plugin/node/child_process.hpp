// Starts programs beside the host. They get none of its open files, none of its variables for
// libraries and Python, and an empty input; their output is dropped, but for the errors. Depends
// neither on OpenFX nor on the core.
#pragma once

#include <memory>
#include <string>
#include <vector>

namespace palette4d::node {

/// A program that keeps running when its object goes, and when the host does.
class Child {
public:
    /// `arguments` begins with its path; all are UTF-8. Null where it cannot be started; `problem`
    /// then says why.
    static std::unique_ptr<Child> start(const std::vector<std::string>& arguments,
                                        std::string& problem);
    ~Child();
    Child(const Child&) = delete;
    Child& operator=(const Child&) = delete;

    /// Returns at once.
    bool running();
    /// Once it has ended: whether it is known to have failed, and its last line on standard error.
    bool failed() const;
    std::string last_words() const;
    /// Ends it and what it has started.
    void stop();

private:
    struct System;
    explicit Child(std::unique_ptr<System> system);
    std::unique_ptr<System> system_;
};

}  // namespace palette4d::node
