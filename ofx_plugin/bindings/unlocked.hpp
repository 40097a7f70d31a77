// Python's lock, released while the core works.
#pragma once

#include <pybind11/pybind11.h>

#include <chrono>
#include <thread>

namespace palette4d::bindings {

/// Other threads of Python run while this lives.
///
/// Python before 3.14 ends a thread that takes the lock after the interpreter has ended. With glibc
/// that unwinds its stack, which py::gil_scoped_release does not let pass: std::terminate() ended
/// programs whose daemon threads recoloured a picture as they left. Here such a thread waits for
/// the end of the process, as it does in later Pythons.
class Unlocked {
public:
    Unlocked() : state_(PyEval_SaveThread()) {}
    Unlocked(const Unlocked&) = delete;
    Unlocked& operator=(const Unlocked&) = delete;

    ~Unlocked() noexcept(false) {
        Waiting unless_locked;
        PyEval_RestoreThread(state_);
        unless_locked.waits = false;
    }

private:
    struct Waiting {
        bool waits = true;
        ~Waiting() {
            while (waits) std::this_thread::sleep_for(std::chrono::hours(1));
        }
    };

    PyThreadState* state_;
};

}  // namespace palette4d::bindings
