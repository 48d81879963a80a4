// The command-line tool as a function.
#pragma once

namespace lumigrove {

// Parses, runs one command, and turns what it throws into a sentence on stderr and an exit status: 0 done, 1
// failed, 2 wrong usage, 128 + n ended by signal n. Throws nothing.
int run_tool(int argc, char** argv);

}  // namespace lumigrove
