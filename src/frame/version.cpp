namespace lumigrove {
const char* version();
const char* version() { return "0.1.0"; }
}  // namespace lumigrove
