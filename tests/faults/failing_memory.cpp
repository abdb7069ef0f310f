// Allocations, and the native stack of a crash after one of them failed. Memory that a program maps does not count.
// See numbering.hpp.
#include <execinfo.h>

#include "numbering.hpp"

using namespace faults;

extern "C" {
void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
void* __libc_memalign(size_t, size_t);
}

namespace {

constexpr int FRAMES = 64;
constexpr int CRASHES[] = {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL};

bool no_memory(size_t bytes) {
  if (kind != Kind::memory || bytes < least_bytes || counter->fetch_add(1) != at) return false;
  errno = ENOMEM;
  return true;
}

void print_stack(int number) {
  constexpr char title[] = "native stack:\n";
  void* frames[FRAMES];
  if (::write(STDERR_FILENO, title, sizeof title - 1) > 0)
    backtrace_symbols_fd(frames, backtrace(frames, FRAMES), STDERR_FILENO);
  signal(number, SIG_DFL);
  raise(number);
}

__attribute__((constructor)) void begin() {
  if (strcmp(variable("FAULT_KIND"), "memory") != 0) return;
  void* frames[1];
  backtrace(frames, 1);  // allocates when it is called for the first time
  for (const int number : CRASHES) signal(number, print_stack);
}

void* aligned(size_t alignment, size_t bytes) { return no_memory(bytes) ? nullptr : __libc_memalign(alignment, bytes); }

}  // namespace

extern "C" {

void* malloc(size_t bytes) { return no_memory(bytes) ? nullptr : __libc_malloc(bytes); }
void* calloc(size_t count, size_t bytes) { return no_memory(count * bytes) ? nullptr : __libc_calloc(count, bytes); }
void* realloc(void* old, size_t bytes) { return no_memory(bytes) ? nullptr : __libc_realloc(old, bytes); }
void* memalign(size_t alignment, size_t bytes) { return aligned(alignment, bytes); }
void* aligned_alloc(size_t alignment, size_t bytes) { return aligned(alignment, bytes); }
int posix_memalign(void** out, size_t alignment, size_t bytes) {
  void* found = aligned(alignment, bytes);
  return found == nullptr ? ENOMEM : (*out = found, 0);
}

}  // extern "C"
