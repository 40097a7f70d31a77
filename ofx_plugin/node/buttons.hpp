// The buttons that start palette4d from the host, and the clip that they are for.
#pragma once

#include <optional>
#include <string>

#include "param_define.hpp"
#include "params.hpp"
#include "sidecar_choice.hpp"

namespace palette4d::node {

inline constexpr const char* kParamClipFile = "clipFile";
inline constexpr const char* kParamAnalyse = "analyse";
inline constexpr const char* kParamOpenInStudio = "openInStudio";

void define_buttons(ParamDefiner& define);

/// The sidecar that *Analyse* writes: the chosen one, or that of the clip's name beside the clip.
/// Empty while neither is known.
std::string analysis_target(const Params& params, const Chosen& chosen);
/// What *Open in Studio* opens: the sidecar, or the clip where none is loaded. Empty while neither
/// is known.
std::string studio_target(const Params& params, const Chosen& chosen);

// Only in kOfxActionInstanceChanged; both return a line for the status.

/// Starts the analysis of the clip, or stops the one that runs. Chooses the new sidecar where none
/// was chosen, and updates `chosen` then.
std::string push_analyse(const Params& params, Chosen& chosen);
/// Opens the sidecar, or the clip.
std::string push_open_in_studio(const Params& params, const Chosen& chosen,
                                std::optional<double> frame);

}  // namespace palette4d::node
