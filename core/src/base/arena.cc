#include "partiemc/arena.h"

#include "base/parallel.h"

namespace partiemc {

Arena::Arena(unsigned threads) : arena_(erased::MakeArena(threads)) {}

Arena::~Arena() { erased::DeleteArena(arena_); }

void Arena::Execute(absl::FunctionRef<void()> body) {
  ForkJoin fork_join;
  erased::Execute(*arena_, erased::ActionOf(fork_join, body));
}

}  // namespace partiemc
