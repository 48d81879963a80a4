// What `lumigrove audit` found, as text and as JSON.
#pragma once

#include <string>
#include <vector>

#include "frame/audit.h"

namespace lumigrove {

struct AuditReport {
  std::string scene;
  AuditOptions options;
  std::vector<AuditPoint> points;
  std::vector<AuditRow> rows;
  std::vector<std::vector<std::string>> methods;  // of each row
  std::vector<std::string> notes;                 // sentences about what was left out
  std::uint32_t emitters = 0;
  std::uint32_t never_found_count = 0;            // lights that shine at none of the points
  std::vector<LightName> never_found;             // the first of them

  bool holds() const;
};

std::string audit_text(const AuditReport& report);
std::string audit_json(const AuditReport& report);

}  // namespace lumigrove
