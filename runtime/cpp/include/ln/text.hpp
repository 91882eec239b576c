#pragma once
// Text for messages: what comes out of a file is never printed raw.

#include <cstddef>
#include <string>
#include <string_view>

namespace ln {

/// `text` fit for a terminal: control characters (also DEL and U+0080 to U+009F), backslashes and bytes that are not UTF-8 are
/// escaped (`\n`, `\x1b`), and what goes beyond `max_bytes` is replaced by "...".
std::string printable(std::string_view text, std::size_t max_bytes = 240);

/// The same in quotation marks.
std::string quoted(std::string_view text, std::size_t max_bytes = 240);

/// The shortest decimal text that reads back as `value`.
std::string number_text(double value);

/// "7 bytes", "1.5 GiB".
std::string bytes_text(double bytes);

}  // namespace ln
