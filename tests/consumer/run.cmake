# cmake -DBUILD=<build tree of lumigrove> -DWORK=<folder to use> -DCXX=<compiler> -P run.cmake
# Installs Lumigrove, builds the consumer against nothing but the install tree, renders a picture with it and looks at
# the file.
function(run)
  execute_process(COMMAND ${ARGV} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

file(REMOVE_RECURSE ${WORK})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix)
file(RENAME ${WORK}/prefix ${WORK}/moved)  # an install tree must not remember where it was made
run(${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR} -B ${WORK}/build -G Ninja -DCMAKE_BUILD_TYPE=Release
    -DCMAKE_CXX_COMPILER=${CXX} -DCMAKE_PREFIX_PATH=${WORK}/moved)
run(${CMAKE_COMMAND} --build ${WORK}/build)
run(${WORK}/build/render_scene single ${WORK}/picture.png 4)

file(SIZE ${WORK}/picture.png bytes)
file(READ ${WORK}/picture.png magic LIMIT 8 HEX)
if(NOT magic STREQUAL "89504e470d0a1a0a" OR bytes LESS 10000)
  message(FATAL_ERROR "render_scene wrote ${bytes} bytes that are not a rendered 640x360 PNG")
endif()
run(${WORK}/moved/bin/lumigrove --version)
