// Calls that make, move and remove files and folders. See numbering.hpp.
#include <stdio.h>
#include <sys/stat.h>
#include <sys/types.h>

#include "numbering.hpp"

using namespace faults;

namespace {

int moved(int from_folder, const char* from, int to_folder, const char* to) {
  return path_counts(from_folder, from) || path_counts(to_folder, to) ? fault(Act::change) : 0;
}

}  // namespace

extern "C" {

int unlink(const char* path) {
  return unless(changed(AT_FDCWD, path, Act::change), [&] { return next<int (*)(const char*)>("unlink")(path); });
}
int unlinkat(int folder, const char* path, int flags) {
  return unless(changed(folder, path, Act::change),
                [&] { return next<int (*)(int, const char*, int)>("unlinkat")(folder, path, flags); });
}
int rmdir(const char* path) {
  return unless(changed(AT_FDCWD, path, Act::change), [&] { return next<int (*)(const char*)>("rmdir")(path); });
}
int remove(const char* path) {
  return unless(changed(AT_FDCWD, path, Act::change), [&] { return next<int (*)(const char*)>("remove")(path); });
}
int rename(const char* from, const char* to) {
  return unless(moved(AT_FDCWD, from, AT_FDCWD, to),
                [&] { return next<int (*)(const char*, const char*)>("rename")(from, to); });
}
int renameat(int from_folder, const char* from, int to_folder, const char* to) {
  return unless(moved(from_folder, from, to_folder, to), [&] {
    return next<int (*)(int, const char*, int, const char*)>("renameat")(from_folder, from, to_folder, to);
  });
}
int renameat2(int from_folder, const char* from, int to_folder, const char* to, unsigned flags) {
  return unless(moved(from_folder, from, to_folder, to), [&] {
    return next<int (*)(int, const char*, int, const char*, unsigned)>("renameat2")(from_folder, from, to_folder, to,
                                                                                    flags);
  });
}
int link(const char* from, const char* to) {
  return unless(changed(AT_FDCWD, to, Act::make),
                [&] { return next<int (*)(const char*, const char*)>("link")(from, to); });
}
int linkat(int from_folder, const char* from, int to_folder, const char* to, int flags) {
  return unless(changed(to_folder, to, Act::make), [&] {
    return next<int (*)(int, const char*, int, const char*, int)>("linkat")(from_folder, from, to_folder, to, flags);
  });
}
int symlink(const char* from, const char* to) {
  return unless(changed(AT_FDCWD, to, Act::make),
                [&] { return next<int (*)(const char*, const char*)>("symlink")(from, to); });
}
int symlinkat(const char* from, int folder, const char* to) {
  return unless(changed(folder, to, Act::make),
                [&] { return next<int (*)(const char*, int, const char*)>("symlinkat")(from, folder, to); });
}
int mkdir(const char* path, mode_t mode) {
  return unless(changed(AT_FDCWD, path, Act::make),
                [&] { return next<int (*)(const char*, mode_t)>("mkdir")(path, mode); });
}
int mkdirat(int folder, const char* path, mode_t mode) {
  return unless(changed(folder, path, Act::make),
                [&] { return next<int (*)(int, const char*, mode_t)>("mkdirat")(folder, path, mode); });
}
int truncate(const char* path, off_t length) {
  return unless(changed(AT_FDCWD, path, Act::change),
                [&] { return next<int (*)(const char*, off_t)>("truncate")(path, length); });
}
int truncate64(const char* path, off64_t length) { return truncate(path, length); }
int chmod(const char* path, mode_t mode) {
  return unless(changed(AT_FDCWD, path, Act::change),
                [&] { return next<int (*)(const char*, mode_t)>("chmod")(path, mode); });
}
int fchmod(int file, mode_t mode) {
  return unless(changed(file, Act::change), [&] { return next<int (*)(int, mode_t)>("fchmod")(file, mode); });
}
int fchmodat(int folder, const char* path, mode_t mode, int flags) {
  return unless(changed(folder, path, Act::change),
                [&] { return next<int (*)(int, const char*, mode_t, int)>("fchmodat")(folder, path, mode, flags); });
}

}  // extern "C"
