// Any bytes as the copy of a sidecar that a project keeps, in the node as a host runs it: it never
// fails, it passes the picture through or edits it, and what it says cannot act on a terminal.
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>
#include <utility>

#include "fuzz.hpp"
#include "strict_host.hpp"

namespace {

using namespace strict;

[[noreturn]] void fail(const std::string& what) {
    std::cerr << "fuzz_node: " << what << std::endl;
    std::abort();
}

void check(const std::string& said) {
    for (const char c : said) {
        if (static_cast<unsigned char>(c) < 0x20 && c != '\n') fail("a control character is said");
    }
}

class Project {
public:
    Project() {
        for (int i = 0; i < 16; ++i) source_.floats(i % 4, i / 4)[i % 3] = 0.1f * float(i) - 0.3f;
        // A file that is missing, as on another machine.
        node_->set("sidecar", std::string("/nowhere/clip.p4d.json"));
        node_->set("embed", 1);
    }

    std::string open(std::string copy) {
        node_->set("embedded", std::move(copy));
        if (node_->changed("sidecar") != kOfxStatOK) fail("the change");
        for (const double time : {0.0, 7.5, 40.0}) {
            Picture output(layout_);
            if (node_->render(time, &source_, output, layout_.bounds) != kOfxStatOK) {
                fail("the render");
            }
        }
        for (const std::string& fault : Host::get().take_faults()) fail(fault);
        const std::string& problem = node_->effect().persistent_message;
        check(problem);
        check(node_->text("status"));
        return problem;
    }

private:
    Layout layout_ = [] {
        Layout layout;
        layout.bounds = {0, 0, 4, 4};
        return layout;
    }();
    Picture source_{layout_, 0};
    Plugin plugin_{PALETTE4D_BUNDLE};
    std::unique_ptr<Instance> node_ = plugin_.create();
};

}  // namespace

std::string outcome_of(const std::uint8_t* data, std::size_t size) {
    // Never destroyed: the host's thread-local state ends before statics do.
    static Project& project = *new Project;
    const std::string problem =
        project.open(std::string(reinterpret_cast<const char*>(data), size));
    if (problem.empty()) return "accepted";
    return kind_of(problem.substr(problem.rfind("expected") + 1));
}
