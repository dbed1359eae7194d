// References to the parts of the server that all calls share.
#pragma once

namespace partiemc::server {

class Authentication;
class ComputePool;
class CurrentCheckpointKeys;
class FinishedStreams;
class HistoryRoom;
class LevelQueue;
class MemoryBudget;
class OpeningCalls;
class Relay;
class StateMemory;
class StreamRegistry;
class UnaryRegistry;
class WatchDispatcher;
class WatchRegistry;
struct ServerLimits;

/// The context and all objects in it outlive the calls. The objects are thread-safe.
struct ServerContext {
  const ServerLimits& limits;
  const Authentication& authentication;
  const CurrentCheckpointKeys& checkpoint_keys;
  const HistoryRoom& history;
  OpeningCalls& opening;
  StreamRegistry& streams;
  FinishedStreams& finished;
  UnaryRegistry& unary_calls;
  WatchRegistry& watchers;
  WatchDispatcher& dispatcher;
  LevelQueue& levels;
  MemoryBudget& budget;
  StateMemory& states;
  ComputePool& pool;
  Relay* relay = nullptr;  ///< Null: only the streams of this server.
};

}  // namespace partiemc::server
