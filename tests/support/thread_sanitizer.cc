// What ThreadSanitizer is told about code that is not ours: oneTBB as Debian builds it is not
// instrumented, so that its own calls of memcmp, delete and the like look unordered. What tasks do
// is not hidden by this: they are called by oneTBB, and call it back, in code of ours
// (fork_join.h). Nor does oneTBB wait for its own threads when a program ends: one that leaves just
// then looks as if it had been forgotten.
extern "C" const char* __tsan_default_suppressions() {
  return "called_from_lib:libtbb.so\n"
         "thread:libtbb.so\n";
}

// Threads of a pool are still there when a program ends; it need not wait a second to see them
// race.
extern "C" const char* __tsan_default_options() { return "atexit_sleep_ms=50"; }
