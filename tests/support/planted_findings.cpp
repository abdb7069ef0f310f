// One fault for each sanitizer to find, in a library that Python loads as it loads the native core. See scripts/sanitize.sh.

#include <limits>
#include <thread>
#include <vector>

extern "C" {

int overflow() {  // address
  std::vector<int> values(4, 1);
  volatile int past = 4;
  return values.data()[past];
}

int float_cast() {  // undefined behaviour
  volatile double large = 1e300;
  return static_cast<int>(large);
}

int signed_overflow() {  // undefined behaviour
  volatile int largest = std::numeric_limits<int>::max();
  return largest + 1;
}

int race() {  // thread
  int shared = 0;
  std::thread first([&] { for (int k = 0; k < 1000; ++k) ++shared; });
  std::thread second([&] { for (int k = 0; k < 1000; ++k) ++shared; });
  first.join();
  second.join();
  return shared;
}

}
