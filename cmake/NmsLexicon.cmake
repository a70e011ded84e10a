# nms_add_lexicon(<target> LEXICON <name or file.nms> OUTPUT <folder or file.glb> [FACE <name or file.nms>] [OPTIONS ...])
#
# Adds a target, built with `all`, that turns every entry of a lexicon into animated glTF. It runs when a source that the
# lexicon uses has changed, and then makes only those files whose clips changed. OPTIONS go to `nmsc build`.
function(nms_add_lexicon target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "LEXICON;OUTPUT;FACE" "OPTIONS")
  if(NOT arg_LEXICON OR NOT arg_OUTPUT)
    message(FATAL_ERROR "nms_add_lexicon(${target}): LEXICON and OUTPUT are needed")
  endif()
  if(arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "nms_add_lexicon(${target}): what is ${arg_UNPARSED_ARGUMENTS}?")
  endif()
  set(lexicon "${arg_LEXICON}")
  set(depends "${NMS_NMSC}")
  if(lexicon MATCHES "\\.nms$")
    cmake_path(ABSOLUTE_PATH lexicon BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}")
    list(APPEND depends "${lexicon}")
  endif()
  set(face)
  if(arg_FACE)
    if(arg_FACE MATCHES "\\.nms$")
      cmake_path(ABSOLUTE_PATH arg_FACE BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}")
      list(APPEND depends "${arg_FACE}")
    endif()
    set(face --face "${arg_FACE}")
  endif()
  cmake_path(ABSOLUTE_PATH arg_OUTPUT BASE_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}" OUTPUT_VARIABLE output)
  set(result "${output}/manifest.json")
  if(output MATCHES "\\.glb$")
    set(result "${output}")
  endif()
  # A manifest that did not change is not written again; the stamp says that it was looked at.
  set(stamp "${CMAKE_CURRENT_BINARY_DIR}/${target}.stamp")
  add_custom_command(
    OUTPUT "${stamp}"
    BYPRODUCTS "${result}"
    COMMAND "${NMS_NMSC}" build --lexicon "${lexicon}" -o "${output}" ${face} ${arg_OPTIONS}
            --depfile "${stamp}.d" --depfile-target "${stamp}"
    COMMAND "${CMAKE_COMMAND}" -E touch "${stamp}"
    DEPENDS ${depends}
    DEPFILE "${stamp}.d"
    COMMENT "Building lexicon ${arg_LEXICON}"
    VERBATIM)
  add_custom_target("${target}" ALL DEPENDS "${stamp}")
endfunction()
