// Calls that open and write files. See numbering.hpp.
#include <stdarg.h>
#include <sys/sendfile.h>
#include <sys/types.h>
#include <sys/uio.h>

#include "numbering.hpp"

using namespace faults;

namespace {

__attribute__((constructor)) void begin() {
  static const char* names[] = {"off",      "count", "count-output", "count-stderr", "error", "full",
                                "readonly", "pipe",  "stderr",       "kill",         "memory"};
  const char* wanted = variable("FAULT_KIND");
  strncpy(root, variable("FAULT_ROOT"), sizeof root - 1);
  strncpy(output, variable("FAULT_STDOUT"), sizeof output - 1);
  strncpy(messages, variable("FAULT_STDERR"), sizeof messages - 1);
  at = atol(variable("FAULT_AT"));
  least_bytes = static_cast<size_t>(atol(variable("FAULT_BYTES")));
  const int file = next<int (*)(const char*, int, ...)>("open")(variable("FAULT_COUNT"), O_RDWR | O_CLOEXEC);
  if (file < 0) return;
  void* shared = mmap(nullptr, sizeof(long), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  close(file);
  if (shared == MAP_FAILED) return;
  counter = static_cast<std::atomic<long>*>(shared);
  for (int k = 0; k < 11; ++k)
    if (strcmp(wanted, names[k]) == 0) kind = static_cast<Kind>(k);
}

int open_file(int folder, const char* path, int flags, mode_t mode) {
  static const auto real = next<int (*)(int, const char*, int, ...)>("openat");
  const bool makes = (flags & O_CREAT) != 0 || (flags & O_ACCMODE) != O_RDONLY;
  if (makes && path_counts(folder, path))
    if (const int error = fault(Act::make)) return errno = error, -1;
  return real(folder, path, flags, mode);
}

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
int creat(const char* path, mode_t mode) { return open_file(AT_FDCWD, path, O_CREAT | O_WRONLY | O_TRUNC, mode); }
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
  return unless(changed(file, Act::sync), [&] { return next<int (*)(int)>("fsync")(file); });
}
int fdatasync(int file) {
  return unless(changed(file, Act::sync), [&] { return next<int (*)(int)>("fdatasync")(file); });
}
int ftruncate(int file, off_t length) {
  return unless(changed(file, Act::resize), [&] { return next<int (*)(int, off_t)>("ftruncate")(file, length); });
}
int ftruncate64(int file, off64_t length) { return ftruncate(file, length); }

}  // extern "C"
