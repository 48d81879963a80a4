#include "tool.h"

int main(int argc, char** argv) { return lumigrove::run_tool(argc, argv); }
