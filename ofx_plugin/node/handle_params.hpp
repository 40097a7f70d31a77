// The palette's handles as host parameters. Their number is fixed, since a host needs the
// parameters before any sidecar. A slot has a colour, a switch (no colour can mean "not set", since
// hosts choose a colour's default) and its handle's id. Without an id, slot n is the sidecar's nth
// handle.
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

/// The edits that apply at a host time, with keyframes.
struct EditsAt {
    AppliedEdits edits;
    std::string note;  ///< names a slot whose handle is not in the sidecar; else empty
};
EditsAt edits_at(const Params& params, const Sidecar& sidecar, OfxTime time);

/// The index in handles_of() of a slot's handle, or -1. Slots count from 1; beyond the last slot, n
/// is the sidecar's nth handle.
int handle_at(const Params& params, const Sidecar& sidecar, int slot, OfxTime time);
/// How many slots are in use; not for use while rendering.
int handles_in_use(const Params& params);
/// What an instance remembers about a slot, as long as the host keeps the instance.
struct ShownHandle {
    std::optional<Vec3> given;     ///< the last colour that show_handles() set
    std::optional<Vec3> before;    ///< the colour before that, if set in the last batch
    std::optional<Vec3> declined;  ///< a colour that the user has undone
    bool switched_on = false;      ///< by handle_changed(), not by the user
    bool was_used = false;         ///< before a reset, whose undo switches it on again
};
using ShownHandles = std::array<ShownHandle, kHandleSlots>;

/// Labels the slots with the sidecar's handles and hides slots without a handle. Without a chosen
/// sidecar the slots keep their default labels; while a file cannot be read they stay unchanged.
/// Sets properties only, which any action may do.
void label_handles(const Params& params, const Chosen& chosen);

// Only in kOfxActionInstanceChanged: all functions below.

/// Sets slots that are not in use to their handle's colour, so that edits start from it. A slot
/// with another colour than the last one set keeps it. The user has then switched the slot off, or
/// the host is about to report the user's change.
void show_handles(const Params& params, const Chosen& chosen, ShownHandles& shown);
/// Call this first. When a host undoes what show_handles() set, it reports user edits; they are
/// not. The sign: all colours that were set together have their old values. They are not set again
/// at once, or the user could never undo past that step.
void notice_undone(const Params& params, ShownHandles& shown);
/// Handles a change by the user. A changed colour switches its slot on, and stores the handle's id
/// in case the sidecar's order changes. Two changes switch the slot off: a reset to the default
/// colour, and undo of the edit that switched it on.
void handle_changed(const Params& params, const Chosen& chosen, const std::string& name,
                    ShownHandles& shown);

}  // namespace palette4d::node
