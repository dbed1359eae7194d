#include "server/base/call_state.h"

#include <algorithm>

namespace partiemc::server {
namespace {

using K = MachineKind;
using P = Phase;
using R = Reading;
using C = Computing;
using W = Writing;

constexpr SetOf<W> kAnyBusyWriting = {W::kOpened, W::kResult, W::kNotice, W::kOpenedThenNotice,
                                      W::kResultThenNotice};
constexpr SetOf<W> kAnyWriting = {W::kIdle,   W::kOpened,           W::kResult,
                                  W::kNotice, W::kOpenedThenNotice, W::kResultThenNotice};

// clang-format off
constexpr LegalStates kLegalStates[] = {
    // Opens.
    {{K::kStream, K::kUnary, K::kWatch}, P::kOpening, R::kFirst, C::kIdle, W::kIdle},
    {{K::kStream, K::kWatch}, P::kOpening, R::kIdle, C::kOpen, W::kIdle},

    // Serving. A stream reads, computes and writes at the same time, a unary call in this order.
    {K::kStream, P::kServing, {R::kIdle, R::kMemory, R::kPermit, R::kNext},
     {C::kIdle, C::kResult}, {W::kIdle, W::kOpened, W::kResult}},
    {K::kUnary, P::kServing, R::kIdle, C::kResult, W::kIdle},
    {K::kUnary, P::kServing, R::kIdle, C::kIdle, W::kResult},
    {K::kWatch, P::kServing, {R::kNext, R::kEnded}, C::kIdle, {W::kIdle, W::kOpened, W::kResult}},

    // The call ends before it is open: the computation that opens it still runs.
    {K::kStream, {P::kEnding, P::kClosing, P::kAbandoned}, R::kIdle, C::kOpen, W::kIdle},
    {K::kWatch, {P::kClosing, P::kAbandoned}, R::kIdle, C::kOpen, W::kIdle},

    // Ending. A frame whose parts are missing may still wait, neither computed nor written.
    {K::kStream, P::kEnding, {R::kIdle, R::kNext, R::kEnded},
     {C::kIdle, C::kResult}, {W::kIdle, W::kOpened, W::kResult}},
    {K::kWatch, P::kEnding, {R::kNext, R::kEnded}, C::kIdle, {W::kIdle, W::kOpened, W::kResult}},

    // Closing. The call is finished as soon as no computation and no write is in progress.
    {K::kStream, P::kClosing, {R::kIdle, R::kNext, R::kEnded}, C::kResult, kAnyWriting},
    {K::kStream, P::kClosing, {R::kIdle, R::kNext, R::kEnded}, C::kIdle, kAnyBusyWriting},
    {K::kWatch, P::kClosing, {R::kNext, R::kEnded}, C::kIdle, W::kNotice},

    {K::kStream, P::kAbandoned, {R::kIdle, R::kNext, R::kEnded}, C::kResult, kAnyWriting},
    {K::kStream, P::kAbandoned, {R::kIdle, R::kNext, R::kEnded}, C::kIdle, kAnyBusyWriting},
    {K::kUnary, P::kAbandoned, R::kIdle, C::kResult, W::kIdle},
    {K::kUnary, P::kAbandoned, R::kIdle, C::kIdle, W::kResult},
    {K::kWatch, P::kAbandoned, {R::kIdle, R::kNext, R::kEnded},
     C::kIdle, {W::kOpened, W::kResult, W::kNotice}},

    // A read may still be in progress.
    {{K::kStream, K::kWatch}, P::kFinished,
     {R::kIdle, R::kFirst, R::kNext, R::kEnded}, C::kIdle, W::kIdle},
    {K::kUnary, P::kFinished, {R::kIdle, R::kFirst, R::kEnded}, C::kIdle, W::kIdle},
};
// clang-format on

}  // namespace

std::span<const LegalStates> AllLegalStates() { return kLegalStates; }

bool IsLegal(const CallState& state) {
  return std::ranges::any_of(kLegalStates, [&](const auto& row) { return row.Has(state); });
}

std::ostream& operator<<(std::ostream& out, const CallState& state) {
  constexpr const char* kKinds[] = {"stream", "unary call", "watch"};
  constexpr const char* kPhases[] = {"opening", "serving",   "ending",
                                     "closing", "abandoned", "finished"};
  constexpr const char* kReading[] = {"idle", "memory", "permit", "first", "next", "ended"};
  constexpr const char* kComputing[] = {"idle", "open", "result"};
  constexpr const char* kWriting[] = {
      "idle", "opened", "result", "notice", "opened, then notice", "result, then notice"};
  const auto index = [](auto value) { return static_cast<std::size_t>(value); };
  return out << kKinds[index(state.kind)] << ' ' << kPhases[index(state.phase)] << ", reading "
             << kReading[index(state.reading)] << ", computing "
             << kComputing[index(state.computing)] << ", writing "
             << kWriting[index(state.writing)];
}

}  // namespace partiemc::server
