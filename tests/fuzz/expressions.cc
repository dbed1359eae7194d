// Texts from the command line: each line for another flag; or a times file.
#include <array>
#include <string>
#include <vector>

#include "client/cli/replay_parameters.h"
#include "client/input/base/columns.h"
#include "client/input/base/natural_order.h"
#include "client/input/base/number_text.h"
#include "client/input/frame_range.h"
#include "client/input/sequence.h"
#include "client/input/times.h"
#include "fuzz/choices.h"
#include "fuzz/memory_file.h"
#include "fuzz/require.h"
#include "fuzz/targets.h"
#include "partiemc/status.h"

namespace partiemc::fuzz {
namespace {

using namespace client::input;
using client::NaturalLess;

void RequireWithin(const ColumnPlan& plan, const ColumnRequest& request) {
  const auto within = [&](const std::optional<std::size_t>& column) {
    Require(!column || *column < plan.column_count, "a planned column is there");
  };
  std::size_t axes = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    within(plan.positions[axis]);
    within(plan.velocities[axis]);
    axes += plan.positions[axis].has_value();
  }
  Require(axes >= 2, "positions have two or three axes");
  within(plan.id);
  within(plan.volume);
  Require(plan.conditions.size() == request.conditions.size(), "a condition has its column");
  for (const std::size_t column : plan.conditions) within(column);
}

void TryColumns(std::string_view select, std::string_view columns,
                const std::vector<std::string>& names) {
  auto request = ParseColumnRequest({std::string(select)}, columns);
  if (!request.ok()) request = ParseColumnRequest({}, columns);
  if (!request.ok()) return;
  for (const Condition& condition : request->conditions) {
    condition.Holds(select);
    condition.Holds(1.0);
  }
  NamesHoldPositions(names);
  if (const auto plan = PlanNamedColumns(names, *request); plan.ok())
    RequireWithin(*plan, *request);
  if (const auto plan = PlanUnnamedColumns(names.size(), *request); plan.ok()) {
    RequireWithin(*plan, *request);
  }
}

void TryRange(std::string_view text) {
  const auto range = ParseFrameRange(text);
  if (!range.ok()) return;
  Require(range->step > 0, "a range moves on");
  std::size_t count = 0;
  for (std::size_t index = 0; index < 100; ++index) count += range->Contains(index);
  Require(range->CountOf(100) == count, "a range knows how many frames it has");
}

void TryNumbers(std::string_view text) {
  ParseCount(text);
  if (const auto number = ParseNumber(text)) {
    const auto again = ParseNumber(ShortestNumber(*number));
    Require(again && (*again == *number || *number != *number), "a number reads back");
  }
  client::PositiveNumber(text);
  client::RateOf(text).IgnoreError();
}

void TryFlags(std::string_view spacing, std::string_view names) {
  client::ReplayFlags flags;
  flags.spacing = spacing;
  flags.placement = names;
  flags.fill = names;
  if (names.empty()) {
    flags = client::ReplayFlags{};
    flags.spacing = spacing;
  }
  const auto parameters = client::ParametersOf(flags, std::nullopt);
  if (parameters.ok()) RequireOk(Validate(*parameters), "flags that are taken are legal");
}

void TryOrder(std::string_view a, std::string_view b, std::string_view c) {
  Require(!NaturalLess(a, a), "no name comes before itself");
  Require(!(NaturalLess(a, b) && NaturalLess(b, a)), "an order is one-way");
  Require(!(NaturalLess(a, b) && NaturalLess(b, c)) || NaturalLess(a, c), "an order is transitive");
}

void TryTimes(std::string_view text) {
  const MemoryFile file(text);
  IsTimesFile(file.path());
  ReadTimes(file.path()).IgnoreError();
}

}  // namespace

void AttackExpressions(Bytes bytes) {
  Choices choices(bytes);
  if (choices.Below(16) == 0) {
    TryTimes(choices.TakeRest());
    return;
  }
  const std::string_view select = choices.TakeUntil('\n'), columns = choices.TakeUntil('\n'),
                         frames = choices.TakeUntil('\n'), number = choices.TakeUntil('\n');
  const std::string_view rest = choices.TakeRest();
  Choices words(Bytes(reinterpret_cast<const std::uint8_t*>(rest.data()), rest.size()));
  std::vector<std::string> names;
  while (!words.empty()) names.emplace_back(words.TakeUntil(','));
  TryColumns(select, columns, names);
  TryRange(frames);
  TryNumbers(number);
  TryFlags(number, select);
  TryOrder(select, columns, frames);
}

}  // namespace partiemc::fuzz
