// Files that are compiled in: what every page carries inside itself.
#pragma once

namespace lumigrove {

extern const char* const kReportCss;  // report.css
extern const char* const kReportJs;   // report.js
extern const char* const kViewerHtml; // viewer.html: the section of the pictures

}  // namespace lumigrove
