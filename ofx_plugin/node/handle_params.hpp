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
#include "sidecar_cache.hpp"

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
/// The colours that show_handles() has given to an instance's slot, and nobody else.
struct ShownHandle {
    std::optional<Vec3> given;     ///< the last one
    std::optional<Vec3> before;    ///< what it took the place of, if it was among the last given
    std::optional<Vec3> declined;  ///< one that the user has undone
};
using ShownHandles = std::array<ShownHandle, kHandleSlots>;

/// For instance changes only. Labels the slots after the sidecar's handles, hides those that it has
/// no handle for, and gives slots that are not in use their handle's colour, so that they begin
/// from there; one that holds another colour than was given to it keeps that, since the user has
/// taken it out of use, or has changed it and the host is about to say so. Without a sidecar all
/// stay as they are.
void show_handles(const Params& params, const Sidecar* sidecar, ShownHandles& shown);
/// For instance changes only, where no sidecar is chosen: the slots look as they were described.
void show_no_handles(const Params& params);
/// For instance changes only, first of all. A host may undo what show_handles() has set, and tell
/// of it as of the user's edits, which it is not: all colours that were given together are what
/// they were before. They are not given again at once, or there would be no way back beyond that
/// step.
void notice_undone(const Params& params, ShownHandles& shown);
/// For instance changes by the user. A colour that is changed comes into use; a slot that comes
/// into use keeps its handle's id, whatever the sidecar's order will be. Where a sidecar is chosen,
/// or read on demand, undone colours are given again. True when it set anything.
bool handle_changed(const Params& params, const Sidecar* sidecar, const std::string& name,
                    ShownHandles& shown);

}  // namespace palette4d::node
