#include "ln/dielectric_table.hpp"

#include <vector>

#include "ln/fresnel.hpp"
#include "ln/microfacet.hpp"

namespace ln {

DielectricTable::DielectricTable(float ior) : ior_(ior) {
  std::fill_n(&deficit_[0][0][0][0], sizeof(deficit_) / sizeof(float), 0.0f);
  std::fill_n(&average_[0][0][0], sizeof(average_) / sizeof(float), 0.0f);
}

}  // namespace ln
