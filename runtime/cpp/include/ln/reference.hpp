#pragma once
// The reference: a plain, slow tracer that keeps the light paths of an expression and nothing else.
//
// From the eye, a set of states of the language says what has been seen (PathLanguage::States). At each surface every event
// that some beginning of a path fits to is followed by itself: its lobe alone is evaluated and sampled, so that no light is
// labelled wrongly. Each path is found in one way, by its first and last events:
//   L@area ... E               from the eye, by hits and light samples with the balance heuristic
//   L@delta (D|G) ... E        from the eye, by light samples
//   L@delta S ... (D|G) E      particles from the light, connected to the camera (before the picture; `particles.count`)
//   L@delta S ... S E          an eye path and a particle, connected at the first two surfaces in a row, from the light, that
//                              scatter by D or G; where there are none, the path is lost, and the compiler says so
// Random numbers are independent: standard errors from different seeds, or from blocks of pixels, are what they seem.

#include <span>

#include "ln/path_language.hpp"

namespace ln {

/// The program: from the command line to the exit status. `text`: the expression. `tags`: numbered as in `paths`.
int run_reference(int argc, char** argv, const char* text, const PathLanguage& paths, std::span<const TagRule> tags);

}  // namespace ln
