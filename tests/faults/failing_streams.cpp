// Calls of the C library on streams: they reach the system inside of it. fprintf, fputs and the like count when the
// stream is flushed or closed. See numbering.hpp.
#include <stdio.h>
#include <stdio_ext.h>

#include "numbering.hpp"

using namespace faults;

namespace {

FILE* open_stream(const char* name, const char* path, const char* mode) {
  const bool makes = mode[0] != 'r' || strchr(mode, '+') != nullptr;
  if (makes)
    if (const int error = changed(AT_FDCWD, path, Act::make)) return errno = error, nullptr;
  return next<FILE* (*)(const char*, const char*)>(name)(path, mode);
}

// Discards the buffer of a stream and sets errno if writing it must fail. Returns whether it did.
bool fail_pending_write(FILE* stream) {
  const int error = stream != nullptr && __fpending(stream) > 0 ? changed(fileno(stream), Act::write) : 0;
  if (error == 0) return false;
  __fpurge(stream);
  errno = error;
  return true;
}

}  // namespace

extern "C" {

FILE* fopen(const char* path, const char* mode) { return open_stream("fopen", path, mode); }
FILE* fopen64(const char* path, const char* mode) { return open_stream("fopen64", path, mode); }

size_t fwrite(const void* data, size_t size, size_t count, FILE* stream) {
  static const auto real = next<size_t (*)(const void*, size_t, size_t, FILE*)>("fwrite");
  const size_t bytes = size * count;
  if (bytes == 0) return 0;
  const ssize_t out = write_bytes(fileno(stream), bytes, [&](size_t some) {
    const size_t written = real(data, 1, some, stream);
    if (some < bytes) next<int (*)(FILE*)>("fflush")(stream);
    return static_cast<ssize_t>(written);
  });
  if (out >= 0 && static_cast<size_t>(out) < bytes) errno = ENOSPC;
  return out < 0 ? 0 : static_cast<size_t>(out) / size;
}

int fflush(FILE* stream) { return fail_pending_write(stream) ? EOF : next<int (*)(FILE*)>("fflush")(stream); }

int fclose(FILE* stream) {
  const bool lost = fail_pending_write(stream);
  const int error = errno, out = next<int (*)(FILE*)>("fclose")(stream);
  if (lost) errno = error;
  return lost ? EOF : out;
}

}  // extern "C"
