// The sidecar reader. Text becomes a JSON tree under limits (json_tree.cpp), and the tree becomes a
// Sidecar member by member (read_clip.cpp, read_polytope.cpp, read_edits.cpp, read_picks.cpp).
#include "sidecar/sidecar.hpp"

#include <filesystem>

#include "sidecar/codec.hpp"
#include "sidecar/file_bytes.hpp"
#include "sidecar/members.hpp"
#include "sidecar/schema.hpp"

namespace palette4d {
namespace {

/// Checks the members against the schema.
void check_members(const Cursor& root) {
    if (!root.json().is_object()) root.wrong("an object");
    const bool ours = root.has("schema") && root.member("schema").is("palette4d.sidecar");
    const Json version = root.json().value("version", Json());
    const double number = version.is_number() ? version.get<double>() : 0;
    if (ours && number > kSidecarVersion) {
        root.member("version").fail(
            "version " + version.dump() + ", written by a newer palette4d",
            "version " + std::to_string(kSidecarVersion) + "; update palette4d to read this file");
    }
    check(root, sidecar_schema(), number == 1 ? 1 : kSidecarVersion);
}

/// "extra" is free-form: what is not as palette4d writes it is passed over.
std::optional<PlayInEdit> play_in(const Json& root) {
    const Json::json_pointer place("/extra/edit");
    if (!root.contains(place)) return std::nullopt;
    const Json& edit = root.at(place);
    if (!edit.is_object()) return std::nullopt;
    const Json speed = edit.value("speed", Json()), at = edit.value("inPoint", Json());
    const Json reverse = edit.value("reverse", Json());
    if (!speed.is_number() || !at.is_number() || !reverse.is_boolean()) return std::nullopt;
    return PlayInEdit{speed.get<double>(), at.get<double>(), reverse.get<bool>()};
}

}  // namespace

Sidecar sidecar_of(const Json& members, const std::string& name) {
    const Cursor root(members, name);
    Sidecar sidecar;
    check_members(root);
    const Cursor clip = root.member("clip");
    sidecar.clip = read_clip(clip);
    if (clip.has("conversion")) {
        sidecar.conversion = read_conversion(clip.member("conversion"));
    }
    sidecar.polytope = read_polytope(root.member("polytope"), sidecar.clip);
    if (root.has("mattes")) sidecar.mattes = read_mattes(root.member("mattes"), {});
    sidecar.edits = read_edits(root.member("edits"), sidecar);
    if (root.has("versions")) sidecar.versions = read_versions(root.member("versions"), sidecar);
    sidecar.play = play_in(root.json());
    if (root.has("colours")) check_colours(root.member("colours"));
    return sidecar;
}

Sidecar with_edits(const Sidecar& palette, const Json& edits, const Json& mattes,
                   const std::string& name) {
    Sidecar result{palette.clip, palette.polytope, {}, {}, {}, palette.conversion, palette.play};
    const Json members = {{"edits", edits}, {"mattes", mattes}};
    const Cursor root(members, name);
    for (const char* const part : {"edits", "mattes"}) {
        check(root.member(part), sidecar_schema().member(part), kSidecarVersion);
    }
    result.mattes = read_mattes(root.member("mattes"), palette.mattes);
    result.edits = read_edits(root.member("edits"), result);
    return result;
}

Sidecar parse_sidecar(const std::string& text, const std::string& name) {
    return sidecar_of(json_tree(text, name), name);
}

ColourConversion parse_conversion(const std::string& text, const std::string& name) {
    const Json tree = json_tree(text, name);
    const Cursor steps(tree, name);
    const Schema& clip = sidecar_schema().member("clip");
    check(steps, clip.member("conversion").member("steps"), kSidecarVersion);
    return read_steps(steps);
}

Sidecar read_sidecar(const std::string& path) {
    namespace fs = std::filesystem;
    const char* const wanted = "a sidecar file (*.p4d.json)";
    std::error_code problem;
    fs::path native;
    try {
        native = fs::u8path(path);
    } catch (const std::exception&) {  // Windows: not every text is a path
        throw SidecarError(path, "", "an unreadable path (no valid UTF-8)", wanted);
    }
    const fs::file_status status = fs::status(native, problem);
    if (!fs::exists(status)) {
        if (status.type() == fs::file_type::none) {
            throw SidecarError(path, "", "an unreadable path (" + problem.message() + ')', wanted);
        }
        throw SidecarError(path, "", "no such file", wanted);
    }
    if (fs::is_directory(status)) throw SidecarError(path, "", "a folder", wanted);
    if (!fs::is_regular_file(status)) throw SidecarError(path, "", "no regular file", wanted);
    // One byte more: the parser refuses a large one by its size.
    const std::optional<std::string> text = bytes_of(native, kMaxSidecarBytes + 1);
    if (!text) throw SidecarError(path, "", "a file that cannot be read", wanted);
    return parse_sidecar(*text, path);
}

}  // namespace palette4d
