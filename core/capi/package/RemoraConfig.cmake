# find_package(Remora) makes the target Remora::remora: header and archive beside this file's prefix.
if(NOT TARGET Remora::remora)
    get_filename_component(_remora_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
    add_library(Remora::remora STATIC IMPORTED)
    set_target_properties(Remora::remora PROPERTIES
        IMPORTED_LOCATION "${_remora_prefix}/lib/libremora.a"
        IMPORTED_LINK_INTERFACE_LANGUAGES "C"
        INTERFACE_INCLUDE_DIRECTORIES "${_remora_prefix}/include")
    unset(_remora_prefix)
endif()
