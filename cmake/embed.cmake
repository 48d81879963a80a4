# Writes ${OUTPUT}: a C++ source that defines lumigrove::${NAME}, the text of the file ${INPUT}. Runs as a script.
# Raw strings are cut into pieces, because compilers need only take 65536 characters in one.
file(READ ${INPUT} text)
string(LENGTH "${text}" length)
set(pieces "")
set(at 0)
while(at LESS length)
  string(SUBSTRING "${text}" ${at} 8000 piece)
  string(APPEND pieces "R\"~~~(${piece})~~~\"\n")
  math(EXPR at "${at} + 8000")
endwhile()
file(WRITE ${OUTPUT} "#include \"assets.h\"\n\nnamespace lumigrove {\nconst char* const ${NAME} =\n${pieces};\n}\n")
