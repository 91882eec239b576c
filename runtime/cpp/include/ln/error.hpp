#pragma once
// The one exception type for what the user can mend.

#include <stdexcept>

namespace ln {

/// Something the user can mend: a message that says where, what and how. Reported as one line, exit status 1.
struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace ln
