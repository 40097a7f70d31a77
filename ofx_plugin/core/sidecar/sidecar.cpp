// The sidecar reader. Text becomes a JSON tree under limits (json_tree.cpp), and the tree becomes a
// Sidecar member by member (read_clip.cpp, read_polytope.cpp, read_edits.cpp, read_picks.cpp).
#include "sidecar/sidecar.hpp"

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "sidecar/codec.hpp"
#include "sidecar/members.hpp"

namespace palette4d {
namespace {

int read_head(const Cursor& root) {
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
        {"colours", "versions", "history", "mattes"});
    root.member("generator").text();
    root.member("extra").require_object();
    return static_cast<int>(number);
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

}  // namespace

Sidecar sidecar_of(const Json& members, const std::string& name) {
    const Cursor root(members, name);
    Sidecar sidecar;
    const int version = read_head(root);
    const Cursor clip = root.member("clip");
    sidecar.clip = read_clip(clip);
    if (clip.has("conversion")) {
        sidecar.conversion = read_conversion(clip.member("conversion"), name);
    }
    sidecar.polytope = read_polytope(root.member("polytope"), sidecar.clip, name);
    read_quality(root.member("quality"));
    PickMattes& mattes = sidecar.mattes;
    if (root.has("mattes")) mattes = read_mattes(root.member("mattes"), version, {});
    mattes.version = version;
    mattes.frame_step = static_cast<double>(sidecar.clip.step);
    sidecar.edits = read_edits(root.member("edits"), sidecar.polytope, mattes);
    if (root.has("versions")) {
        sidecar.versions = read_versions(root.member("versions"), sidecar.polytope, mattes);
    }
    if (root.has("colours")) check_colours(root.member("colours"));
    if (root.has("history")) root.member("history").require_object();
    return sidecar;
}

Sidecar with_edits(const Sidecar& palette, const Json& edits, const Json& mattes,
                   const std::string& name) {
    Sidecar result{palette.clip, palette.polytope, {}, {}, {}, palette.conversion};
    const Json members = {{"edits", edits}, {"mattes", mattes}};
    const Cursor root(members, name);
    result.mattes = read_mattes(root.member("mattes"), kSidecarVersion, palette.mattes);
    result.mattes.version = kSidecarVersion;
    result.mattes.frame_step = palette.mattes.frame_step;
    result.edits = read_edits(root.member("edits"), palette.polytope, result.mattes);
    return result;
}

Sidecar parse_sidecar(const std::string& text, const std::string& name) {
    return sidecar_of(json_tree(text, name), name);
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
