// What `partiemc evaluate` prints and writes.
#pragma once

#include <string>
#include <vector>

#include "client/evaluation/metrics/study.h"
#include "client/evaluation/paper/claims.h"
#include "client/evaluation/paper/paper.h"

namespace partiemc::evaluation {

struct Evaluation {
  std::string set;  ///< Name of the synthetic set.
  std::size_t sequences = 0;
  std::vector<std::string> recordings;  ///< Names, for people.
  std::vector<std::string> notes;       ///< What a reader should know: an estimated spacing, ...
  Study study;
  PaperRuns paper;
  std::vector<Claim> claims;
};

/// Whether methods were told which particle is which, then the notes of the evaluation.
std::vector<std::string> NotesOf(const Evaluation& evaluation);

/// The tables and the claims, for a terminal: synthetic sequences first, then recordings.
std::string EvaluationText(const Evaluation& evaluation);

/// A line per sequence, method and knowledge, with all metrics; absent ones are empty. `ids` is 1
/// where the method was told which particle is which.
std::string EvaluationCsv(const Study& study);

/// One object: set, recordings, notes, methods, rows, comparisons, claims, film, thinned, fills.
/// Absent numbers are null.
std::string EvaluationJson(const Evaluation& evaluation);

/// One page that needs nothing else, no script either.
std::string EvaluationHtml(const Evaluation& evaluation);

}  // namespace partiemc::evaluation
