#include "handle_params.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <locale>
#include <sstream>
#include <vector>

#include "model/handles.hpp"
#include "output_params.hpp"

namespace palette4d::node {
namespace {

constexpr double kLargest = 1e6;  ///< a sidecar's limit for colours
/// The colours' default. A host's reset button sets it and reports a user's edit, so it must be a
/// colour that nobody chooses.
constexpr Vec3 kUnset = {0.5, 0.5, 0.501};

/// One slot's names and labels. The strings live as long as the process, since hosts may keep the
/// pointers.
struct Slot {
    std::string colour, use, id;
    std::string colour_label, use_label, id_label;
};

const std::array<Slot, kHandleSlots>& slots() {
    static const std::array<Slot, kHandleSlots> all = [] {
        std::array<Slot, kHandleSlots> made;
        for (int i = 0; i < kHandleSlots; ++i) {
            const std::string number = std::to_string(i + 1);
            const std::string name = "handle" + std::string(i < 9 ? "0" : "") + number;
            made[static_cast<std::size_t>(i)] = {
                name, name + "On", name + "Id", "Handle " + number, "Use " + number, "Id " + number,
            };
        }
        return made;
    }();
    return all;
}

/// The index in handles_of() of a slot's handle, or -1. `id` is the slot's id parameter.
int handle_of(const Sidecar& sidecar, std::size_t slot, const std::string& id) {
    if (!id.empty()) return find_handle(sidecar.polytope, sidecar.edits, id);
    const std::size_t count = sidecar.polytope.vertices().size() + sidecar.edits.stops.size();
    return slot < count ? static_cast<int>(slot) : -1;
}

bool usable(const Vec3& rgb) {
    return std::all_of(rgb.begin(), rgb.end(), [](double c) { return std::abs(c) <= kLargest; });
}

bool close(const Vec3& a, const Vec3& b) {
    // Hosts store colours as floats.
    for (std::size_t c = 0; c < 3; ++c) {
        if (!(std::abs(a[c] - b[c]) <= 1e-6 * std::max(1.0, std::abs(b[c])))) return false;
    }
    return true;
}

/// Whether a slot has this colour at all times.
bool holds(const Params& params, const Slot& slot, const std::optional<Vec3>& colour) {
    if (!colour) return false;
    const auto now = params.rgb_now(slot.colour.c_str());
    return now && close(*now, *colour) && !params.animated(slot.colour.c_str());
}

std::string label_of(const Handle& handle) {
    std::ostringstream text;
    text.imbue(std::locale::classic());
    text << handle.id;
    if (handle.name.empty()) {
        text << (handle.stop ? ", stop at " : ", frame ") << std::round(100 * handle.frame) / 100;
    } else {
        text << ": " << handle.name << ", " << std::nearbyint(handle.frame);
    }
    return text.str();
}

void set_text(const Properties& properties, const char* name, const std::string& text) {
    if (properties.get_string(name) != text) properties.set_string(name, text.c_str());
}

void set_secret(const Properties& properties, bool secret) {
    if (properties.get_int(kOfxParamPropSecret).value_or(0) != int{secret}) {
        properties.set_int(kOfxParamPropSecret, secret);
    }
}

}  // namespace

void define_handle_params(ParamDefiner& define) {
    define.begin_group("handles", "Palette handles");
    define.choice({kParamEditsFrom, "Edits from",
                   "Which edits apply: the sidecar's, the edits made with the handles below, or "
                   "both. If both edit a handle, the edit made here wins."},
                  {"Sidecar", "Host", "Both"}, static_cast<int>(EditsFrom::kBoth));
    define.button({kParamResetHandles, "Reset handles",
                   "Switches off all handles below and removes their keyframes."});
    for (const Slot& slot : slots()) {
        define
            .flag({slot.use.c_str(), slot.use_label.c_str(),
                   "On: this colour replaces the palette colour. A change of the colour switches "
                   "this on, in hosts that report changes to the node."},
                  false)
            .set_int(kOfxParamPropLayoutHint, kOfxParamPropLayoutHintNoNewLine);
        define.colour({slot.colour.c_str(), slot.colour_label.c_str(),
                       "The new colour of this handle, in the palette's encoding. It is linear "
                       "light if Input colour space is set to Scene-linear. May be keyframed."},
                      kUnset, -kLargest, kLargest);
    }
    define.begin_group("handleIds", "Which handles");
    for (const Slot& slot : slots()) {
        define.text(
            {slot.id.c_str(), slot.id_label.c_str(),
             "The id of the palette vertex or colour stop that this handle edits. 'palette4d info' "
             "lists the ids. Empty: the handle of the same number in the sidecar."},
            kOfxParamStringIsSingleLine);
    }
    define.end_group();
}

EditsAt edits_at(const Params& params, const Sidecar& sidecar, OfxTime time) {
    EditsAt result;
    const int from =
        params.int_at(kParamEditsFrom, time).value_or(static_cast<int>(EditsFrom::kBoth));
    result.edits.sidecar = from != static_cast<int>(EditsFrom::kHost);
    if (from == static_cast<int>(EditsFrom::kSidecar)) return result;
    std::vector<HandleColour>& colours = result.edits.host;
    const auto linear = linear_picture(params, sidecar, time);
    for (std::size_t i = 0; i < slots().size(); ++i) {
        const Slot& slot = slots()[i];
        if (params.int_at(slot.use.c_str(), time).value_or(0) == 0) continue;
        const auto rgb = params.rgb_at(slot.colour.c_str(), time);
        if (!rgb || !usable(*rgb)) continue;
        const std::string id = params.string_at(slot.id.c_str(), time).value_or("");
        const int handle = handle_of(sidecar, i, id);
        if (handle < 0) {
            result.note = slot.colour + ": the sidecar has no handle " +
                          (id.empty() ? std::to_string(i + 1) : "'" + id + "'") +
                          "; enter one of its ids, or switch off Use for this handle";
            continue;
        }
        // If two slots have the same handle, the last one counts.
        const auto same = [&](const HandleColour& other) { return other.handle == handle; };
        colours.erase(std::remove_if(colours.begin(), colours.end(), same), colours.end());
        colours.push_back({handle, linear ? linear->to_palette(*rgb) : *rgb});
    }
    std::sort(colours.begin(), colours.end(),
              [](const HandleColour& a, const HandleColour& b) { return a.handle < b.handle; });
    return result;
}

int handle_at(const Params& params, const Sidecar& sidecar, int slot, OfxTime time) {
    if (slot < 1) return -1;
    const auto index = static_cast<std::size_t>(slot - 1);
    std::string id;
    if (slot <= kHandleSlots) id = params.string_at(slots()[index].id.c_str(), time).value_or("");
    return handle_of(sidecar, index, id);
}

int handles_in_use(const Params& params) {
    if (params.int_now(kParamEditsFrom) == static_cast<int>(EditsFrom::kSidecar)) return 0;
    int count = 0;
    for (const Slot& slot : slots()) count += params.int_now(slot.use.c_str()).value_or(0) != 0;
    return count;
}

void notice_undone(const Params& params, ShownHandles& shown) {
    bool all_are_back = true;
    for (std::size_t i = 0; i < shown.size() && all_are_back; ++i) {
        all_are_back = !shown[i].before || holds(params, slots()[i], shown[i].before);
    }
    for (std::size_t i = 0; i < shown.size(); ++i) {
        ShownHandle& slot = shown[i];
        if (all_are_back && slot.before) {
            slot = {slot.before, std::nullopt, slot.given, false, false};
        } else if (holds(params, slots()[i], slot.declined)) {  // redone
            slot = {slot.declined, slot.given, std::nullopt, false, false};
        }
    }
}

void label_handles(const Params& params, const Chosen& chosen) {
    const Sidecar* sidecar = chosen.sidecar();
    if (chosen.any && !sidecar) return;
    std::vector<Handle> handles;
    if (sidecar) handles = handles_of(sidecar->polytope, sidecar->edits);
    for (std::size_t i = 0; i < slots().size(); ++i) {
        const Slot& slot = slots()[i];
        const std::string id = params.string_at(slot.id.c_str(), Params::kAnyTime).value_or("");
        const int at = sidecar ? handle_of(*sidecar, i, id) : -1;
        set_text(params.properties(slot.colour.c_str()), kOfxPropLabel,
                 at < 0 ? slot.colour_label : label_of(handles[static_cast<std::size_t>(at)]));
        // A slot in use stays visible, so that the user can switch it off.
        const bool in_use = params.int_at(slot.use.c_str(), Params::kAnyTime).value_or(0) != 0;
        for (const char* name : {slot.colour.c_str(), slot.use.c_str(), slot.id.c_str()}) {
            set_secret(params.properties(name), sidecar && at < 0 && !in_use);
        }
    }
}

void show_handles(const Params& params, const Chosen& chosen, ShownHandles& shown) {
    const Sidecar* sidecar = chosen.sidecar();
    if (!sidecar) return;
    bool given_one = false;
    const std::vector<Handle> handles = handles_of(sidecar->polytope, sidecar->edits);
    const auto linear = linear_picture(params, *sidecar, 0);
    for (std::size_t i = 0; i < slots().size(); ++i) {
        const Slot& slot = slots()[i];
        const std::string id = params.string_now(slot.id.c_str()).value_or("");
        const int at = handle_of(*sidecar, i, id);
        const bool in_use = params.int_now(slot.use.c_str()).value_or(0) != 0;
        if (at < 0 || in_use || params.animated(slot.colour.c_str())) continue;
        const Vec3& own = handles[static_cast<std::size_t>(at)].rgb;
        const Vec3 rgb = linear ? linear->to_clip(own) : own;
        const auto now = params.rgb_now(slot.colour.c_str());
        if (!now) continue;
        if (close(*now, rgb)) {
            shown[i].given = rgb;
            continue;
        }
        // After a project is opened, the instance has set nothing yet; an id shows earlier use.
        const bool untouched =
            shown[i].given ? close(*now, *shown[i].given) : id.empty() || close(*now, kUnset);
        const std::optional<Vec3>& declined = shown[i].declined;
        if (!untouched || (declined && close(rgb, *declined))) continue;
        if (!given_one) {
            for (ShownHandle& other : shown) other.before.reset();
        }
        given_one = true;
        if (!params.set_rgb(slot.colour.c_str(), rgb)) continue;
        // The colour of a slot that was in use may be typed again after a reset.
        const std::optional<Vec3> before = shown[i].was_used ? std::nullopt : now;
        shown[i] = {rgb, before, std::nullopt, false, false};
    }
}

namespace {

/// Restores the slot's defaults; show_handles() then sets its handle's colour.
void reset(const Params& params, const Slot& slot, ShownHandle& shown) {
    if (params.animated(slot.colour.c_str())) params.remove_keys(slot.colour.c_str());
    const bool in_use = params.int_now(slot.use.c_str()).value_or(0) != 0;
    if (in_use) params.set_int(slot.use.c_str(), 0);
    if (!params.string_now(slot.id.c_str()).value_or("").empty()) {
        params.set_string(slot.id.c_str(), "");
    }
    shown = {params.rgb_now(slot.colour.c_str()), std::nullopt, shown.declined, false, in_use};
}

void colour_changed(const Params& params, const Chosen& chosen, const Slot& slot,
                    ShownHandle& shown) {
    if (holds(params, slot, kUnset)) return reset(params, slot, shown);
    const bool in_use = params.int_now(slot.use.c_str()).value_or(0) != 0;
    if (holds(params, slot, shown.given)) {
        if (in_use && shown.switched_on) reset(params, slot, shown);
    } else if (!in_use && chosen.any) {
        shown.switched_on = params.set_int(slot.use.c_str(), 1);
    }
}

}  // namespace

void handle_changed(const Params& params, const Chosen& chosen, const std::string& name,
                    ShownHandles& shown) {
    if (name == kParamSidecar || name == kParamReload || name == kParamResetHandles) {
        for (ShownHandle& slot : shown) slot.declined.reset();
    }
    if (name == kParamResetHandles) {
        for (std::size_t i = 0; i < slots().size(); ++i) reset(params, slots()[i], shown[i]);
    }
    for (std::size_t i = 0; i < slots().size(); ++i) {
        const Slot& slot = slots()[i];
        if (name != slot.colour && name != slot.use) continue;
        if (name == slot.colour) colour_changed(params, chosen, slot, shown[i]);
        const bool in_use = params.int_now(slot.use.c_str()).value_or(0) != 0;
        const Sidecar* sidecar = chosen.sidecar();
        if (!in_use || !sidecar || !params.string_now(slot.id.c_str()).value_or("").empty()) return;
        const int at = handle_of(*sidecar, i, "");
        if (at < 0) return;
        const std::vector<Handle> handles = handles_of(sidecar->polytope, sidecar->edits);
        params.set_string(slot.id.c_str(), handles[static_cast<std::size_t>(at)].id);
    }
}

}  // namespace palette4d::node
