# cmake -DTESTS=<executable> -DLABEL=<ctest label> -DOUTPUT=<file> -P discover_suites.cmake
# Writes one ctest test for each GoogleTest suite. Not one for each claim, as gtest_discover_tests would: loading
# OpenImageIO's many libraries takes longer than most tests do.
execute_process(COMMAND ${TESTS} --gtest_list_tests OUTPUT_VARIABLE listing COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "[^\n]+" lines "${listing}")
set(content "")
foreach(line IN LISTS lines)
  if(line MATCHES "^([A-Za-z0-9_/]+)\\.")
    set(suite ${CMAKE_MATCH_1})
    string(APPEND content "add_test([==[${suite}]==] [==[${TESTS}]==] --gtest_brief=1 [==[--gtest_filter=${suite}.*]==])\n"
                          "set_tests_properties([==[${suite}]==] PROPERTIES LABELS ${LABEL} TIMEOUT 600)\n")
  endif()
endforeach()
file(WRITE ${OUTPUT} "${content}")
