# Writes ${OUTPUT}: the commit that is being built, "-dirty" when files differ from it, empty outside a repository.
# The file is touched only when its text changes, so that an unchanged tree compiles nothing.
execute_process(COMMAND git -C ${SOURCE} rev-parse --show-toplevel
                OUTPUT_VARIABLE top OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
set(commit "")
get_filename_component(source_path "${SOURCE}" REALPATH)
if(NOT failed AND "${top}" STREQUAL "${source_path}")  # not some other repository around an unpacked archive
  execute_process(COMMAND git -C ${SOURCE} describe --always --dirty --abbrev=12
                  OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
file(CONFIGURE OUTPUT ${OUTPUT} @ONLY CONTENT "#define LUMIGROVE_COMMIT \"${commit}\"\n")
