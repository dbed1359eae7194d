#include "client/evaluation/report/report.h"

#include <cmath>
#include <span>
#include <string_view>
#include <utility>

#include "client/evaluation/metrics/compare.h"
#include "client/evaluation/report/study_tables.h"
#include "client/output/text.h"
#include "common/json_text.h"

namespace partiemc::evaluation {
namespace {

using client::AppendAll;
using client::Concat;

std::string JsonNumber(double value) { return std::isfinite(value) ? Concat(value) : "null"; }

// "[" item "," item "]": append(out, item) writes one.
template <typename Items, typename AppendItem>
void AppendArray(std::string& out, const Items& items, AppendItem append) {
  out += '[';
  bool first = true;
  for (const auto& item : items) {
    if (!std::exchange(first, false)) out += ",\n";
    append(out, item);
  }
  out += ']';
}

void AppendRow(std::string& out, const Row& row) {
  AppendAll(out, "{\"sequence\":", JsonString(row.sequence), ",\"group\":\"", Name(row.group),
            "\",\"shape\":", JsonString(row.shape), ",\"sampler\":", JsonString(row.sampler),
            ",\"judged\":", row.judged ? "true" : "false", ",\"method\":", JsonString(row.method),
            ",\"knowledge\":\"", Name(row.knowledge), "\",\"ids\":", row.ids ? "true" : "false");
  for (std::size_t k = 0; k < kMetricCount; ++k) {
    const auto metric = static_cast<Metric>(k);
    AppendAll(out, ",\"", Name(metric), "\":", JsonNumber(row[metric]));
  }
  out += '}';
}

// "NAME": ratio, worst first.
void AppendParts(std::string& out, std::span<const Row> rows, std::span<const Row> baseline,
                 Metric metric, By by) {
  out += '{';
  bool first = true;
  for (const Part& part : CompareParts(rows, baseline, std::span(&metric, 1), 0, by)) {
    if (std::isnan(part.ratios[0].value)) continue;
    AppendAll(out, std::exchange(first, false) ? "" : ",", JsonString(part.name), ":",
              JsonNumber(part.ratios[0].value));
  }
  out += '}';
}

void AppendComparison(std::string& out, std::span<const Row> rows, std::span<const Row> baseline,
                      Metric metric) {
  const Comparison comparison = CompareRows(rows, baseline, metric);
  const Verdict& verdict = comparison.verdict;
  AppendAll(out, "{\"metric\":\"", Name(metric), "\",\"mean\":", JsonNumber(MeanOver(rows, metric)),
            ",\"baseline_mean\":", JsonNumber(MeanOver(baseline, metric)),
            ",\"ratio\":", JsonNumber(comparison.ratio.value),
            ",\"low\":", JsonNumber(comparison.ratio.low),
            ",\"high\":", JsonNumber(comparison.ratio.high),
            ",\"ratio_of_means\":", JsonNumber(comparison.ratio_of_means),
            ",\"wins\":", verdict.wins, ",\"ties\":", verdict.ties, ",\"losses\":", verdict.losses,
            ",\"groups\":");
  AppendParts(out, rows, baseline, metric, By::kGroup);
  out += ",\"samplers\":";
  AppendParts(out, rows, baseline, metric, By::kSampler);
  out += '}';
}

// One object per method, knowledge and kind of sequence.
void AppendComparisons(std::string& out, const Study& study) {
  bool first = true;
  out += '[';
  for (const bool recordings : {false, true}) {
    for (const Knowledge knowledge : study.told) {
      const auto baseline = study.Of(kBaseline, knowledge, recordings);
      for (const StudyMethod& method : study.methods) {
        const auto rows = study.Of(method.method.name, knowledge, recordings);
        if (rows.empty() || method.method.name == kBaseline) continue;
        AppendAll(out, std::exchange(first, false) ? "" : ",\n",
                  "{\"method\":", JsonString(method.method.name), ",\"knowledge\":\"",
                  Name(knowledge), "\",\"recordings\":", recordings ? "true" : "false",
                  ",\"metrics\":");
        AppendArray(out, JudgedMetrics(recordings), [&](std::string& text, Metric metric) {
          AppendComparison(text, rows, baseline, metric);
        });
        out += '}';
      }
    }
  }
  out += ']';
}

void AppendClaim(std::string& out, const Claim& claim) {
  AppendAll(out, "{\"about\":", JsonString(claim.about), ",\"subject\":", JsonString(claim.subject),
            ",\"finding\":\"", Name(claim.finding), "\",\"sentence\":", JsonString(claim.sentence),
            '}');
}

void AppendFill(std::string& out, const FillRow& fill) {
  AppendAll(out, "{\"shape\":", JsonString(fill.shape), ",\"cells\":", fill.cells,
            ",\"grid\":", fill.grid, ",\"greedy\":", fill.greedy,
            ",\"conforming\":", fill.conforming, ",\"polygon\":", fill.polygon,
            ",\"greedy_t_junctions\":", fill.greedy_t_junctions,
            ",\"conforming_t_junctions\":", fill.conforming_t_junctions,
            ",\"same_rings\":", fill.same_rings ? "true" : "false", '}');
}

void AppendFilm(std::string& out, const FilmRun& run) {
  AppendAll(out, "{\"placement\":\"", Name(run.placement), "\",\"fill\":\"", Name(run.fill),
            "\",\"milliseconds\":", JsonNumber(run.milliseconds), ",\"triangles\":");
  AppendArray(out, run.triangles,
              [](std::string& text, double count) { text += JsonNumber(count); });
  out += '}';
}

void AppendThinned(std::string& out, const ShareRow& thinned) {
  AppendAll(out, "{\"share\":", thinned.share, ",\"spacing_ratio\":", thinned.spacing_ratio,
            ",\"row\":");
  AppendRow(out, thinned.row);
  out += '}';
}

// Of a study, for the terminal: what counts first. Parts of the default and its variants only; the
// page has them of all.
std::vector<Table> StudyTables(const Study& study) {
  std::vector<Table> tables;
  for (const bool recordings : {false, true}) {
    if (study.Of(kBaseline, study.told.front(), recordings).empty()) continue;
    for (const Knowledge knowledge : study.told) {
      const Selection selection{knowledge, recordings};
      tables.push_back(RatioTable(study, selection));
      if (Table steps = StepTable(study, selection); !steps.rows.empty()) {
        tables.push_back(std::move(steps));
      }
      for (const StudyMethod& method : study.methods) {
        const std::string& name = method.method.name;
        if (method.is_step || method.method.parameters.placement != Placement::kVirtualPlane ||
            study.Of(name, knowledge, recordings).empty()) {
          continue;
        }
        for (Table& table : DetailTables(study, selection, name)) {
          tables.push_back(std::move(table));
        }
      }
      tables.push_back(MeansTable(study, selection));
      tables.push_back(OtherMeansTable(study, selection));
      tables.push_back(StageTable(study, selection));
    }
  }
  tables.push_back(NeighbourTable(study));
  return tables;
}

}  // namespace

std::vector<std::string> NotesOf(const Evaluation& evaluation) {
  std::vector<std::string> notes = {
      evaluation.study.ToldIds(false)
          ? "Synthetic sequences: methods were told which particle is which (--ids)."
          : "Synthetic sequences: methods were not told which particle is which; --ids tells "
            "them."};
  if (evaluation.study.HasRecordings()) {
    notes.emplace_back(
        evaluation.study.ToldIds(true)
            ? "Recordings: methods were told which particle is which where a recording has ids."
            : "Recordings: none has ids; methods were not told which particle is which.");
  }
  notes.insert(notes.end(), evaluation.notes.begin(), evaluation.notes.end());
  return notes;
}

std::string EvaluationText(const Evaluation& evaluation) {
  std::string out;
  for (const Table& table : StudyTables(evaluation.study)) out += AsText(table);
  for (const Table& table : PaperTables(evaluation.study, evaluation.paper)) out += AsText(table);
  out += AsText(FillTable(evaluation.paper.fills));
  out += "What of the paper reproduces\n";
  for (const Claim& claim : evaluation.claims) {
    AppendAll(out, claim.about, ", ", claim.subject, ": ", claim.sentence, "\n");
  }
  for (const std::string& note : NotesOf(evaluation)) AppendAll(out, note, "\n");
  return out;
}

std::string EvaluationCsv(const Study& study) {
  std::string out = "sequence,group,shape,sampler,judged,method,knowledge,ids";
  for (std::size_t k = 0; k < kMetricCount; ++k) {
    AppendAll(out, ',', Name(static_cast<Metric>(k)));
  }
  out += '\n';
  const auto quoted = [](std::string_view text) {
    std::string cell = "\"";
    for (const char c : text) {
      if (c == '"') cell += '"';
      cell += c;
    }
    return cell + '"';
  };
  for (const Row& row : study.rows) {
    AppendAll(out, quoted(row.sequence), ',', Name(row.group), ',', quoted(row.shape), ',',
              quoted(row.sampler), ',', row.judged ? '1' : '0', ',', row.method, ',',
              Name(row.knowledge), ',', row.ids ? '1' : '0');
    for (const double value : row.values) {
      out += ',';
      if (std::isfinite(value)) client::AppendNumber(out, value);
    }
    out += '\n';
  }
  return out;
}

std::string EvaluationJson(const Evaluation& evaluation) {
  std::string out = Concat("{\"set\":", JsonString(evaluation.set), ",\n\"recordings\":");
  const auto append_string = [](std::string& text, const std::string& word) {
    text += JsonString(word);
  };
  AppendArray(out, evaluation.recordings, append_string);
  out += ",\n\"notes\":";
  AppendArray(out, NotesOf(evaluation), append_string);
  out += ",\n\"methods\":";
  AppendArray(out, evaluation.study.methods, [&](std::string& text, const StudyMethod& method) {
    AppendAll(text, "{\"name\":", JsonString(method.method.name),
              ",\"remark\":", JsonString(method.remark), '}');
  });
  out += ",\n\"rows\":";
  AppendArray(out, evaluation.study.rows, AppendRow);
  out += ",\n\"comparisons\":";
  AppendComparisons(out, evaluation.study);
  out += ",\n\"claims\":";
  AppendArray(out, evaluation.claims, AppendClaim);
  out += ",\n\"film\":";
  AppendArray(out, evaluation.paper.film, AppendFilm);
  out += ",\n\"thinned\":";
  AppendArray(out, evaluation.paper.thinned, AppendThinned);
  out += ",\n\"fills\":";
  AppendArray(out, evaluation.paper.fills, AppendFill);
  return out + "}\n";
}

}  // namespace partiemc::evaluation
