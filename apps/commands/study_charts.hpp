#pragma once

#include <string>
#include <vector>

#include "apps/plots/pictures.hpp"
#include "apps/study/study.hpp"
#include "apps/study/study_file.hpp"

namespace livetet {

/// Charts of an output of the converged solves against each varied numerical input. With several
/// inputs the points are grouped, for their colours, by the next one: its values, or five parts of
/// its range where there are more than six. Axes have names and units of the scene's reference.
std::vector<ScatterChart> study_charts(const StudyTable& table, const Study& study,
                                       const std::string& output);

}  // namespace livetet
