// The palette's handles as parameters of the host: a fixed pool, since a host knows the parameters
// before any sidecar. A slot holds a colour, whether it is in use (a host's idea of a colour's
// default is its own, so that no colour can stand for "not set"), and the id of its handle; without
// an id, slot n is the nth handle of the sidecar.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "param_define.hpp"
#include "params.hpp"
#include "sidecar_choice.hpp"

namespace palette4d::node {

inline constexpr int kHandleSlots = 32;

/// The options of kParamEditsFrom, in order.
enum class EditsFrom { kSidecar, kHost, kBoth };
inline constexpr const char* kParamEditsFrom = "editsFrom";
inline constexpr const char* kParamResetHandles = "resetHandles";

void define_handle_params(ParamDefiner& define);

/// Which edits apply at a time of the host, its keyframes included.
struct EditsAt {
    AppliedEdits edits;
    std::string note;  ///< names a slot whose handle the sidecar does not have; else empty
};
EditsAt edits_at(const Params& params, const Sidecar& sidecar, OfxTime time);

/// The place in handles_of() of a slot's handle (counted from 1; beyond the slots, the sidecar's
/// nth), or -1.
int handle_at(const Params& params, const Sidecar& sidecar, int slot, OfxTime time);
/// How many slots are in use, outside of rendering.
int handles_in_use(const Params& params);
/// What an instance remembers of a slot, for as long as the host keeps the instance.
struct ShownHandle {
    std::optional<Vec3> given;     ///< the last colour that show_handles() has set
    std::optional<Vec3> before;    ///< what that replaced, if it was among the last set
    std::optional<Vec3> declined;  ///< one that the user has undone
    bool switched_on = false;      ///< by handle_changed(), and not by the user
};
using ShownHandles = std::array<ShownHandle, kHandleSlots>;

/// Labels the slots after the sidecar's handles and hides those that it has no handle for. Without
/// a chosen sidecar the slots look as they were described; while a file cannot be read they stay
/// as they are. Sets properties only, which any action may do.
void label_handles(const Params& params, const Chosen& chosen);

// All below: in kOfxActionInstanceChanged only.

/// Gives slots that are not in use their handle's colour, so that an edit starts from it. A slot
/// that holds any other colour than the one that it was given keeps that: the user has switched the
/// slot off, or has changed the colour and the host is about to say so.
void show_handles(const Params& params, const Chosen& chosen, ShownHandles& shown);
/// Call this first. A host may undo what show_handles() has set, and report it as the user's edits,
/// which it is not: all colours that were set together are what they were before. They are not set
/// again at once, or the user could never undo beyond that step.
void notice_undone(const Params& params, ShownHandles& shown);
/// What the user changed. A changed colour switches its slot on, and the slot keeps its handle's
/// id, whatever the order in the sidecar will be. The colour's default, to which the host's reset
/// buttons go, switches the slot off, and so does undo of the edit that switched it on.
void handle_changed(const Params& params, const Chosen& chosen, const std::string& name,
                    ShownHandles& shown);

}  // namespace palette4d::node
