// The sidecar reader. Text becomes a JSON tree under limits (json_tree below), and the tree becomes
// a Sidecar member by member; whatever does not fit ends in a SidecarError that names the place.
#include "sidecar/sidecar.hpp"

#include <cmath>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

namespace palette4d {
namespace {

using Json = nlohmann::json;

/// The parser refuses deeper nesting; the format itself has six levels.
constexpr std::size_t kMaxDepth = 64;
/// The parser refuses more JSON values than this, to bound memory: "[],[],[]" takes twenty times
/// the memory of its text.
constexpr std::size_t kMaxValues = 4'000'000;
/// Limits for colours and frame numbers, so that geometry never overflows.
constexpr double kMaxColour = 1e6;
constexpr std::int64_t kMaxFrame = 1'000'000'000;
constexpr std::int64_t kMaxRate = 2'147'483'647;
constexpr std::int64_t kMaxSize = 1'000'000;
constexpr std::size_t kMaxIdLength = 64;
/// Limits of a conversion; a curve over all half floats has 63 488 samples.
constexpr std::size_t kMaxSteps = 64;
constexpr std::size_t kMaxSamples = 100'000;
/// Limit for a conversion's numbers: above the range of half floats.
constexpr double kMaxConversion = 1e9;
/// Smallest radius of a bump, so that its square stays a normal float.
constexpr double kMinRadius = 1e-4;
constexpr std::size_t kMaxNameLength = 100;

/// Describes a value for the "found" part of an error.
std::string described(const Json& value) {
    switch (value.type()) {
        case Json::value_t::null:
            return "null";
        case Json::value_t::boolean:
            return value.get<bool>() ? "true" : "false";
        case Json::value_t::string:
            return "the text " + in_quotes(value.get_ref<const std::string&>());
        case Json::value_t::array:
            return "a list of " + std::to_string(value.size());
        case Json::value_t::object:
            return "an object";
        default:
            return "the number " + value.dump();
    }
}

/// One reference token of a JSON pointer (RFC 6901, section 3).
std::string token(const std::string& name) {
    std::string escaped = "/";
    for (const char c : name) {
        if (c == '~') {
            escaped += "~0";
        } else if (c == '/') {
            escaped += "~1";
        } else {
            escaped += c;
        }
    }
    return escaped;
}

// ------------------------------------------------------------------------------- text to tree

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
    bool number_float(Json::number_float_t value, const std::string&) { return add(Json(value)); }
    bool string(std::string& value) { return add(Json(std::move(value))); }
    bool binary(Json::binary_t&) { return false; }  // never in text

    bool start_object(std::size_t) { return open(Json::object()); }
    bool start_array(std::size_t) { return open(Json::array()); }
    bool end_object() { return close(); }
    bool end_array() { return close(); }

    bool key(std::string& name) {
        Frame& frame = open_.back();
        frame.name = std::move(name);
        frame.named = true;
        if (frame.container->contains(frame.name)) {
            fail("a second member " + in_quotes(frame.name), "each name only once in an object");
        }
        return true;
    }

