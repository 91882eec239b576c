"""From a Schedule to the text of a C++ program."""
