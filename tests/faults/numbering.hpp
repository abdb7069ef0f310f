// Numbers the calls of a command that change files, and decides which of them fails. failing_*.cpp are preloaded with
// it.
//
// Counted are calls on files in the folder FAULT_ROOT and writes to the file FAULT_STDOUT, of the process and its
// children, with the number in the file FAULT_COUNT, which they share. FAULT_KIND says what happens at number FAULT_AT:
//   off, count, count-output, count-stderr: nothing; no calls, all calls, or writes to one stream are counted
//   error     the call fails with EIO
//   full      half of the bytes are written; from then on nothing grows and no file can be synced (ENOSPC)
//   readonly  from then on no file can be made, moved or removed (EROFS)
//   pipe      only writes to standard output count; from then on they fail with EPIPE
//   stderr    only writes to standard error, which is FAULT_STDERR, count; from then on they fail with EPIPE
//   kill      half of the bytes are written, then SIGKILL ends the process
//   memory    only allocations of FAULT_BYTES or more count; that one fails
#pragma once

#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <string>

namespace faults {

enum class Kind { off, count, count_output, count_messages, error, full, readonly, pipe, messages, kill, memory };
enum class Act { write, make, change, sync, resize };  // change: moves, removals and modes

inline std::atomic<long>* counter = nullptr;
inline long at = -1;
inline size_t least_bytes = 0;
inline Kind kind = Kind::off;
inline char root[PATH_MAX], output[PATH_MAX], messages[PATH_MAX];

template <class F>
F next(const char* name) {
  return reinterpret_cast<F>(dlsym(RTLD_NEXT, name));
}

inline const char* variable(const char* name) {
  const char* out = getenv(name);
  return out ? out : "";
}

// Returns the file of the stream whose writes alone count, or null where all calls count.
inline const char* only_stream() {
  if (kind == Kind::pipe || kind == Kind::count_output) return output;
  return kind == Kind::messages || kind == Kind::count_messages ? messages : nullptr;
}

inline bool is_inside(const char* path) {
  const size_t length = strlen(root);
  return length > 0 && strncmp(path, root, length) == 0 && (path[length] == '/' || path[length] == 0);
}

inline bool path_counts(int folder, const char* path) {
  if (kind == Kind::off || path == nullptr) return false;
  if (path[0] == '/') return is_inside(path);
  char name[64] = "/proc/self/cwd", there[PATH_MAX];
  if (folder != AT_FDCWD) {
    strcpy(name, "/proc/self/fd/");
    strcat(name, std::to_string(folder).c_str());
  }
  const ssize_t length = readlink(name, there, sizeof there - 1);
  if (length < 0) return false;
  there[length] = 0;
  return is_inside(there);
}

inline bool file_counts(int file) {
  if (kind == Kind::off || kind == Kind::memory) return false;
  char there[PATH_MAX];
  const ssize_t length = readlink(("/proc/self/fd/" + std::to_string(file)).c_str(), there, sizeof there - 1);
  if (length < 0) return false;
  there[length] = 0;
  if (const char* stream = only_stream()) return strcmp(there, stream) == 0;
  return is_inside(there) || strcmp(there, output) == 0;
}

// Numbers a call. Returns the error that it must fail with, or 0; `half` is set if half of the bytes are written first.
inline int fault(Act act, bool* half = nullptr) {
  if (kind == Kind::off || kind == Kind::memory || (only_stream() && act != Act::write)) return 0;
  const long number = counter->fetch_add(1);
  if (number < at) return 0;
  switch (kind) {
    case Kind::error:
      return number == at ? EIO : 0;
    case Kind::full:
      if (act == Act::change || act == Act::resize) return 0;
      if (number == at && half) return *half = true, 0;
      return ENOSPC;
    case Kind::readonly:
      return act == Act::make || act == Act::change ? EROFS : 0;
    case Kind::pipe:
    case Kind::messages:
      return EPIPE;
    case Kind::kill:
      if (number != at) return 0;
      if (half) return *half = true, 0;
      ::kill(getpid(), SIGKILL);
      return 0;
    default:
      return 0;
  }
}

// After half of the bytes were written.
inline void finish_half() {
  if (kind == Kind::kill) ::kill(getpid(), SIGKILL);
}

template <class Write>
ssize_t write_bytes(int file, size_t bytes, const Write& write) {
  if (!file_counts(file)) return write(bytes);
  bool half = false;
  if (const int error = fault(Act::write, &half)) return errno = error, -1;
  if (!half) return write(bytes);
  const ssize_t out = bytes > 1 ? write(bytes / 2) : (errno = ENOSPC, -1);
  finish_half();
  return out;
}

inline int changed(int folder, const char* path, Act act) { return path_counts(folder, path) ? fault(act) : 0; }
inline int changed(int file, Act act) { return file_counts(file) ? fault(act) : 0; }

// Returns what `call` returns, or -1 with `error` in errno.
template <class Call>
auto unless(int error, const Call& call) -> decltype(call()) {
  if (error == 0) return call();
  return errno = error, -1;
}

}  // namespace faults