    bool parse_error(std::size_t position, const std::string&, const Json::exception& problem) {
        std::string detail = problem.what();
        // "[json.exception.parse_error.101] parse error at line 1, column 2: the detail"
        if (const auto bracket = detail.find("] "); bracket != std::string::npos) {
            detail.erase(0, bracket + 2);
        }
        if (detail.rfind("parse error", 0) == 0) {
            if (const auto colon = detail.find(": "); colon != std::string::npos) {
                detail.erase(0, colon + 2);
            }
        }
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
        return &(frame.container->get_ref<Json::object_t&>()[frame.name] = std::move(value));
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

    /// The JSON pointer of the parser's position.
    std::string pointer() const {
        std::string path;
        for (std::size_t i = 0; i < open_.size(); ++i) {
            const Frame& frame = open_[i];
            const bool inner = i + 1 < open_.size();
            if (frame.container->is_array()) {
                path += '/' + std::to_string(frame.container->size() - (inner ? 1 : 0));
            } else if (inner || frame.named) {
                path += token(frame.name);
            }
        }
        return path;
    }

    std::string line_and_column(std::size_t position) const {
        std::size_t line = 1;
        std::size_t column = 0;
        for (std::size_t i = 0; i < position && i < text_.size(); ++i) {
            if (text_[i] == '\n') {
                ++line;
                column = 0;
            } else {
                ++column;
            }
        }
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

Json json_tree(const std::string& text, const std::string& file) {
    if (text.size() > kMaxSidecarBytes) {
        throw SidecarError(file, "", "more than " + std::to_string(kMaxSidecarBytes) + " bytes",
                           "a sidecar of at most that size");
    }
    if (text.empty()) throw SidecarError(file, "", "an empty file", "JSON text (RFC 8259)");
    for (const char* mark : {"\xef\xbb\xbf", "\xff\xfe", "\xfe\xff"}) {
        if (text.compare(0, std::strlen(mark), mark) == 0) {
            throw SidecarError(file, "", "a byte order mark", "UTF-8 text without one");
        }
    }
    TreeBuilder builder(text, file);
    if (!Json::sax_parse(text, &builder)) {
        throw SidecarError(file, "", "no JSON", "JSON text (RFC 8259)");
    }
    return builder.take();
}

// ------------------------------------------------------------------------------- tree to values

/// A value and its path. The JSON pointer is only built for an error.
class Cursor {
public:
    Cursor(const Json& root, const std::string& file) : value_(&root), file_(&file) {}

    [[noreturn]] void fail(const std::string& found, const std::string& expected) const {
        throw SidecarError(*file_, pointer(), found, expected);
    }
    [[noreturn]] void wrong(const std::string& expected) const {
        fail(described(*value_), expected);
    }

    bool has(const char* name) const { return value_->contains(name); }
    /// The required member `name`.
    Cursor member(const char* name) const {
        const auto found = value_->find(name);
        if (found == value_->end()) {
            throw SidecarError(*file_, pointer() + token(name), "nothing",
                               "the member " + in_quotes(name));
        }
        Cursor child(*found, *file_);
        child.parent_ = this;
        child.name_ = name;
        return child;
    }
    Cursor element(std::size_t index) const {
        Cursor child((*value_)[index], *file_);
        child.parent_ = this;
        child.index_ = index;
        return child;
    }

    void require_object() const {
        if (!value_->is_object()) wrong("an object");
    }
    /// Requires an object with exactly the members `names`; those in `optional` may be missing.
    void require_members(std::initializer_list<const char*> names,
                         std::initializer_list<const char*> optional = {}) const {
        require_object();
        for (const auto& [name, unused] : value_->items()) {
            bool known = false;
            for (const auto& some : {names, optional}) {
                for (const char* candidate : some) known = known || name == candidate;
            }
            if (!known) {
                std::string list;
                for (const auto& some : {names, optional}) {
                    for (const char* candidate : some) {
                        list += (list.empty() ? "" : ", ") + std::string(candidate);
                    }
                }
                throw SidecarError(*file_, pointer() + token(name),
                                   "the unknown member " + in_quotes(name), "only " + list);
            }
        }
        for (const char* name : names) member(name);
    }
    /// Requires an object with any names, whose values are numbers, texts, true, false or null.
    void require_scalars() const {
        require_object();
        for (const auto& [name, value] : value_->items()) {
            if (value.is_structured()) {
                throw SidecarError(*file_, pointer() + token(name), described(value),
                                   "a number, a text, true, false or null");
            }
        }
    }

    /// The number of elements of a list.
    std::size_t list(const char* of) const {
        if (!value_->is_array()) wrong(std::string("a list of ") + of);
        return value_->size();
    }

    std::string text() const {
        if (!value_->is_string()) wrong("a text");
        return value_->get<std::string>();
    }

    /// One of a few texts; its position among them.
    std::size_t choice(std::initializer_list<const char*> texts) const {
        std::size_t at = 0;
        std::string list;
        for (const char* text : texts) {
            if (value_->is_string() && *value_ == text) return at;
            ++at;
            list += (list.empty() ? "" : at == texts.size() ? " or " : ", ") + in_quotes(text);
        }
        wrong(list);
    }

    bool flag() const {
        if (!value_->is_boolean()) wrong("true or false");
        return value_->get<bool>();
    }

    /// What a user calls something.
    std::string name() const {
        const std::string rule = "a name of 1 to " + std::to_string(kMaxNameLength) +
                                 " characters, none of them a control character";
        if (!value_->is_string()) wrong(rule);
        const auto& name = value_->get_ref<const std::string&>();
        std::size_t length = 0;
        for (const char c : name) {
            if ((c >= 0 && c < 0x20) || c == 0x7f) wrong(rule);
            length += (static_cast<unsigned char>(c) & 0xc0) != 0x80;  // UTF-8: not a tail
        }
        if (length == 0 || length > kMaxNameLength) wrong(rule);
        return name;
    }

    std::string id() const {
        const char* const rule =
            "an id: 1 to 64 letters, digits, '_', '-' or '.', a letter or a digit first";
        if (!value_->is_string()) wrong(rule);
        const auto& id = value_->get_ref<const std::string&>();
        bool valid = !id.empty() && id.size() <= kMaxIdLength;
        for (std::size_t i = 0; valid && i < id.size(); ++i) {
            const char c = id[i];
            const bool word =
                (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
            valid = word || (i > 0 && (c == '_' || c == '-' || c == '.'));
        }
        if (!valid) wrong(rule);
        return id;
    }

    std::int64_t integer(std::int64_t lowest, std::int64_t highest) const {
        const std::string expected =
            "an integer from " + std::to_string(lowest) + " to " + std::to_string(highest);
        // As in JSON Schema, 24.0 and 2.4e1 are the integer 24. All bounds here are exact in
        // double.
        const double number = value_->is_number() ? value_->get<double>() : 0.5;
        if (std::trunc(number) != number || number < static_cast<double>(lowest) ||
            number > static_cast<double>(highest)) {
            wrong(expected);
        }
        return static_cast<std::int64_t>(number);
    }

    double number(double limit, const char* what) const {
        const bool fits = value_->is_number() && std::fabs(value_->get<double>()) <= limit;
        if (!fits) wrong(std::string(what) + " within +-" + Json(limit).dump());
        return value_->get<double>();
    }
    double number(double lowest, double highest) const {
        const double found = value_->is_number() ? value_->get<double>() : lowest - 1;
        if (!(found >= lowest && found <= highest)) {
            wrong("a number from " + Json(lowest).dump() + " to " + Json(highest).dump());
        }
        return found;
    }
    double frame() const { return number(static_cast<double>(kMaxFrame), "a frame number"); }

    Vec3 rgb() const {
        if (!value_->is_array() || value_->size() != 3) wrong("a list of 3 numbers, r, g and b");
        Vec3 colour{};
        for (std::size_t i = 0; i < 3; ++i) colour[i] = element(i).number(kMaxColour, "a number");
        return colour;
    }

private:
    std::string pointer() const {
        if (parent_ == nullptr) return "";
        return parent_->pointer() + (name_ ? token(name_) : '/' + std::to_string(index_));
    }

    const Json* value_;
    const std::string* file_;
    const Cursor* parent_ = nullptr;
    const char* name_ = nullptr;
    std::size_t index_ = 0;
};

using Index = std::unordered_map<std::string, int>;

/// Vertices, edges and stops share one set of ids, so an id alone identifies a handle.
void claim(std::set<std::string>& taken, const Cursor& where, const std::string& id) {
    if (!taken.insert(id).second) {
        where.fail("the id " + in_quotes(id) + " a second time", "an id of its own");
    }
}

int known(const Index& index, const Cursor& where, const char* kind) {
    const std::string id = where.id();
    const auto found = index.find(id);
    if (found == index.end()) {
        where.fail("the unknown " + std::string(kind) + ' ' + in_quotes(id),
                   "the id of one of the polytope's " + std::to_string(index.size()) + ' ' +
                       (std::string(kind) == "vertex" ? "vertices" : "edges"));
    }
    return found->second;
}

void read_head(const Cursor& root) {
    root.require_object();
    const Cursor schema = root.member("schema");
    if (schema.text() != "palette4d.sidecar") schema.wrong("\"palette4d.sidecar\"");
    const Cursor version = root.member("version");
    const std::int64_t number = version.integer(1, kMaxFrame);
    if (number > kSidecarVersion) {
        version.fail(
            "version " + std::to_string(number) + ", written by a newer palette4d",
            "version " + std::to_string(kSidecarVersion) + "; update palette4d to read this file");
    }
    root.require_members(
        {"schema", "version", "generator", "clip", "polytope", "quality", "edits", "extra"},
        {"colours", "versions", "history"});
    root.member("generator").text();
    root.member("extra").require_object();
}

bool read_flag(const Cursor& where) {
    const std::string text = where.text();
    if (text != "forward" && text != "inverse") where.wrong("\"forward\" or \"inverse\"");
    return text == "inverse";
}

Vec3 read_three(const Cursor& where) {
    if (where.list("3 numbers, for r, g and b") != 3) where.wrong("a list of 3 numbers");
    Vec3 result{};
    for (std::size_t i = 0; i < 3; ++i) {
        result[i] = where.element(i).number(kMaxConversion, "a number");
    }
    return result;
}

std::vector<double> read_samples(const Cursor& where) {
    const std::size_t count = where.list("numbers");
    if (count > kMaxSamples) {
        where.wrong("at most " + std::to_string(kMaxSamples) + " numbers");
    }
    std::vector<double> result(count);
    for (std::size_t i = 0; i < count; ++i) {
        result[i] = where.element(i).number(kMaxConversion, "a number");
    }
    return result;
}

ConversionStep read_step(const Cursor& step) {
    step.require_object();
    const Cursor kind = step.member("kind");
    const std::string name = kind.text();
    if (name == "matrix") {
        step.require_members({"kind", "matrix", "offset"});
        MatrixStep result{};
        const Cursor rows = step.member("matrix");
        if (rows.list("3 rows") != 3) rows.wrong("a list of 3 rows");
        for (std::size_t r = 0; r < 3; ++r) {
            const Vec3 row = read_three(rows.element(r));
            for (std::size_t c = 0; c < 3; ++c) result.matrix[3 * r + c] = row[c];
        }
        result.offset = read_three(step.member("offset"));
        return result;
    }
    if (name == "log") {
        step.require_members({"kind", "direction", "base", "log_slope", "log_offset",
                              "linear_slope", "linear_offset", "start", "below"});
        LogStep result{};
        result.base = step.member("base").number(kMaxConversion, "a number");
        result.log_slope = read_three(step.member("log_slope"));
        result.log_offset = read_three(step.member("log_offset"));
        result.linear_slope = read_three(step.member("linear_slope"));
        result.linear_offset = read_three(step.member("linear_offset"));
        result.start = read_three(step.member("start"));
        result.below = read_three(step.member("below"));
        result.inverse = read_flag(step.member("direction"));
        return result;
    }
    if (name == "gamma") {
        step.require_members({"kind", "direction", "gamma", "offset", "negative"});
        const Cursor negative = step.member("negative");
        const std::string how = negative.text();
        if (how != "line" && how != "mirror") negative.wrong("\"line\" or \"mirror\"");
        return GammaStep{read_three(step.member("gamma")), read_three(step.member("offset")),
                         how == "mirror", read_flag(step.member("direction"))};
    }
    if (name == "curve") {
        step.require_members({"kind", "direction", "curves"});
        CurveStep result{};
        const Cursor curves = step.member("curves");
        const std::size_t count = curves.list("1 curve or 3");
        if (count != 1 && count != 3) curves.wrong("a list of 1 curve or 3");
        for (std::size_t i = 0; i < count; ++i) {
            const Cursor curve = curves.element(i);
            curve.require_members({"x", "y"});
            result.curves.push_back(
                {read_samples(curve.member("x")), read_samples(curve.member("y"))});
        }
        result.inverse = read_flag(step.member("direction"));
        return result;
    }
    kind.wrong("\"matrix\", \"log\", \"gamma\" or \"curve\"");
}

ColourConversion read_steps(const Cursor& steps, const std::string& file,
                            const std::string& pointer) {
    const std::size_t count = steps.list("steps");
    if (count > kMaxSteps) steps.wrong("at most " + std::to_string(kMaxSteps) + " steps");
    std::vector<ConversionStep> result;
    for (std::size_t i = 0; i < count; ++i) result.push_back(read_step(steps.element(i)));
    try {
        return ColourConversion(std::move(result));
    } catch (const ConversionProblem& problem) {
        throw SidecarError(file, pointer + '/' + std::to_string(problem.step()) + problem.member(),
                           problem.found(), problem.expected());
    }
}

std::shared_ptr<const ClipConversion> read_conversion(const Cursor& where,
                                                      const std::string& file) {
    where.require_members({"input_space", "config", "error", "steps"});
    auto result = std::make_shared<ClipConversion>();
    result->input_space = where.member("input_space").text();
    result->config = where.member("config").text();
    const Cursor error = where.member("error");
    result->error = error.number(1, "a number");
    if (result->error < 0) error.wrong("a number from 0");
    result->steps = read_steps(where.member("steps"), file, "/clip/conversion/steps");
    return result;
}

ClipInfo read_clip(const Cursor& clip) {
    clip.require_members({"name", "source", "frames", "rate", "size", "encoding"}, {"conversion"});
    ClipInfo info;
    info.name = clip.member("name").text();
    info.source = clip.member("source").text();
    info.encoding = clip.member("encoding").text();

    const Cursor frames = clip.member("frames");
    frames.require_members({"first", "last", "step", "skipped"});
    info.first = frames.member("first").integer(-kMaxFrame, kMaxFrame);
    info.last = frames.member("last").integer(info.first, kMaxFrame);
    info.step = frames.member("step").integer(1, kMaxFrame);
    if ((info.last - info.first) % info.step != 0) {
        frames.member("step").wrong("a divisor of last - first = " +
                                    std::to_string(info.last - info.first));
    }
    const Cursor skipped = frames.member("skipped");
    std::int64_t previous = info.first - info.step;
    for (std::size_t i = 0, n = skipped.list("frame numbers"); i < n; ++i) {
        const Cursor entry = skipped.element(i);
        const std::int64_t frame = entry.integer(info.first, info.last);
        if ((frame - info.first) % info.step != 0) entry.wrong("a frame of the clip");
        if (frame <= previous) entry.wrong("frames in increasing order, each once");
        previous = frame;
    }

    const Cursor rate = clip.member("rate");
    if (rate.list("2 integers, numerator and denominator") != 2) {
        rate.wrong("a list of 2 integers, numerator and denominator");
    }
    info.rate_num = rate.element(0).integer(1, kMaxRate);
    info.rate_den = rate.element(1).integer(1, kMaxRate);
    const Cursor size = clip.member("size");
    if (size.list("2 integers, width and height") != 2) {
        size.wrong("a list of 2 integers, width and height");
    }
    info.width = size.element(0).integer(1, kMaxSize);
    info.height = size.element(1).integer(1, kMaxSize);
    return info;
}

void read_topology(const Cursor& where, const Index& vertex_index, Section& section) {
    const Cursor tracks = where.member("tracks");
    for (std::size_t i = 0, n = tracks.list("tracks"); i < n; ++i) {
        const Cursor track = tracks.element(i);
        auto& vertices = section.tracks.emplace_back();
        for (std::size_t j = 0, m = track.list("vertex ids"); j < m; ++j) {
            vertices.push_back(known(vertex_index, track.element(j), "vertex"));
        }
    }
    const Cursor faces = where.member("faces");
    for (std::size_t i = 0, n = faces.list("faces"); i < n; ++i) {
        const Cursor face = faces.element(i);
        if (face.list("3 track indices") != 3) face.wrong("a list of 3 track indices");
        Face corners{};
        for (std::size_t j = 0; j < 3; ++j) {
            const auto most = static_cast<std::int64_t>(section.tracks.size()) - 1;
            const Cursor corner = face.element(j);
            if (most < 0) corner.wrong("no faces without tracks");
            corners[j] = static_cast<int>(corner.integer(0, most));
        }
        section.faces.push_back(corners);
    }
}

Polytope read_polytope(const Cursor& where, const ClipInfo& clip, const std::string& file,
                       Index& vertex_index, Index& edge_index, std::set<std::string>& taken) {
    where.require_members({"vertices", "edges", "blocks", "transitions"});

    std::vector<Vertex> vertices;
    const Cursor vertex_list = where.member("vertices");
    for (std::size_t i = 0, n = vertex_list.list("vertices"); i < n; ++i) {
        const Cursor entry = vertex_list.element(i);
        entry.require_members({"id", "frame", "rgb"});
        const Cursor id = entry.member("id");
        Vertex vertex{id.id(), entry.member("rgb").rgb(), entry.member("frame").frame()};
        claim(taken, id, vertex.id);
        vertex_index.emplace(vertex.id, static_cast<int>(i));
        vertices.push_back(std::move(vertex));
    }

    std::vector<Edge> edges;
    const Cursor edge_list = where.member("edges");
    for (std::size_t i = 0, n = edge_list.list("edges"); i < n; ++i) {
        const Cursor entry = edge_list.element(i);
        entry.require_members({"id", "from", "to"});
        const Cursor id = entry.member("id");
        Edge edge{id.id(), known(vertex_index, entry.member("from"), "vertex"),
                  known(vertex_index, entry.member("to"), "vertex")};
        claim(taken, id, edge.id);
        edge_index.emplace(edge.id, static_cast<int>(i));
        edges.push_back(std::move(edge));
    }

    const Cursor blocks = where.member("blocks");
    const Cursor transitions = where.member("transitions");
    const std::size_t block_count = blocks.list("blocks");
    if (block_count == 0) blocks.wrong("at least one block");
    if (transitions.list("transitions") != block_count - 1) {
        transitions.wrong("a list of " + std::to_string(block_count - 1) +
                          ", one transition between each two blocks");
    }
    std::vector<Section> sections;
    for (std::size_t i = 0; i < block_count; ++i) {
        const Cursor block = blocks.element(i);
        block.require_members({"first", "last", "tracks", "faces"});
        Section section{block.member("first").frame(), block.member("last").frame(), false, {}, {}};
        if (i == 0 && section.first != static_cast<double>(clip.first)) {
            block.member("first").wrong("the clip's first frame " + std::to_string(clip.first));
        }
        if (i + 1 == block_count && section.last != static_cast<double>(clip.last)) {
            block.member("last").wrong("the clip's last frame " + std::to_string(clip.last));
        }
        read_topology(block, vertex_index, section);
        sections.push_back(std::move(section));
        if (i + 1 == block_count) break;
        const Cursor transition = transitions.element(i);
        transition.require_members({"tracks", "faces"});
        // A transition has no frames of its own: it fills the time between its two blocks.
        const Cursor next = blocks.element(i + 1);
        next.require_members({"first", "last", "tracks", "faces"});
        Section between{sections.back().last, next.member("first").frame(), true, {}, {}};
        read_topology(transition, vertex_index, between);
        sections.push_back(std::move(between));
    }

    try {
        return Polytope(std::move(vertices), std::move(edges), std::move(sections));
    } catch (const SidecarError& problem) {
        throw SidecarError(file, "/polytope" + problem.pointer(), problem.found(),
                           problem.expected());
    }
}

void read_quality(const Cursor& quality) {
    quality.require_members({"stages", "options", "versions"});
    const Cursor stages = quality.member("stages");
    for (std::size_t i = 0, n = stages.list("stages"); i < n; ++i) {
        const Cursor stage = stages.element(i);
        stage.require_scalars();
        stage.member("stage").text();
    }
    quality.member("options").require_scalars();
    quality.member("versions").require_scalars();
}

std::optional<Ramp> read_ramp(const Cursor& entry) {
    if (!entry.has("ramp")) return std::nullopt;
    constexpr Ramp kRamps[] = {Ramp::kLinear, Ramp::kSmooth, Ramp::kHold};
    return kRamps[entry.member("ramp").choice({"linear", "smooth", "hold"})];
}

/// The ids that edits refer to.
struct Names {
    const Polytope& polytope;
    const Index& vertices;
    const Index& edges;
    const std::set<std::string>& taken;  ///< by vertices and edges
};

/// Reads the members `edge` and `frame`: a place strictly inside an edge, `occupied` by nothing.
std::pair<int, double> read_place(const Cursor& entry, const Names& names, const char* what,
                                  std::set<std::pair<int, double>>& occupied) {
    const int at = known(names.edges, entry.member("edge"), "edge");
    const Cursor frame = entry.member("frame");
    const double number = frame.frame();
    const Edge& edge = names.polytope.edges()[static_cast<std::size_t>(at)];
    const double from = names.polytope.vertices()[static_cast<std::size_t>(edge.from)].frame;
    const double to = names.polytope.vertices()[static_cast<std::size_t>(edge.to)].frame;
    if (!(number > from && number < to)) {
        frame.wrong("a frame inside the edge " + in_quotes(edge.id) + ", between " +
                    Json(from).dump() + " and " + Json(to).dump());
    }
    if (!occupied.emplace(at, number).second) {
        frame.fail("a second " + std::string(what) + " of the edge " + in_quotes(edge.id) +
                       " at this frame",
                   "at most one " + std::string(what) + " of an edge at a frame");
    }
    return {at, number};
}

/// The frame of a list's entry, later than the `previous` one.
double read_later(const Cursor& entry, std::optional<double>& previous) {
    const Cursor frame = entry.member("frame");
    const double number = frame.frame();
    if (previous && !(number > *previous)) frame.wrong("frames in increasing order, each once");
    previous = number;
    return number;
}

Solution read_solution(const Cursor& where, const Names& names) {
    where.require_members({"vertices", "keys", "bumps"});
    Solution solution;
    const Cursor vertices = where.member("vertices");
    const std::size_t moved = vertices.list("vertices that move");
    if (moved > 0) solution.vertex_by.resize(names.polytope.vertices().size());
    std::set<int> seen;
    for (std::size_t i = 0; i < moved; ++i) {
        const Cursor entry = vertices.element(i);
        entry.require_members({"vertex", "by"});
        const Cursor vertex = entry.member("vertex");
        const int at = known(names.vertices, vertex, "vertex");
        if (!seen.insert(at).second) {
            vertex.fail("the vertex " + in_quotes(vertex.text()) + " a second time",
                        "each vertex at most once");
        }
        solution.vertex_by[static_cast<std::size_t>(at)] = entry.member("by").rgb();
    }

    std::set<std::pair<int, double>> occupied;
    const Cursor keys = where.member("keys");
    for (std::size_t i = 0, n = keys.list("keys"); i < n; ++i) {
        const Cursor entry = keys.element(i);
        entry.require_members({"edge", "frame", "by"});
        const auto [edge, frame] = read_place(entry, names, "key", occupied);
        solution.keys.push_back({edge, frame, entry.member("by").rgb()});
    }

    const Cursor bumps = where.member("bumps");
    for (std::size_t i = 0, n = bumps.list("bumps"); i < n; ++i) {
        const Cursor entry = bumps.element(i);
        entry.require_members({"radius", "keys"});
        Solution::MovingBump bump{entry.member("radius").number(kMinRadius, kMaxColour), {}};
        const Cursor steps = entry.member("keys");
        std::optional<double> previous;
        const std::size_t count = steps.list("keys");
        if (count == 0) steps.wrong("at least one key");
        for (std::size_t j = 0; j < count; ++j) {
            const Cursor step = steps.element(j);
            step.require_members({"frame", "rgb", "by"});
            bump.keys.push_back(
                {read_later(step, previous), step.member("rgb").rgb(), step.member("by").rgb()});
        }
        solution.bumps.push_back(std::move(bump));
    }
    return solution;
}

/// Checks what only the solver reads.
void check_pick(const Cursor& pick, std::set<std::string>& taken) {
    pick.require_members({"id", "kind", "frame", "rgb"},
                         {"to", "toward", "from", "until", "fade", "radius", "global_only",
                          "enabled", "path", "pixel", "box", "residual", "global"});
    claim(taken, pick.member("id"), pick.member("id").id());
    pick.member("kind").choice({"pick", "hold"});
    pick.member("frame").frame();
    pick.member("rgb").rgb();
    if (pick.has("to")) pick.member("to").rgb();
    if (pick.has("toward")) pick.member("toward").choice({"shift", "colour"});
    if (pick.has("from")) pick.member("from").frame();
    if (pick.has("until")) pick.member("until").frame();
    if (pick.has("fade")) pick.member("fade").number(0, static_cast<double>(kMaxFrame));
    if (pick.has("radius")) pick.member("radius").number(kMinRadius, kMaxColour);
    if (pick.has("global_only")) pick.member("global_only").flag();
    if (pick.has("enabled")) pick.member("enabled").flag();
    if (pick.has("path")) {
        const Cursor path = pick.member("path");
        std::optional<double> previous;
        for (std::size_t i = 0, n = path.list("colours over time"); i < n; ++i) {
            const Cursor step = path.element(i);
            step.require_members({"frame", "rgb"}, {"given"});
            read_later(step, previous);
            step.member("rgb").rgb();
            if (step.has("given")) step.member("given").flag();
        }
    }
    if (pick.has("pixel")) {
        const Cursor pixel = pick.member("pixel");
        if (pixel.list("2 numbers, x and y") != 2) pixel.wrong("a list of 2 numbers, x and y");
        for (std::size_t i = 0; i < 2; ++i) pixel.element(i).number(0.0, double{kMaxSize});
    }
    if (pick.has("box")) pick.member("box").integer(1, kMaxSize);
    if (pick.has("residual")) pick.member("residual").number(0, kMaxColour);
    if (pick.has("global")) pick.member("global").number(0, 1);
}

/// Checks the clip's weighted colours, which only the solver reads.
void check_colours(const Cursor& colours) {
    std::optional<double> previous;
    for (std::size_t i = 0, n = colours.list("frames with colours"); i < n; ++i) {
        const Cursor entry = colours.element(i);
        entry.require_members({"frame", "rgbw"});
        read_later(entry, previous);
        const Cursor rows = entry.member("rgbw");
        for (std::size_t j = 0, m = rows.list("colours"); j < m; ++j) {
            const Cursor row = rows.element(j);
            if (row.list("4 numbers") != 4) row.wrong("a list of 4 numbers: r, g, b and weight");
            for (std::size_t c = 0; c < 3; ++c) row.element(c).number(kMaxColour, "a number");
            row.element(3).number(0, 1);
        }
    }
}

Edits read_edits(const Cursor& where, const Names& names) {
    where.require_members({"vertices", "stops"}, {"ramp", "picks", "locks", "solution"});
    Edits edits;
    edits.vertex_rgb.resize(names.polytope.vertices().size());
    edits.vertex_ramp.resize(edits.vertex_rgb.size());
    edits.default_ramp = read_ramp(where).value_or(Ramp::kLinear);
    const Cursor vertices = where.member("vertices");
    for (std::size_t i = 0, n = vertices.list("vertex edits"); i < n; ++i) {
        const Cursor entry = vertices.element(i);
        entry.require_members({"vertex", "rgb"}, {"ramp"});
        const Cursor vertex = entry.member("vertex");
        const auto at = static_cast<std::size_t>(known(names.vertices, vertex, "vertex"));
        if (edits.vertex_rgb[at]) {
            vertex.fail("a second edit of the vertex " + in_quotes(vertex.text()),
                        "at most one edit of each vertex");
        }
        edits.vertex_rgb[at] = entry.member("rgb").rgb();
        edits.vertex_ramp[at] = read_ramp(entry);
    }

    std::set<std::string> taken = names.taken;
    std::set<std::pair<int, double>> occupied;
    const Cursor stops = where.member("stops");
    for (std::size_t i = 0, n = stops.list("stops"); i < n; ++i) {
        const Cursor entry = stops.element(i);
        entry.require_members({"id", "edge", "frame", "rgb"}, {"ramp"});
        const Cursor id = entry.member("id");
        Stop stop{id.id(), 0, 0, entry.member("rgb").rgb(), read_ramp(entry)};
        std::tie(stop.edge, stop.frame) = read_place(entry, names, "stop", occupied);
        claim(taken, id, stop.id);
        edits.stops.push_back(std::move(stop));
    }

    if (where.has("picks")) {
        const Cursor picks = where.member("picks");
        std::set<std::string> ids;
        for (std::size_t i = 0, n = picks.list("picks"); i < n; ++i) {
            check_pick(picks.element(i), ids);
        }
    }
    if (where.has("locks")) {
        const Cursor locks = where.member("locks");
        for (std::size_t i = 0, n = locks.list("ids"); i < n; ++i) locks.element(i).id();
    }
    if (where.has("solution")) {
        edits.solution = read_solution(where.member("solution"), names);
    }
    return edits;
}

std::vector<NamedVersion> read_versions(const Cursor& where, const Names& names) {
    std::vector<NamedVersion> versions;
    std::set<std::string> taken;
    for (std::size_t i = 0, n = where.list("versions"); i < n; ++i) {
        const Cursor entry = where.element(i);
        entry.require_members({"name", "edits"});
        const Cursor name = entry.member("name");
        versions.push_back({name.name(), read_edits(entry.member("edits"), names)});
        if (!taken.insert(versions.back().name).second) {
            name.fail("a second version " + in_quotes(name.text()), "each name only once");
        }
    }
    return versions;
}

}  // namespace

Sidecar parse_sidecar(const std::string& text, const std::string& name) {
    const Json tree = json_tree(text, name);
    const Cursor root(tree, name);
    Sidecar sidecar;
    read_head(root);
    sidecar.clip = read_clip(root.member("clip"));
    const Cursor clip = root.member("clip");
    if (clip.has("conversion")) {
        sidecar.conversion = read_conversion(clip.member("conversion"), name);
    }
    Index vertex_index;
    Index edge_index;
    std::set<std::string> taken;
    sidecar.polytope =
        read_polytope(root.member("polytope"), sidecar.clip, name, vertex_index, edge_index, taken);
    read_quality(root.member("quality"));
    const Names names{sidecar.polytope, vertex_index, edge_index, taken};
    sidecar.edits = read_edits(root.member("edits"), names);
    if (root.has("versions")) sidecar.versions = read_versions(root.member("versions"), names);
    if (root.has("colours")) check_colours(root.member("colours"));
    if (root.has("history")) root.member("history").require_object();
    return sidecar;
}

ColourConversion parse_conversion(const std::string& text, const std::string& name) {
    const Json tree = json_tree(text, name);
    return read_steps(Cursor(tree, name), name, "");
}

Sidecar read_sidecar(const std::string& path) {
    namespace fs = std::filesystem;
    const char* const wanted = "a sidecar file (*.p4d.json)";
    std::error_code problem;
    const fs::path native = fs::u8path(path);
    const fs::file_status status = fs::status(native, problem);
    if (!fs::exists(status)) {
        if (status.type() == fs::file_type::none) {
            throw SidecarError(path, "", "an unreadable path (" + problem.message() + ')', wanted);
        }
        throw SidecarError(path, "", "no such file", wanted);
    }
    if (fs::is_directory(status)) throw SidecarError(path, "", "a folder", wanted);
    // Reading a pipe or device could block the host forever.
    if (!fs::is_regular_file(status)) throw SidecarError(path, "", "no regular file", wanted);
    std::ifstream stream(native, std::ios::binary);
    if (!stream) throw SidecarError(path, "", "a file that cannot be opened", wanted);
    std::string text;
    std::vector<char> chunk(1 << 16);
    while (stream.read(chunk.data(), static_cast<std::streamsize>(chunk.size())),
           stream.gcount() > 0) {
        text.append(chunk.data(), static_cast<std::size_t>(stream.gcount()));
        if (text.size() > kMaxSidecarBytes) break;  // the parser refuses it by its size
    }
    if (stream.bad()) throw SidecarError(path, "", "a file that cannot be read", wanted);
    return parse_sidecar(text, path);
}

}  // namespace palette4d
