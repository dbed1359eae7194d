# Debian packages by CPack: docker/debian/build.sh. One package for each of five install components.
# Manual pages are generated from --help.
find_program(HELP2MAN help2man REQUIRED)
find_program(GZIP gzip REQUIRED)

# partiemc_manual_page(PAGE NAME COMPONENT PROGRAM [VERB])
function(partiemc_manual_page page name component program)
  set(file ${PROJECT_BINARY_DIR}/manual/${page}.1.gz)
  add_custom_command(OUTPUT ${file}
    COMMAND ${CMAKE_CURRENT_LIST_DIR}/manual_page.sh ${file} ${page} ${name}
      $<TARGET_FILE:${program}> ${ARGN}
    DEPENDS ${program} ${CMAKE_CURRENT_LIST_DIR}/manual_page.sh
    VERBATIM)
  set_property(GLOBAL APPEND PROPERTY PARTIEMC_MANUAL_PAGES ${file})
  install(FILES ${file} DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT ${component})
endfunction()
partiemc_manual_page(partiemc-server "serves outlines of streamed particles" server partiemc-server)
partiemc_manual_page(partiemc "outlines and meshes of particles" client partiemc)
partiemc_manual_page(partiemc-replay "reconstructs a recorded sequence" client partiemc replay)
partiemc_manual_page(partiemc-watch "shows what a live stream gives" client partiemc watch)
partiemc_manual_page(partiemc-streams "lists the streams of a server" client partiemc streams)
partiemc_manual_page(partiemc-info "asks a server for version and limits" client partiemc info)
partiemc_manual_page(partiemc-load "measures what a server bears" client partiemc load)
partiemc_manual_page(partiemc-convert "turns any input into a recording" client partiemc convert)
get_property(pages GLOBAL PROPERTY PARTIEMC_MANUAL_PAGES)
add_custom_target(partiemc_manual ALL DEPENDS ${pages})

set(here ${CMAKE_CURRENT_LIST_DIR})
install(FILES ${here}/server/partiemc-server.service DESTINATION lib/systemd/system COMPONENT server)
install(FILES ${here}/server/sysusers.conf RENAME partiemc.conf DESTINATION lib/sysusers.d COMPONENT server)
install(FILES ${here}/server/server.toml DESTINATION /etc/partiemc COMPONENT server)
foreach(program IN ITEMS partiemc partiemc-server)
  set(component client)
  if(program STREQUAL partiemc-server)
    set(component server)
  endif()
  install(FILES ${here}/completion.bash RENAME ${program}
    DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT ${component})
endforeach()

foreach(pair IN ITEMS server:partiemc-server client:partiemc dev:libpartiemc-dev c:libpartiemc-c1
        python:python3-partiemc)
  string(REGEX MATCH "^(.*):(.*)$" matched ${pair})
  install(FILES LICENSE RENAME copyright
    DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${CMAKE_MATCH_2} COMPONENT ${CMAKE_MATCH_1})
endforeach()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VENDOR PartiEMC)
set(CPACK_PACKAGE_CONTACT "the developers of PartiEMC <maintainers@partiemc.example>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_COMPONENTS_ALL server client dev c python)

set(CPACK_DEBIAN_SERVER_PACKAGE_NAME partiemc-server)
set(CPACK_COMPONENT_SERVER_DESCRIPTION
  "Outlines of streamed particles: the server\n Takes particle frames over gRPC or WebSocket, gives back isolines and meshes.")
set(CPACK_DEBIAN_SERVER_PACKAGE_SECTION science)
set(CPACK_DEBIAN_SERVER_PACKAGE_CONTROL_EXTRA 
  "${here}/server/conffiles;${here}/server/postinst;${here}/server/prerm")
set(CPACK_DEBIAN_CLIENT_PACKAGE_NAME partiemc)
set(CPACK_COMPONENT_CLIENT_DESCRIPTION
  "Outlines of streamed particles: the command line\n Replays recordings, watches streams, converts files.")
set(CPACK_DEBIAN_CLIENT_PACKAGE_SECTION science)
set(CPACK_DEBIAN_CLIENT_PACKAGE_SUGGESTS partiemc-server)
set(CPACK_DEBIAN_C_PACKAGE_NAME libpartiemc-c1)
set(CPACK_COMPONENT_C_DESCRIPTION
  "Outlines of streamed particles: library for C and Fortran\n Streams frames to a server, or reconstructs them in the same process.")
set(CPACK_DEBIAN_C_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_DEV_PACKAGE_NAME libpartiemc-dev)
set(CPACK_COMPONENT_DEV_DESCRIPTION
  "Outlines of streamed particles: for developers\n Libraries and headers of C++ and C, the contract of the service.")
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS
  "libpartiemc-c1 (= ${PROJECT_VERSION}-1), libgrpc++-dev, libprotobuf-dev, libabsl-dev, libtbb-dev, libhwy-dev, libmeshoptimizer-dev")
set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-partiemc)
set(CPACK_COMPONENT_PYTHON_DESCRIPTION
  "Outlines of streamed particles: for Python\n NumPy arrays in, NumPy arrays out, in process or by a server.")
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${here}/python/prerm)
find_package(Python3 REQUIRED COMPONENTS Interpreter)
math(EXPR next_minor "${Python3_VERSION_MINOR} + 1")
set(python3 "python3 (>= 3.${Python3_VERSION_MINOR}), python3 (<< 3.${next_minor})")
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "${python3}, python3-numpy")
include(CPack)
