// What of the paper reproduces: its figures beside ours, and a sentence computed from the two.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "client/evaluation/metrics/study.h"
#include "client/evaluation/paper/paper.h"

namespace partiemc::evaluation {

enum class Finding {
  kReproduces,  ///< At least nine tenths of the paper's effect.
  kWeaker,      ///< The same direction, but less of it.
  kFails,       ///< No effect, or the opposite one.
};

std::string_view Name(Finding finding);

/// The worst of two findings that both have to hold.
Finding Both(Finding a, Finding b);

/// The paper says that something is `paper` times something else, we measured `measured` times;
/// less is better. An effect is 1 - ratio. Requires: paper < 1.
Finding JudgeRatio(double paper, double measured);

struct Claim {
  std::string about;    ///< "Table 1", "Figure 14".
  std::string subject;  ///< Which of ours it speaks of: "farthest-particle", "virtual-plane", ...
  Finding finding = Finding::kFails;
  std::string sentence;
};

/// The rows of the paper's Tables 2-4.
struct PaperRow {
  std::string_view method;
  Placement placement;  ///< Ours that it is measured with.
  Fill fill;
  double frame_ms, fps, triangles;
  double hausdorff, mean_deviation;
  double area_deviation, triangle_deviation;
};
std::vector<PaperRow> PaperRows();

/// Triangles of the paper's Table 1, before and after merging, in its two conditions.
struct PaperCondition {
  double before, after;
};
inline constexpr PaperCondition kPaperConditions[2] = {{2106, 630}, {1876, 512}};

/// One claim or more for each table and figure, in the paper's order, about the paper's placement
/// (`farthest-particle`) and about ours. Of the study it uses synthetic rows that were told the
/// first knowledge of the study.
std::vector<Claim> JudgeClaims(const Study& study, const PaperRuns& runs);

}  // namespace partiemc::evaluation
