// The state of a call: its phase, and the progress of reading, computing and writing.
#pragma once

#include <initializer_list>
#include <ostream>
#include <span>

namespace partiemc::server {

enum class MachineKind { kStream, kUnary, kWatch };

enum class Phase {
  kOpening,    ///< The first request has not been accepted.
  kServing,    ///< Requests are answered.
  kEnding,     ///< Accepts no further request, and still sends all responses that are due.
  kClosing,    ///< Like kEnding, but waits neither for parts of frames nor for a watcher's credit.
  kAbandoned,  ///< Sends nothing more. Ends when the computation and the write have ended.
  kFinished,
};

enum class Reading {
  kIdle,
  kMemory,  ///< Waits for memory.
  kPermit,  ///< Waits for a permit.
  kFirst,   ///< Reads the first request.
  kNext,    ///< Reads another request.
  kEnded,   ///< The client has half-closed or disconnected.
};

enum class Computing {
  kIdle,
  kOpen,    ///< The first request of a stream or watch.
  kResult,  ///< A frame, or the request of a unary call.
};

enum class Writing {
  kIdle,
  kOpened,            ///< Writes the response to the first request.
  kResult,            ///< Writes a result or a frame error.
  kNotice,            ///< Writes the drain notice, or the end of a watch.
  kOpenedThenNotice,  ///< As kOpened; a kNotice follows.
  kResultThenNotice,  ///< As kResult; a kNotice follows.
};

struct CallState {
  MachineKind kind = MachineKind::kStream;
  Phase phase = Phase::kOpening;
  Reading reading = Reading::kIdle;
  Computing computing = Computing::kIdle;
  Writing writing = Writing::kIdle;

  friend bool operator==(const CallState&, const CallState&) = default;
};

std::ostream& operator<<(std::ostream& out, const CallState& state);

/// A set of values of one of the enums above.
template <typename Enum>
class SetOf {
 public:
  constexpr SetOf(Enum value) : bits_(Bit(value)) {}
  constexpr SetOf(std::initializer_list<Enum> values) {
    for (const Enum value : values) bits_ |= Bit(value);
  }
  constexpr bool Has(Enum value) const { return (bits_ & Bit(value)) != 0; }

 private:
  static constexpr unsigned Bit(Enum value) { return 1u << static_cast<unsigned>(value); }
  unsigned bits_ = 0;
};

struct LegalStates {
  SetOf<MachineKind> kinds;
  SetOf<Phase> phases;
  SetOf<Reading> reading;
  SetOf<Computing> computing;
  SetOf<Writing> writing;

  constexpr bool Has(const CallState& state) const {
    return kinds.Has(state.kind) && phases.Has(state.phase) && reading.Has(state.reading) &&
           computing.Has(state.computing) && writing.Has(state.writing);
  }
};

/// The table of all states that a call can have between two events. A row has a set of values for
/// each field of CallState. Each combination of these values is legal.
std::span<const LegalStates> AllLegalStates();

bool IsLegal(const CallState& state);

}  // namespace partiemc::server
