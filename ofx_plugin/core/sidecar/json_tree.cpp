#include "sidecar/json_tree.hpp"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "model/sidecar_error.hpp"
#include "sidecar/sidecar.hpp"

namespace palette4d {
namespace {

/// Builds a Json from parser events; refuses excessive depth, size and duplicate names early.
class TreeBuilder {
public:
    explicit TreeBuilder(const std::string& text, const std::string& file)
        : text_(text), file_(file) {}

    Json take() { return std::move(root_); }

    bool null() { return add(Json(nullptr)); }
    bool boolean(bool value) { return add(Json(value)); }
    bool number_integer(Json::number_integer_t value) { return add(Json(value)); }
    bool number_unsigned(Json::number_unsigned_t value) { return add(Json(value)); }
    bool number_float(Json::number_float_t value, const std::string& digits) {
        const bool whole = digits.find_first_of(".eE") == std::string::npos;
        return add(whole ? long_integer(digits) : Json(value));
    }
    bool string(std::string& value) { return add(Json(std::move(value))); }
    bool binary(Json::binary_t&) { return false; }  // never in text

    bool start_object(std::size_t) { return open(Json::object()); }
    bool start_array(std::size_t) { return open(Json::array()); }
    bool end_object() {
        refuse_second_names();
        return close();
    }
    bool end_array() { return close(); }

    bool key(std::string& name) {
        Frame& frame = open_.back();
        frame.name = std::move(name);
        frame.named = true;
        return true;
    }

    bool parse_error(std::size_t position, const std::string&, const Json::exception& problem) {
        std::string detail = problem.what();
        // "[json.exception.parse_error.101] parse error at line 1, column 2: the detail"
        const auto erase_until = [&](const char* end) {
            const auto at = detail.find(end);
            if (at != std::string::npos) detail.erase(0, at + 2);
        };
        erase_until("] ");
        if (detail.rfind("parse error", 0) == 0) erase_until(": ");
        if (problem.id == 406) fail("a number too large for a double", "a finite number");
        fail("no JSON at " + line_and_column(position) + " (" + printable(detail, 160) + ")",
             "JSON text (RFC 8259)");
    }

private:
    struct Frame {
        Json* container;
        std::string name{};  ///< the member being read, in an object
        bool named = false;
    };

    Json* place(Json&& value) {
        if (++values_ > kMaxValues) {
            fail("more than " + std::to_string(kMaxValues) + " values", "a smaller file");
        }
        if (open_.empty()) {
            root_ = std::move(value);
            return &root_;
        }
        Frame& frame = open_.back();
        if (frame.container->is_array()) {
            frame.container->push_back(std::move(value));
            return &frame.container->back();
        }
        frame.named = false;
        auto& members = frame.container->get_ref<Json::object_t&>();
        return &static_cast<Json::object_t::Container&>(members)
                    .emplace_back(frame.name, std::move(value))
                    .second;
    }

    bool add(Json&& value) {
        place(std::move(value));
        return true;
    }

    bool open(Json&& container) {
        if (open_.size() >= kMaxDepth) {
            fail("nesting deeper than " + std::to_string(kMaxDepth), "a flatter file");
        }
        Json* placed = place(std::move(container));
        open_.push_back(Frame{placed});
        return true;
    }

    bool close() {
        open_.pop_back();
        return true;
    }

    /// Objects keep the file's order, in which a search for each name would take too long.
    void refuse_second_names() {
        std::vector<const std::string*> names;
        for (const auto& [name, unused] : open_.back().container->items()) names.push_back(&name);
        const auto less = [](const auto* a, const auto* b) { return *a < *b; };
        std::sort(names.begin(), names.end(), less);
        const auto same = [](const auto* a, const auto* b) { return *a == *b; };
        const auto second = std::adjacent_find(names.begin(), names.end(), same);
        if (second == names.end()) return;
        open_.back().name = **second;
        open_.back().named = true;
        fail("a second member " + in_quotes(**second), "each name only once in an object");
    }

    /// The JSON pointer of the parser's position.
    std::string pointer() const {
        std::string path;
        for (std::size_t i = 0; i < open_.size(); ++i) {
            const Frame& frame = open_[i];
            const bool inner = i + 1 < open_.size();
            if (frame.container->is_array()) {
                path += '/' + std::to_string(frame.container->size() - (inner ? 1 : 0));
            } else if (inner || frame.named) {
                path += pointer_token(frame.name);
            }
        }
        return path;
    }

    std::string line_and_column(std::size_t position) const {
        const std::string before = text_.substr(0, position);
        const auto line = 1 + std::count(before.begin(), before.end(), '\n');
        const std::size_t column = before.size() - (before.rfind('\n') + 1);  // npos + 1 is 0
        return "line " + std::to_string(line) + ", column " + std::to_string(column);
    }

    [[noreturn]] void fail(const std::string& found, const std::string& expected) const {
        throw SidecarError(file_, pointer(), found, expected);
    }

    const std::string& text_;
    const std::string& file_;
    Json root_;
    std::vector<Frame> open_;
    std::size_t values_ = 0;
};

}  // namespace

void require_size(const std::string& text, const std::string& file) {
    if (text.size() > kMaxSidecarBytes) {
        throw SidecarError(file, "", "more than " + std::to_string(kMaxSidecarBytes) + " bytes",
                           "a sidecar of at most that size");
    }
}

Json json_tree(const std::string& text, const std::string& file) {
    require_size(text, file);
    if (text.empty()) throw SidecarError(file, "", "an empty file", "JSON text (RFC 8259)");
    for (const char* mark : {"\xef\xbb\xbf", "\xff\xfe", "\xfe\xff"}) {
        if (text.compare(0, std::strlen(mark), mark) == 0) {
            throw SidecarError(file, "", "a byte order mark", "UTF-8 text without one");
        }
    }
    // The parser takes a NUL for the end of the text.
    if (text.find('\0') != std::string::npos) {
        throw SidecarError(file, "", "a NUL byte", "JSON text (RFC 8259)");
    }
    TreeBuilder builder(text, file);
    if (!Json::sax_parse(text, &builder)) {
        throw SidecarError(file, "", "no JSON", "JSON text (RFC 8259)");
    }
    return builder.take();
}

Json long_integer(const std::string& digits) {
    return Json::binary({digits.begin(), digits.end()});
}

std::string digits_of(const Json& long_integer) {
    const auto& bytes = long_integer.get_binary();
    return {bytes.begin(), bytes.end()};
}

std::string pointer_token(const std::string& name) {
    std::string escaped = "/";
    for (const char c : name) escaped += c == '~' ? "~0" : c == '/' ? "~1" : std::string(1, c);
    return escaped;
}

}  // namespace palette4d
