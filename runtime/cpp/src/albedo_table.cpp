#include "ln/albedo_table.hpp"

namespace ln::albedo_table {
#include "ln/albedo_tables.inc"
}  // namespace ln::albedo_table
