// A very small test harness: TEST registers, CHECK reports and goes on, main() runs everything.
// The exit status is 1 when a check failed, a test threw, or nothing was checked at all.
#pragma once

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <functional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace check {

struct Test {
    const char* name;
    void (*run)();
};

inline std::vector<Test>& tests() {
    static std::vector<Test> all;
    return all;
}

inline int& failures() {
    static int count = 0;
    return count;
}

inline int& checks() {
    static int count = 0;
    return count;
}

struct Registration {
    Registration(const char* name, void (*run)()) { tests().push_back({name, run}); }
};

inline void report(bool passed, const char* file, int line, const std::string& what) {
    ++checks();
    if (passed) return;
    // Enough to see what is wrong; a property that fails for every sample would drown it.
    if (++failures() <= 25) std::printf("%s:%d: %s\n", file, line, what.c_str());
}

template <class A, class B>
void equal(const A& found, const B& expected, const char* file, int line, const char* what) {
    std::ostringstream text;
    text.precision(17);
    text << what << ": found " << found << ", expected " << expected;
    report(found == expected, file, line, text.str());
}

inline void near(double found, double expected, double tolerance, const char* file, int line,
                 const char* what) {
    char text[256];
    std::snprintf(text, sizeof text, "%s: found %.17g, expected %.17g within %g", what, found,
                  expected, tolerance);
    report(std::abs(found - expected) <= tolerance, file, line, text);
}

template <class Exception, class Action>
void throws(Action action, const char* file, int line, const char* what,
            const std::function<void(const Exception&)>& look = {}) {
    try {
        action();
    } catch (const Exception& problem) {
        report(true, file, line, what);
        if (look) look(problem);
        return;
    }
    report(false, file, line, std::string(what) + ": nothing was thrown");
}

/// How often a test repeats itself with other numbers: a quarter as often where
/// PALETTE4D_FEW_ROUNDS is set, for the sanitizers, which are slow and look at memory, not at
/// numbers.
inline int rounds(int usual) {
    static const bool few = std::getenv("PALETTE4D_FEW_ROUNDS") != nullptr;
    return few ? (usual + 3) / 4 : usual;
}

inline int run_all() {
    for (const Test& test : tests()) {
        const int before = failures();
        try {
            test.run();
        } catch (const std::exception& problem) {
            report(false, test.name, 0, std::string("threw ") + problem.what());
        }
        std::printf("%s %s\n", failures() == before ? "ok  " : "FAIL", test.name);
    }
    std::printf("%zu tests, %d checks, %d failures\n", tests().size(), checks(), failures());
    return failures() == 0 && checks() > 0 ? 0 : 1;
}

}  // namespace check

#define TEST(name)                                                        \
    static void name();                                                   \
    static const check::Registration registration_of_##name(#name, name); \
    static void name()
#define CHECK(condition) check::report((condition), __FILE__, __LINE__, #condition)
#define CHECK_EQUAL(found, expected) check::equal((found), (expected), __FILE__, __LINE__, #found)
#define CHECK_NEAR(found, expected, tolerance) \
    check::near((found), (expected), (tolerance), __FILE__, __LINE__, #found)
#define CHECK_THROWS(Exception, ...) \
    check::throws<Exception>([&] { __VA_ARGS__; }, __FILE__, __LINE__, #__VA_ARGS__)
