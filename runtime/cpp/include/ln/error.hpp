#pragma once
// How the runtime says that it cannot go on.

#include <stdexcept>

namespace ln {

/// Something the user can mend: a message that says where, what and how. Reported as one line, exit status 1.
struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Wrong use of the command line. Reported as one line, exit status 2.
struct UsageError : Error {
  using Error::Error;
};

/// Thrown where work stops before there is a picture because the user asked for it (Ctrl-C, SIGTERM). Exit status 130.
struct Interrupted {};

}  // namespace ln
