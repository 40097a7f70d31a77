// palette4d itself, started from a host: its window, and analyses in the background. Does not
// depend on OpenFX.
#pragma once

#include <optional>
#include <string>

namespace palette4d::node {

/// Opens a sidecar or a clip in Studio, at a frame of it. Returns what went wrong, or nothing.
std::string open_in_studio(const std::string& path, std::optional<double> frame);

/// Why Studio has ended with an error since it was last opened with this path; or nothing. Never
/// waits.
std::string studio_problem(const std::string& path);

/// Why no analysis writes there; or nothing. A project may come from a stranger: what it names is a
/// sidecar by its name, where no shell or program reads files when it starts.
std::string refused_target(const std::string& sidecar);

/// Starts `palette4d analyze CLIP -o SIDECAR`, whose rules say when a file is replaced. One runs at
/// a time for each sidecar. Returns what went wrong, or nothing.
std::string start_analysis(const std::string& clip, const std::string& sidecar);

/// Ends it; false where none runs.
bool cancel_analysis(const std::string& sidecar);

/// What an analysis does; or, until forgotten, why it failed.
struct AnalysisState {
    bool running = false;
    std::string words;  ///< empty: none runs, and the last one has succeeded
};
/// Never waits. All instances and threads see the same; also while rendering.
AnalysisState analysis_state(const std::string& sidecar);
void forget_failures();

}  // namespace palette4d::node
