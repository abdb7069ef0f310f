// A library to preload: it numbers the calls of a command that change files, and lets one of them fail.
//
// Counted are calls on files in the folder FAULT_ROOT and writes to the file FAULT_STDOUT, of the process and its
// children, with the number in the file FAULT_COUNT, which they share. FAULT_KIND says what happens at number FAULT_AT:
//   off, count, count-output: nothing; no calls, all calls, or writes to standard output are counted
//   error     the call fails with EIO
//   full      half of the bytes are written; from then on nothing grows (ENOSPC)
//   readonly  from then on no file can be made, moved or removed (EROFS)
//   pipe      only writes to standard output count; from then on they fail with EPIPE
//   kill      half of the bytes are written, then SIGKILL ends the process
//   memory    only allocations of FAULT_BYTES or more count; that one fails
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

#include <atomic>
#include <string>

extern "C" {
void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
}

namespace {

enum class Kind { off, count, count_output, error, full, readonly, pipe, kill, memory };
enum class Act { write, make, change, sync };  // change: moves, removals and modes

std::atomic<long>* counter = nullptr;
long at = -1;
size_t least_bytes = 0;
Kind kind = Kind::off;
char root[PATH_MAX], output[PATH_MAX];

template <class F>
F next(const char* name) {
  return reinterpret_cast<F>(dlsym(RTLD_NEXT, name));
}

const char* variable(const char* name) {
  const char* out = getenv(name);
  return out ? out : "";
}

__attribute__((constructor)) void begin() {
  static const char* names[] = {"off", "count", "count-output", "error", "full", "readonly", "pipe", "kill", "memory"};
  const char* wanted = variable("FAULT_KIND");
  strncpy(root, variable("FAULT_ROOT"), sizeof root - 1);
  strncpy(output, variable("FAULT_STDOUT"), sizeof output - 1);
  at = atol(variable("FAULT_AT"));
  least_bytes = static_cast<size_t>(atol(variable("FAULT_BYTES")));
  const int file = next<int (*)(const char*, int, ...)>("open")(variable("FAULT_COUNT"), O_RDWR | O_CLOEXEC);
  if (file < 0) return;
  void* shared = mmap(nullptr, sizeof(long), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  close(file);
  if (shared == MAP_FAILED) return;
  counter = static_cast<std::atomic<long>*>(shared);
  for (int k = 0; k < 9; ++k)
    if (strcmp(wanted, names[k]) == 0) kind = static_cast<Kind>(k);
}

bool is_inside(const char* path) {
  const size_t length = strlen(root);
  return length > 0 && strncmp(path, root, length) == 0 && (path[length] == '/' || path[length] == 0);
}

bool path_counts(int folder, const char* path) {
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

bool file_counts(int file) {
  if (kind == Kind::off) return false;
  char there[PATH_MAX];
  const ssize_t length = readlink(("/proc/self/fd/" + std::to_string(file)).c_str(), there, sizeof there - 1);
  if (length < 0) return false;
  there[length] = 0;
  if (kind == Kind::pipe || kind == Kind::count_output) return strcmp(there, output) == 0;
  return is_inside(there) || strcmp(there, output) == 0;
}

// Numbers a call. Returns the error that it must fail with, or 0; `half` is set if half of the bytes are written first.
int fault(Act act, bool* half = nullptr) {
  if (kind == Kind::off || kind == Kind::memory ||
      ((kind == Kind::pipe || kind == Kind::count_output) && act != Act::write))
    return 0;
  const long number = counter->fetch_add(1);
  if (number < at || kind == Kind::count || kind == Kind::count_output) return 0;
  switch (kind) {
    case Kind::error:
      return number == at ? EIO : 0;
    case Kind::full:
      if (act != Act::write && act != Act::make) return 0;
      if (number == at && half) return *half = true, 0;
      return ENOSPC;
    case Kind::readonly:
      return act == Act::make || act == Act::change ? EROFS : 0;
    case Kind::pipe:
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
void finish_half() {
  if (kind == Kind::kill) ::kill(getpid(), SIGKILL);
}

bool no_memory(size_t bytes) { return kind == Kind::memory && bytes >= least_bytes && counter->fetch_add(1) == at; }

int open_file(int folder, const char* path, int flags, mode_t mode) {
  static const auto real = next<int (*)(int, const char*, int, ...)>("openat");
  const bool makes = (flags & O_CREAT) != 0 || (flags & O_ACCMODE) != O_RDONLY;
  if (makes && path_counts(folder, path))
    if (const int error = fault(Act::make)) return errno = error, -1;
  return real(folder, path, flags, mode);
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

int changed(int folder, const char* path, Act act) { return path_counts(folder, path) ? fault(act) : 0; }

}  // namespace

#define MODE()                           \
  mode_t mode = 0;                       \
  if (flags & (O_CREAT | __O_TMPFILE)) { \
    va_list more;                        \
    va_start(more, flags);               \
    mode = va_arg(more, mode_t);         \
    va_end(more);                        \
  }

extern "C" {

int open(const char* path, int flags, ...) {
  MODE()
  return open_file(AT_FDCWD, path, flags, mode);
}
int open64(const char* path, int flags, ...) {
  MODE()
  return open_file(AT_FDCWD, path, flags, mode);
}
int openat(int folder, const char* path, int flags, ...) {
  MODE()
  return open_file(folder, path, flags, mode);
}
int openat64(int folder, const char* path, int flags, ...) {
  MODE()
  return open_file(folder, path, flags, mode);
}

ssize_t write(int file, const void* data, size_t bytes) {
  static const auto real = next<ssize_t (*)(int, const void*, size_t)>("write");
  return write_bytes(file, bytes, [&](size_t count) { return real(file, data, count); });
}
ssize_t pwrite(int file, const void* data, size_t bytes, off_t offset) {
  static const auto real = next<ssize_t (*)(int, const void*, size_t, off_t)>("pwrite");
  return write_bytes(file, bytes, [&](size_t count) { return real(file, data, count, offset); });
}
ssize_t pwrite64(int file, const void* data, size_t bytes, off64_t offset) { return pwrite(file, data, bytes, offset); }
ssize_t writev(int file, const struct iovec* parts, int count) {
  static const auto real = next<ssize_t (*)(int, const struct iovec*, int)>("writev");
  return write_bytes(file, static_cast<size_t>(count) * 2,
                     [&](size_t some) { return real(file, parts, static_cast<int>((some + 1) / 2)); });
}
ssize_t sendfile(int to, int from, off_t* offset, size_t bytes) {
  static const auto real = next<ssize_t (*)(int, int, off_t*, size_t)>("sendfile");
  return write_bytes(to, bytes, [&](size_t count) { return real(to, from, offset, count); });
}
ssize_t sendfile64(int to, int from, off64_t* offset, size_t bytes) { return sendfile(to, from, offset, bytes); }
ssize_t copy_file_range(int from, off64_t* in, int to, off64_t* out, size_t bytes, unsigned flags) {
  static const auto real = next<ssize_t (*)(int, off64_t*, int, off64_t*, size_t, unsigned)>("copy_file_range");
  return write_bytes(to, bytes, [&](size_t count) { return real(from, in, to, out, count, flags); });
}

int fsync(int file) {
  if (file_counts(file))
    if (const int error = fault(Act::sync)) return errno = error, -1;
  return next<int (*)(int)>("fsync")(file);
}
int fdatasync(int file) {
  if (file_counts(file))
    if (const int error = fault(Act::sync)) return errno = error, -1;
  return next<int (*)(int)>("fdatasync")(file);
}
int ftruncate(int file, off_t length) {
  if (file_counts(file))
    if (const int error = fault(Act::sync)) return errno = error, -1;
  return next<int (*)(int, off_t)>("ftruncate")(file, length);
}
int ftruncate64(int file, off64_t length) { return ftruncate(file, length); }

int rename(const char* from, const char* to) {
  if (const int error = changed(AT_FDCWD, to, Act::change)) return errno = error, -1;
  return next<int (*)(const char*, const char*)>("rename")(from, to);
}
int renameat(int from_folder, const char* from, int to_folder, const char* to) {
  if (const int error = changed(to_folder, to, Act::change)) return errno = error, -1;
  return next<int (*)(int, const char*, int, const char*)>("renameat")(from_folder, from, to_folder, to);
}
int mkdir(const char* path, mode_t mode) {
  if (const int error = changed(AT_FDCWD, path, Act::make)) return errno = error, -1;
  return next<int (*)(const char*, mode_t)>("mkdir")(path, mode);
}
int mkdirat(int folder, const char* path, mode_t mode) {
  if (const int error = changed(folder, path, Act::make)) return errno = error, -1;
  return next<int (*)(int, const char*, mode_t)>("mkdirat")(folder, path, mode);
}
int chmod(const char* path, mode_t mode) {
  if (const int error = changed(AT_FDCWD, path, Act::change)) return errno = error, -1;
  return next<int (*)(const char*, mode_t)>("chmod")(path, mode);
}
int fchmodat(int folder, const char* path, mode_t mode, int flags) {
  if (const int error = changed(folder, path, Act::change)) return errno = error, -1;
  return next<int (*)(int, const char*, mode_t, int)>("fchmodat")(folder, path, mode, flags);
}

void* malloc(size_t bytes) { return no_memory(bytes) ? (errno = ENOMEM, nullptr) : __libc_malloc(bytes); }
void* calloc(size_t count, size_t bytes) {
  return no_memory(count * bytes) ? (errno = ENOMEM, nullptr) : __libc_calloc(count, bytes);
}
void* realloc(void* old, size_t bytes) {
  return no_memory(bytes) ? (errno = ENOMEM, nullptr) : __libc_realloc(old, bytes);
}

}  // extern "C"
