// Suppressions for code that is not ours. Debian's oneTBB is not instrumented, so its own calls of
// memcmp, delete and others look unordered. This hides no task: oneTBB calls tasks through our
// code, and they call it through our code (fork_join.h). oneTBB also does not join its threads at
// the end of a program, which looks like a thread leak.
extern "C" const char* __tsan_default_suppressions() {
  return "called_from_lib:libtbb.so\n"
         "thread:libtbb.so\n";
}

// A pool's threads still exist at the end of a program; there is no need to wait a second for their
// races.
extern "C" const char* __tsan_default_options() { return "atexit_sleep_ms=50"; }
