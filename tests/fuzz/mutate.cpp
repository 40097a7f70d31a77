// TARGET --inputs N [--seed S] [--keep FOLDER] CORPUS…: N mutations of the files in the
// folders, the same for the same seed. An input whose outcome is new joins those that are mutated,
// and is kept in a file where asked for. A crash says which input it was: --only N makes it again.
#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "fuzz.hpp"

#if !defined(_WIN32)
#include <unistd.h>
#endif

namespace {

namespace fs = std::filesystem;

volatile unsigned long long g_input = 0;

extern "C" void crashed(int signal) {
    char text[64] = "crashed at input ";
    char digits[24];
    int count = 0;
    for (unsigned long long n = g_input; n || !count; n /= 10) {
        digits[count++] = static_cast<char>('0' + n % 10);
    }
    std::size_t at = std::strlen(text);
    while (count) text[at++] = digits[--count];
    text[at++] = '\n';
#if !defined(_WIN32)
    if (write(2, text, at) < 0) std::_Exit(3);
#endif
    std::signal(signal, SIG_DFL);
    std::raise(signal);
}

class Mutator {
public:
    explicit Mutator(std::uint64_t seed) : random_(seed) {}

    /// Half of them are one step away from what passes for a sidecar.
    std::string next(const std::vector<std::string>& corpus,
                     const std::vector<std::string>& accepted) {
        const bool near = !accepted.empty() && below(2);
        std::string text = near ? accepted[below(accepted.size())] : corpus[below(corpus.size())];
        const std::size_t steps = near ? 1 : 1 + below(below(8) ? 3 : 12);
        for (std::size_t i = 0; i < steps; ++i) mutate(text, corpus);
        if (text.size() > 65536) text.resize(65536);
        return text;
    }

private:
    std::size_t below(std::size_t n) { return n ? random_() % n : 0; }

    void mutate(std::string& text, const std::vector<std::string>& corpus) {
        static const std::vector<std::string> kTokens = {
            "{",          "}",         "[",         "]",
            ",",          ":",         "\"",        "null",
            "true",       "[]",        "{}",        "\"\"",
            "\\u0000",    "\\ud800",   "\xff",      "\xef\xbb\xbf",
            "//",         "NaN",       "Infinity",  "[[[[[[[[",
            "\"id\"",     "\"rgb\"",   "\"frame\"", "\"faces\"",
            "\"tracks\"", "\"stops\"", "\"edge\"",  "\"version\"",
            "\"ramp\"",   "\"hold\"",  "\"matte\"", "\"path\"",
            "\"radius\"", "\"areas\"", "\"picks\"", "\"smooth\"",
            "\"mattes\"", "\"grids\"", "eNrt",      "=="};
        static const std::vector<std::string> kNumbers = {
            "0",          "-0",          "1",
            "-1",         "2",           "3",
            "1e308",      "-1e308",      "1e309",
            "1e-320",     "0.5",         "2147483647",
            "2147483648", "-2147483649", "9223372036854775808",
            "1000000001", "4.9e-324",    "1.0000000000000002",
            "24.0",       "1e9",         "99999999999999999999999"};
        const std::size_t at = below(text.size() + 1);
        switch (below(8)) {
            case 0:
                if (at < text.size()) text[at] = static_cast<char>(random_());
                break;
            case 1:
                text.erase(at, below(1 + below(64)));
                break;
            case 2:
                text.insert(at, kTokens[below(kTokens.size())]);
                break;
            case 3: {
                const std::string span = text.substr(at, 1 + below(200));
                text.insert(below(text.size() + 1), span);
                break;
            }
            case 4: {
                const std::string& other = corpus[below(corpus.size())];
                const std::size_t from = below(other.size() + 1);
                text.replace(at, below(300), other, from, below(300));
                break;
            }
            default: {  // a number for a number: what passes the parser
                const std::size_t digit = text.find_first_of("0123456789", at);
                if (digit == std::string::npos) break;
                const std::size_t end = text.find_first_not_of("0123456789.eE+-", digit);
                const std::size_t length =
                    end == std::string::npos ? text.size() - digit : end - digit;
                text.replace(
                    digit, length,
                    below(3) ? kNumbers[below(kNumbers.size())] : std::to_string(below(40)));
                break;
            }
        }
    }

    std::mt19937_64 random_;
};

std::vector<std::string> read(const std::vector<std::string>& folders) {
    std::vector<fs::path> files;
    for (const std::string& folder : folders) {
        for (const auto& entry : fs::directory_iterator(folder)) {
            if (entry.is_regular_file()) files.push_back(entry.path());
        }
    }
    std::sort(files.begin(), files.end());
    std::vector<std::string> texts;
    for (const fs::path& path : files) {
        std::ifstream file(path, std::ios::binary);
        texts.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
    }
    return texts;
}

}  // namespace

int main(int argc, char** argv) {
    unsigned long long inputs = 0, only = ~0ull, seed = 1;
    std::string keep;
    std::vector<std::string> folders;
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        if (word == "--inputs" && i + 1 < argc) {
            inputs = std::strtoull(argv[++i], nullptr, 10);
        } else if (word == "--seed" && i + 1 < argc) {
            seed = std::strtoull(argv[++i], nullptr, 10);
        } else if (word == "--keep" && i + 1 < argc) {
            keep = argv[++i];
        } else if (word == "--only" && i + 1 < argc) {
            only = std::strtoull(argv[++i], nullptr, 10);
        } else {
            folders.push_back(word);
        }
    }
    std::vector<std::string> corpus = read(folders);
    if (corpus.empty() || inputs == 0) {
        std::cerr << "usage: " << argv[0] << " --inputs N [--seed S] [--keep FOLDER] CORPUS...\n";
        return 2;
    }
    for (const int signal : {SIGSEGV, SIGABRT, SIGFPE, SIGILL}) std::signal(signal, crashed);
    const auto bytes = [](const std::string& text) {
        return reinterpret_cast<const std::uint8_t*>(text.data());
    };
    std::set<std::string> outcomes;
    unsigned long long accepted = 0;
    std::vector<std::string> passing;
    for (const std::string& text : corpus) {
        const std::string outcome = outcome_of(bytes(text), text.size());
        outcomes.insert(outcome);
        if (outcome == "accepted") passing.push_back(text);
    }
    Mutator mutator(seed);
    for (g_input = 0; g_input < inputs; g_input = g_input + 1) {
        const std::string text = mutator.next(corpus, passing);
        if (only == g_input) std::cout << text << std::flush;
        const std::string outcome = outcome_of(bytes(text), text.size());
        if (outcome == "accepted") {
            ++accepted;
            // From here on others go on from it, as long as there is room.
            if (passing.size() < 2000 && accepted % 16 == 0) passing.push_back(text);
        }
        if (!outcomes.insert(outcome).second) continue;
        corpus.push_back(text);
        if (keep.empty()) continue;
        const std::string name = "found-" + std::to_string(seed) + "-" + std::to_string(g_input);
        std::ofstream(fs::path(keep) / name, std::ios::binary) << text;
    }
    std::cout << inputs << " inputs, " << accepted << " accepted, " << outcomes.size()
              << " different outcomes" << std::endl;
    return 0;
}
