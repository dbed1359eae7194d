# Installs programs, libraries, headers, the CMake package of find_package(partiemc), and a .pc file
# for each component.
# Each component is also a Debian package (docker/debian): server, client, c, python and dev (the rest).
include(CMakePackageConfigHelpers)
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME dev)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/partiemc)

# partiemc_pkg_config(NAME DESCRIPTION REQUIRES LIBS): installs partiemc-NAME.pc.
function(partiemc_pkg_config pc_name pc_description pc_requires pc_libs)
  set(pc_dir ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
  file(RELATIVE_PATH pc_prefix /${pc_dir} /)
  configure_file(core/package/partiemc.pc.in ${PROJECT_BINARY_DIR}/partiemc-${pc_name}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/partiemc-${pc_name}.pc DESTINATION ${pc_dir})
endfunction()

# One export set for each component, so that the core does not need gRPC.
set(PARTIEMC_COMPONENTS core)
install(TARGETS partiemc_core EXPORT partiemcCore)
install(DIRECTORY core/include/ TYPE INCLUDE)
install(EXPORT partiemcCore NAMESPACE partiemc:: DESTINATION ${package_dir})
partiemc_pkg_config(core "Outlines and meshes of particles (C++20)"
  "absl_status absl_statusor absl_strings tbb libhwy" "-lpartiemc_core -lmeshoptimizer -pthread")

if(PARTIEMC_SERVICE)
  list(APPEND PARTIEMC_COMPONENTS client)
  # The client library needs the codec and the common library (no headers), and the messages (with
  # headers, as programs may use the protocol without the client library).
  install(TARGETS partiemc_common partiemc_messages partiemc_proto partiemc_codec partiemc_wire
    partiemc_client EXPORT partiemcClient)
  set(programs partiemc)
  if(PARTIEMC_SERVER)
    list(APPEND programs partiemc-server)
  endif()
  if(PARTIEMC_SHARED)
    set_target_properties(${programs} PROPERTIES INSTALL_RPATH $ORIGIN/../${CMAKE_INSTALL_LIBDIR})
  endif()
  install(TARGETS partiemc COMPONENT client)
  if(PARTIEMC_SERVER)
    install(TARGETS partiemc-server COMPONENT server)
  endif()
  install(FILES client/recordings/dam_break.pemc client/recordings/README.md
    DESTINATION ${CMAKE_INSTALL_DATADIR}/partiemc/recordings COMPONENT client)
  install(DIRECTORY client/include/ TYPE INCLUDE)
  install(DIRECTORY ${PROJECT_BINARY_DIR}/proto/partiemc TYPE INCLUDE
    FILES_MATCHING PATTERN reconstruction.*.h)
  install(FILES proto/partiemc/v1/reconstruction.proto
    DESTINATION ${CMAKE_INSTALL_DATADIR}/partiemc/proto/partiemc/v1)
  install(EXPORT partiemcClient NAMESPACE partiemc:: DESTINATION ${package_dir})
  partiemc_pkg_config(client "Streams particles to a PartiEMC server (C++20)"
    "partiemc-core grpc++ protobuf"
    "-lpartiemc_client -lpartiemc_wire -lpartiemc_proto -lpartiemc_codec -lpartiemc_messages -lpartiemc_common")
endif()
if(PARTIEMC_C)
  list(APPEND PARTIEMC_COMPONENTS c)
  install(TARGETS partiemc_c EXPORT partiemcC LIBRARY COMPONENT c NAMELINK_COMPONENT dev)
  install(EXPORT partiemcC NAMESPACE partiemc:: DESTINATION ${package_dir})
  partiemc_pkg_config(c "Outlines and meshes of particles, for C and Fortran" "" "-lpartiemc_c")
endif()

configure_package_config_file(core/package/partiemcConfig.cmake.in partiemcConfig.cmake
  INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(partiemcConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/partiemcConfig.cmake
  ${PROJECT_BINARY_DIR}/partiemcConfigVersion.cmake DESTINATION ${package_dir})
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
if(PARTIEMC_DEBIAN)
  include(docker/debian/packages.cmake)
endif()
