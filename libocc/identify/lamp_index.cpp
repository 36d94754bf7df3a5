// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/lamp_index.hpp"

#include "libocc/identify/internal/lamp_table.hpp"

namespace occ {

using namespace internal::identify;

LampIndex::LampIndex(const std::vector<Lamp>& lamps)
    : table_(std::make_shared<const LampTable>(lamps)) {}

bool LampIndex::applies() const { return table_->applies(); }

std::size_t LampIndex::triangles() const { return table_->triangles().size(); }

}  // namespace occ
