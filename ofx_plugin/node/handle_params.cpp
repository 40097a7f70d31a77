#include "handle_params.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <locale>
#include <sstream>
#include <vector>

#include "model/handles.hpp"
#include "sidecar_choice.hpp"

namespace palette4d::node {
namespace {

constexpr double kLargest = 1e6;  ///< what a sidecar may hold

/// One slot's names and labels. The strings live as long as the process: hosts may keep them.
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

/// The place of a slot's handle in handles_of(), or -1. `id` is what the slot holds.
int handle_of(const Sidecar& sidecar, std::size_t slot, const std::string& id) {
    if (!id.empty()) return find_handle(sidecar.polytope, sidecar.edits, id);
    const std::size_t count = sidecar.polytope.vertices().size() + sidecar.edits.stops.size();
    return slot < count ? static_cast<int>(slot) : -1;
}

bool usable(const Vec3& rgb) {
    return std::all_of(rgb.begin(), rgb.end(), [](double c) { return std::abs(c) <= kLargest; });
}

bool close(const Vec3& a, const Vec3& b) {
    // Hosts keep colours as floats.
    for (std::size_t c = 0; c < 3; ++c) {
        if (!(std::abs(a[c] - b[c]) <= 1e-6 * std::max(1.0, std::abs(b[c])))) return false;
    }
    return true;
}

/// Whether a slot holds a colour, at all times.
bool holds(const Params& params, const Slot& slot, const std::optional<Vec3>& colour) {
    if (!colour) return false;
    const auto now = params.rgb_now(slot.colour.c_str());
    return now && close(*now, *colour) && !params.animated(slot.colour.c_str());
}

std::string label_of(const Handle& handle) {
    std::ostringstream text;
    text.imbue(std::locale::classic());
    text << handle.id << (handle.stop ? ", stop at " : ", frame ") << handle.frame;
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
                   "Which edits apply: those in the sidecar, those made here with the handles "
                   "below, or both; where both have one, the handle here counts."},
                  {"Sidecar", "Host", "Both"}, static_cast<int>(EditsFrom::kBoth));
    define.button({kParamResetHandles, "Reset handles", "Takes all handles here out of use."});
    for (const Slot& slot : slots()) {
        define.flag({slot.use.c_str(), slot.use_label.c_str(),
                     "Whether the colour below takes the place of the palette's. Changing the "
                     "colour switches this on, in hosts that tell the node of changes."},
                    false);
        define.colour({slot.colour.c_str(), slot.colour_label.c_str(),
                       "The new colour of this handle, in the numbers of the palette's own "
                       "encoding. May be keyframed."},
                      {0, 0, 0}, -kLargest, kLargest);
    }
    define.begin_group("handleIds", "Which handles");
    for (const Slot& slot : slots()) {
        define.text({slot.id.c_str(), slot.id_label.c_str(),
                     "The id of the palette vertex or colour stop that this handle moves, as "
                     "'palette4d info' lists it. Empty: the sidecar's next one in order."},
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
                          "; choose one of its ids, or take this one out of use";
            continue;
        }
        // Of two slots with one handle the last counts.
        const auto same = [&](const HandleColour& other) { return other.handle == handle; };
        colours.erase(std::remove_if(colours.begin(), colours.end(), same), colours.end());
        colours.push_back({handle, *rgb});
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
            slot = {slot.before, std::nullopt, slot.given};
        } else if (holds(params, slots()[i], slot.declined)) {  // done again
            slot = {slot.declined, slot.given, std::nullopt};
        }
    }
}

void show_no_handles(const Params& params) {
    for (const Slot& slot : slots()) {
        set_text(params.properties(slot.colour.c_str()), kOfxPropLabel, slot.colour_label);
        for (const char* name : {slot.colour.c_str(), slot.use.c_str(), slot.id.c_str()}) {
            set_secret(params.properties(name), false);
        }
    }
}

void show_handles(const Params& params, const Sidecar* sidecar, ShownHandles& shown) {
    if (!sidecar) return;
    bool given_one = false;
    const std::vector<Handle> handles = handles_of(sidecar->polytope, sidecar->edits);
    for (std::size_t i = 0; i < slots().size(); ++i) {
        const Slot& slot = slots()[i];
        const bool in_use = params.int_now(slot.use.c_str()).value_or(0) != 0;
        const std::string id = params.string_now(slot.id.c_str()).value_or("");
        const int at = handle_of(*sidecar, i, id);
        const Handle* handle = at < 0 ? nullptr : &handles[static_cast<std::size_t>(at)];
        const Properties colour = params.properties(slot.colour.c_str());
        set_text(colour, kOfxPropLabel, handle ? label_of(*handle) : slot.colour_label);
        // One that is in use stays to be seen, so that it can be taken out of use.
        for (const char* name : {slot.colour.c_str(), slot.use.c_str(), slot.id.c_str()}) {
            set_secret(params.properties(name), !handle && !in_use);
        }
        if (!handle || in_use || params.animated(slot.colour.c_str())) continue;
        const auto now = params.rgb_now(slot.colour.c_str());
        if (!now) continue;
        // Of a project that was opened it is not known; there an id says that it was in use.
        const bool untouched = shown[i].given ? close(*now, *shown[i].given) : id.empty();
        if (close(*now, handle->rgb)) {
            shown[i].given = handle->rgb;
            continue;
        }
        const std::optional<Vec3>& declined = shown[i].declined;
        if (!untouched || (declined && close(handle->rgb, *declined))) continue;
        if (!given_one) {
            for (ShownHandle& other : shown) other.before.reset();
        }
        given_one = true;
        if (params.set_rgb(slot.colour.c_str(), handle->rgb)) {
            shown[i] = {handle->rgb, now, std::nullopt};
        }
    }
}

bool handle_changed(const Params& params, const Sidecar* sidecar, const std::string& name,
                    ShownHandles& shown) {
    if (name == kParamResetHandles) {
        shown = {};
        for (const Slot& slot : slots()) {
            if (params.int_now(slot.use.c_str()).value_or(0)) params.set_int(slot.use.c_str(), 0);
            if (!params.string_now(slot.id.c_str()).value_or("").empty()) {
                params.set_string(slot.id.c_str(), "");
            }
        }
        return true;
    }
    if (name == kParamSidecar || name == kParamReload) {
        for (ShownHandle& slot : shown) slot.declined.reset();
    }
    for (std::size_t i = 0; i < slots().size(); ++i) {
        const Slot& slot = slots()[i];
        if (name != slot.colour && name != slot.use) continue;
        if (name == slot.colour && params.int_now(slot.use.c_str()) == 0) {
            // What was shown all along is no edit: the host has undone one.
            if (holds(params, slot, shown[i].given)) break;
            params.set_int(slot.use.c_str(), 1);
        }
        const bool in_use = params.int_now(slot.use.c_str()).value_or(0) != 0;
        if (!in_use || !sidecar || !params.string_now(slot.id.c_str()).value_or("").empty()) break;
        const int at = handle_of(*sidecar, i, "");
        if (at < 0) break;
        const std::vector<Handle> handles = handles_of(sidecar->polytope, sidecar->edits);
        params.set_string(slot.id.c_str(), handles[static_cast<std::size_t>(at)].id);
        return true;
    }
    return false;
}

}  // namespace palette4d::node
