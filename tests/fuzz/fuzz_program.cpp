// Any bytes as the file that names the Python of the node's buttons: a path, or a sentence.
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <string>

#include "fuzz.hpp"
#include "program_file.hpp"

std::string outcome_of(const std::uint8_t* data, std::size_t size) {
    using namespace palette4d::node;
    const std::string text(reinterpret_cast<const char*>(data), size);
    const ProgramPath found = parse_program(text);
    bool plain = true;
    for (const char c : found.path + found.problem) plain &= static_cast<unsigned char>(c) >= 0x20;
    const bool path = !found.path.empty() && found.path[0] == '/' &&
                      found.path.size() <= kMaxProgramBytes && text.rfind(found.path, 0) == 0;
    if (!plain || path == !found.problem.empty()) {
        std::cerr << "fuzz_program: " << found.path << "; " << found.problem << std::endl;
        std::abort();
    }
    return path ? "accepted" : kind_of(found.problem);
}
