// The page: sections in their order, around tables, pictures and curves.
#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "client/evaluation/report/picture.h"
#include "client/evaluation/report/report.h"
#include "client/evaluation/report/study_tables.h"
#include "client/output/html.h"
#include "client/output/text.h"

namespace partiemc::evaluation {
namespace page {
extern const std::string_view kEvaluationCss;
}

namespace {

using client::AppendAll;
using client::Concat;
using client::EscapeHtml;

std::string Mark(Finding finding) {
  constexpr std::string_view kWords[] = {"reproduces", "weaker", "does not reproduce"};
  return Concat("<span class=\"mark ", Name(finding), "\">",
                kWords[static_cast<std::size_t>(finding)], "</span>");
}

std::string Tally(const std::vector<Claim>& claims) {
  std::string out = "<div class=\"tally\">";
  for (const Finding finding : {Finding::kReproduces, Finding::kWeaker, Finding::kFails}) {
    const auto count = std::ranges::count(claims, finding, &Claim::finding);
    AppendAll(out, "<span><b>", count, "</b>", Mark(finding), "</span>");
  }
  return out + "</div>\n";
}

std::string ClaimList(const std::vector<Claim>& claims) {
  std::string out = "<ul class=\"claims\">\n";
  for (const Claim& claim : claims) {
    AppendAll(out, "<li><span class=\"about\">", EscapeHtml(claim.about), "</span><span>",
              Mark(claim.finding), "<span class=\"subject\">", EscapeHtml(claim.subject),
              "</span></span><span>", EscapeHtml(claim.sentence), "</span></li>\n");
  }
  return out + "</ul>\n";
}

// The claims about one table or figure, below its pictures.
std::string ClaimsAbout(const Evaluation& evaluation, std::string_view about) {
  std::string out = "<ul class=\"claims short\">\n";
  for (const Claim& claim : evaluation.claims) {
    if (claim.about != about) continue;
    AppendAll(out, "<li><span>", Mark(claim.finding), "<span class=\"subject\">",
              EscapeHtml(claim.subject), "</span></span><span>", EscapeHtml(claim.sentence),
              "</span></li>\n");
  }
  return out + "</ul>\n";
}

std::string Section(std::string_view heading, std::string_view text, const std::string& content) {
  std::string out = Concat("<section class=\"card\"><h2>", heading, "</h2>\n");
  if (!text.empty()) AppendAll(out, "<p class=\"headline\">", text, "</p>\n");
  return out + content + "</section>\n";
}

std::string Key(bool with_truth) {
  return Concat("<p class=\"key\"><i class=\"outline\"></i>reconstructed",
                with_truth ? "<i class=\"truth\"></i>true boundary" : "", "</p>\n");
}

std::string_view Style(Placement placement) {
  switch (placement) {
    case Placement::kMarchingSquares:
      return "squares";
    case Placement::kFarthestParticle:
      return "farthest";
    case Placement::kVirtualPlane:
      return "plane";
    case Placement::kQef:
      return "other";
  }
  return "";
}

Series SeriesOf(Placement placement, std::string_view suffix, std::vector<double> values) {
  return {Concat(Name(placement), suffix), std::string(Style(placement)), std::move(values)};
}

constexpr std::string_view kAboutScenes =
    "Ratios are geometric means over the sequences, each of which counts alike; every method has "
    "its own calibration, the field and its guard are the same.";
constexpr std::string_view kAboutRecordings =
    "Only a few tell their true boundary, or where walls are: areas are compared with the sum of "
    "the particles' volumes, "
    "contours "
    "with the one before, carried along by the particles. Where particles scatter, nobody knows "
    "how "
    "a contour should move, and what is measured there is that. 'Motion known' leaves out such "
    "places: whether one is told is for the particles around it to say, not for the contour.";
std::string MethodSections(const Evaluation& evaluation) {
  const Study& study = evaluation.study;
  std::string out;
  for (const bool recordings : {false, true}) {
    if (recordings && !study.HasRecordings()) continue;
    std::string content;
    for (const Knowledge knowledge : study.told) {
      const Selection selection{knowledge, recordings};
      content += AsHtml(RatioTable(study, selection));
      if (const Table steps = StepTable(study, selection); !steps.rows.empty()) {
        content += AsHtml(steps);
      }
      const std::string_view whole = Name(Placement::kVirtualPlane);
      if (!study.Of(whole, knowledge, recordings).empty()) {
        for (const Table& table : DetailTables(study, selection, whole)) content += AsHtml(table);
      }
      content += AsHtml(MeansTable(study, selection)) + AsHtml(OtherMeansTable(study, selection)) +
                 AsHtml(StageTable(study, selection));
      content += recordings ? "<details><summary>By recording, the other methods</summary>"
                            : "<details><summary>By group and sampler, the other methods</summary>";
      for (const StudyMethod& method : study.methods) {
        const std::string& name = method.method.name;
        if (name == kBaseline || name == whole || method.is_step ||
            study.Of(name, knowledge, recordings).empty()) {
          continue;
        }
        for (const Table& table : DetailTables(study, selection, name)) content += AsHtml(table);
      }
      content += "</details>\n";
    }
    out += Section(recordings ? "Methods on recordings" : "Methods on synthetic sequences",
                   recordings ? kAboutRecordings : kAboutScenes, content);
  }
  return out;
}

std::string PaperTableSection(const Evaluation& evaluation) {
  constexpr std::array<std::string_view, 4> kNames = {"Table 1", "Table 2", "Table 3", "Table 4"};
  const std::vector<Table> tables = PaperTables(evaluation.study, evaluation.paper);
  std::string content;
  for (std::size_t k = 0; k < tables.size(); ++k) {
    content += AsHtml(tables[k]) + ClaimsAbout(evaluation, kNames[k]);
  }
  return Section("The paper&#39;s Tables 1 to 4",
                 "Its figures beside ours. The paper&#39;s placement is measured as "
                 "farthest-particle, section 3.5 to the letter.",
                 content);
}

std::string FeatureSection(const Evaluation& evaluation) {
  return Section(
      "Figure 5: features and volume",
      "The paper: marching cubes smooths features and loses volume, the proposed method "
      "keeps both.",
      PictureRow(evaluation.paper.feature_shots) + Key(true) + ClaimsAbout(evaluation, "Figure 5"));
}

std::vector<double> ThinnedValues(const PaperRuns& runs, Placement placement, Metric metric) {
  std::vector<double> values;
  for (const ShareRow& row : runs.thinned) {
    if (row.row.method == Name(placement)) values.push_back(row.row[metric] * row.spacing_ratio);
  }
  return values;
}

std::string ThinningSection(const Evaluation& evaluation) {
  const PaperRuns& runs = evaluation.paper;
  std::string content;
  for (std::size_t p = 1; p < kFigurePlacements.size(); ++p) {  // The baseline is in the curves.
    std::vector<Shot> shots;
    for (std::size_t k = p; k < runs.thinned_shots.size(); k += kFigurePlacements.size()) {
      shots.push_back(runs.thinned_shots[k]);
    }
    content += PictureRow(shots);
  }
  content += Key(true);
  std::vector<Series> hausdorff, jitter;
  for (const Placement placement : kFigurePlacements) {
    hausdorff.push_back(
        SeriesOf(placement, "", ThinnedValues(runs, placement, Metric::kHausdorff)));
    jitter.push_back(SeriesOf(placement, "", ThinnedValues(runs, placement, Metric::kMeanJitter)));
  }
  const std::vector<std::string> labels = {"100 %", "80 %", "50 %", "30 %"};
  content +=
      Concat("<div class=\"plots\">",
             BarChart("Hausdorff distance by share of particles, h at 100 %", labels, hausdorff),
             BarChart("Mean jitter by share of particles, h at 100 %", labels, jitter), "</div>\n");
  return Section(
      "Figures 6 and 10: fewer particles",
      "The paper: outlines stay stable with 80, 50 and 30 % of the particles. The same "
      "particles are left out in every frame; each method is told the spacing that is "
      "left. Lengths in spacings of the full set.",
      content + ClaimsAbout(evaluation, "Figure 6") + ClaimsAbout(evaluation, "Figure 10"));
}

std::string GridSections(const Evaluation& evaluation) {
  const PaperRuns& runs = evaluation.paper;
  return Section("Figure 11: merging on two grids",
                 Concat("32 and 64 cells across the bounding square of frame ", runs.grid_frame,
                        " of ", EscapeHtml(runs.film_name),
                        "; without and with greedy merging, virtual-plane."),
                 PictureRow(runs.grid_shots) + ClaimsAbout(evaluation, "Figure 11")) +
         Section("Figure 12: frames and their triangles",
                 Concat("Four frames of ", EscapeHtml(runs.film_name), ", virtual-plane, greedy."),
                 PictureRow(runs.film_shots) + ClaimsAbout(evaluation, "Figure 12")) +
         Section("Figure 13: two resolutions",
                 "The same frame; the paper: low resolution keeps shape and features.",
                 PictureRow(runs.resolution_shots) + ClaimsAbout(evaluation, "Figure 13"));
}

std::string CountSection(const Evaluation& evaluation) {
  const PaperRuns& runs = evaluation.paper;
  std::vector<std::string> labels;
  for (std::size_t t = 0; t < runs.film_frames; ++t) labels.push_back(Concat(t));
  const std::vector<Series> series = {
      SeriesOf(Placement::kMarchingSquares, ", grid",
               runs.FilmOf(Placement::kMarchingSquares, Fill::kGrid).triangles),
      SeriesOf(Placement::kFarthestParticle, ", greedy",
               runs.FilmOf(Placement::kFarthestParticle, Fill::kGreedy).triangles),
      SeriesOf(Placement::kVirtualPlane, ", greedy",
               runs.FilmOf(Placement::kVirtualPlane, Fill::kGreedy).triangles)};
  return Section(
      "Figure 14: triangles over the frames",
      "The paper: fewer triangles than marching squares in every frame, and steadier.",
      Concat("<div class=\"plots\">",
             LineChart(Concat("Triangles, frames of ", runs.film_name), labels, series),
             LineChart("The merged ones alone", labels, std::span(series).subspan(1)), "</div>\n") +
          ClaimsAbout(evaluation, "Figure 14"));
}

std::string FillSection(const PaperRuns& runs) {
  std::string plots = "<div class=\"plots\">";
  for (const int cells : {32, 64}) {
    std::vector<std::string> labels;
    std::vector<Series> series = {{"grid", "squares", {}},
                                  {"greedy", "plane", {}},
                                  {"conforming", "other", {}},
                                  {"polygon", "farthest", {}}};
    for (const FillRow& fill : runs.fills) {
      if (fill.cells != cells) continue;
      labels.push_back(fill.shape);
      series[0].values.push_back(fill.grid);
      series[1].values.push_back(fill.greedy);
      series[2].values.push_back(fill.conforming);
      series[3].values.push_back(fill.polygon);
    }
    plots += BarChart(Concat("Triangles at ", cells, " x ", cells), labels, series);
  }
  return Section("Fills", "What merging leaves of the grid&#39;s triangles, by shape.",
                 plots + "</div>\n<details><summary>The numbers</summary>" +
                     AsHtml(FillTable(runs.fills)) + "</details>\n");
}

std::string NotesSection(const Evaluation& evaluation) {
  std::string content =
      "<p class=\"headline\">Hausdorff and mean deviation: symmetric, curves sampled every 0.1 "
      "spacings. Area bias: size of the mean signed relative area error. Area deviation: Eq. 29 "
      "and 30 on the area over the true area. Jitter: deviation of a contour from the one before, "
      "carried along by the known motion. Motion known, on recordings: a sample of either contour "
      "counts if its place in the other frame is told within 0.1 spacings, by the standard error "
      "of the displacement fitted to the particles around it, in both frames, and by how far the "
      "way back misses it, and if all those particles are in both frames. True boundary: the "
      "outline that holds the particles&#39; "
      "area. Outermost centres: the curve half a spacing inside it. A claim reproduces if at least "
      "nine tenths of the paper&#39;s effect are there; it is weaker if the direction is right and "
      "more than 2 % are left of it.</p>\n";
  for (const std::string& note : NotesOf(evaluation)) {
    AppendAll(content, "<p class=\"headline\">", EscapeHtml(note), "</p>\n");
  }
  content += "<div class=\"wide\"><table class=\"parameters\"><tbody>\n";
  for (const StudyMethod& method : evaluation.study.methods) {
    AppendAll(content, "<tr><th scope=\"row\">", EscapeHtml(method.method.name), "</th><td>",
              EscapeHtml(method.remark), "</td></tr>\n");
  }
  return Section("How it was measured", "", content + "</tbody></table></div>\n");
}

std::string Subtitle(const Evaluation& evaluation) {
  std::string out =
      Concat(evaluation.sequences, " synthetic sequences of the set ", evaluation.set);
  for (const std::string& recording : evaluation.recordings) AppendAll(out, ", ", recording);
  return Concat(out, "; ", evaluation.study.methods.size(), " methods");
}

}  // namespace

std::string EvaluationHtml(const Evaluation& evaluation) {
  std::string out = Concat(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta name=\"color-scheme\" content=\"light dark\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; "
      "style-src 'unsafe-inline'\">\n<title>Evaluation: ",
      EscapeHtml(evaluation.set), " &middot; PartiEMC</title>\n<style>\n", page::kEvaluationCss,
      "</style>\n</head>\n<body>\n<header><h1>", "Evaluation: ", EscapeHtml(evaluation.set),
      "</h1><p>", EscapeHtml(Subtitle(evaluation)), "</p></header>\n<main>\n");
  out += Section("What of the paper reproduces",
                 "Computed from the runs on this page, for the paper&#39;s placement "
                 "(farthest-particle) and for our default (virtual-plane).",
                 Tally(evaluation.claims) + "<details open><summary>All claims</summary>" +
                     ClaimList(evaluation.claims) + "</details>\n");
  out += MethodSections(evaluation) +
         Section("Particles", "", AsHtml(NeighbourTable(evaluation.study))) +
         PaperTableSection(evaluation) + FeatureSection(evaluation) + ThinningSection(evaluation) +
         GridSections(evaluation) + CountSection(evaluation) + FillSection(evaluation.paper) +
         NotesSection(evaluation);
  return out + "</main>\n</body>\n</html>\n";
}

}  // namespace partiemc::evaluation
